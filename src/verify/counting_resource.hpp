// SPDX-License-Identifier: Apache-2.0
//
// A memory resource that counts, refuses, and remembers what it was asked.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <memory_resource>
#include <new>
#include <thread>

namespace zkd::verify {

/// Takes memory from malloc, so that a count of operator new sees nothing of it.
class CountingResource : public std::pmr::memory_resource {
 public:
  /// The allocation (from 1) that is refused; 0: none.
  std::size_t refuse_at = 0;
  /// Whether all that follow it are refused as well.
  bool refuse_all_from_there = false;
  /// Live bytes that may not be passed.
  std::size_t limit = std::numeric_limits<std::size_t>::max();

  [[nodiscard]] std::size_t live_bytes() const { return live_bytes_; }
  [[nodiscard]] std::size_t live_blocks() const { return live_blocks_; }
  [[nodiscard]] std::size_t peak_bytes() const { return peak_bytes_; }
  [[nodiscard]] std::size_t allocations() const { return allocations_; }
  /// A block came back with another size than it was given out with, or a call came from another
  /// thread than the one that made this resource.
  [[nodiscard]] bool misused() const { return misused_; }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    note_thread();
    ++allocations_;
    const bool refused = refuse_at != 0 && (refuse_all_from_there ? allocations_ >= refuse_at
                                                                  : allocations_ == refuse_at);
    if (refused || bytes > limit || live_bytes_ > limit - bytes) {
      throw std::bad_alloc();
    }
    const std::size_t front = std::max(alignment, 2 * sizeof(std::size_t));
    const std::size_t size = (bytes + front + alignment - 1) / alignment * alignment;
    auto* block = static_cast<std::byte*>(
        std::aligned_alloc(std::max<std::size_t>(alignment, 16), (size + 15) / 16 * 16));
    if (block == nullptr) throw std::bad_alloc();
    *reinterpret_cast<std::size_t*>(block + front - sizeof(std::size_t)) = bytes;
    live_bytes_ += bytes;
    ++live_blocks_;
    peak_bytes_ = std::max(peak_bytes_, live_bytes_);
    return block + front;
  }

  void do_deallocate(void* pointer, std::size_t bytes, std::size_t alignment) override {
    note_thread();
    const std::size_t front = std::max(alignment, 2 * sizeof(std::size_t));
    auto* block = static_cast<std::byte*>(pointer);
    if (*reinterpret_cast<std::size_t*>(block - sizeof(std::size_t)) != bytes) misused_ = true;
    live_bytes_ -= bytes;
    --live_blocks_;
    std::free(block - front);
  }

  [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override {
    return this == &other;
  }

  void note_thread() {
    if (std::this_thread::get_id() != thread_) misused_ = true;
  }

  std::thread::id thread_ = std::this_thread::get_id();
  std::size_t live_bytes_ = 0;
  std::size_t live_blocks_ = 0;
  std::size_t peak_bytes_ = 0;
  std::size_t allocations_ = 0;
  bool misused_ = false;
};

}  // namespace zkd::verify
