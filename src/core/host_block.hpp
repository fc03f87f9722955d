// SPDX-License-Identifier: Apache-2.0
//
// Blocks of host memory from the caller's resource.
#pragma once

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <new>
#include <string>
#include <utility>

#include <zkd/error.hpp>

#include "core/arena.hpp"

namespace zkd::core {

/// Large blocks fresh from the system cost a page fault for every 4 KB, a quarter of a build. With
/// huge pages it is one for every 2 MB. Only a hint, and only on memory that is not the caller's.
inline void ask_for_huge_pages([[maybe_unused]] void* data, [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__)
  constexpr std::uintptr_t page = std::uintptr_t{1} << 21;
  const auto begin = (reinterpret_cast<std::uintptr_t>(data) + page - 1) / page * page;
  const auto end = (reinterpret_cast<std::uintptr_t>(data) + bytes) / page * page;
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

/// One block, given back at the end of its life. Every failure to get one is an Error.
class HostBlock {
 public:
  HostBlock() = default;
  HostBlock(std::pmr::memory_resource* memory, std::size_t bytes) : memory_(memory), bytes_(bytes) {
    if (bytes == 0) return;
    try {
      data_ = memory->allocate(bytes, Arena::alignment);
    } catch (const std::bad_alloc&) {
      throw Error(ErrorCode::out_of_memory, bytes,
                  "the memory resource refused " + std::to_string(bytes) + " bytes");
    }
    if (memory == std::pmr::new_delete_resource()) ask_for_huge_pages(data_, bytes);
  }
  HostBlock(HostBlock&& other) noexcept
      : memory_(other.memory_), data_(std::exchange(other.data_, nullptr)), bytes_(other.bytes_) {}
  HostBlock& operator=(HostBlock&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~HostBlock() {
    if (data_ != nullptr) memory_->deallocate(data_, bytes_, Arena::alignment);
  }

  [[nodiscard]] void* data() const noexcept { return data_; }
  [[nodiscard]] std::pmr::memory_resource* memory() const noexcept { return memory_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
  /// The caller gives it back from now on.
  void* release() noexcept { return std::exchange(data_, nullptr); }

 private:
  std::pmr::memory_resource* memory_ = nullptr;
  void* data_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace zkd::core
