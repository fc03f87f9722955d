// SPDX-License-Identifier: Apache-2.0
//
// Memory that only a simulated device may touch. Its pages are closed to the host but for the time
// in which simulated work runs: a host that reads a count in the middle of a build, which on a real
// device would be a hidden synchronisation or a crash, gets SIGSEGV and one line that says so. So
// does work that leaves the memory it was given: addresses are never used twice, and nothing lies
// next to a block.
//
// For one thread.
#pragma once

#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <new>
#include <stdexcept>
#include <string>

#include "support/random.hpp"

namespace zkd::simulated {

/// All addresses of the simulated device.
class AddressSpace {
 public:
  /// Never destroyed: trees with static storage give memory back late.
  static AddressSpace& instance() {
    static auto& space = *new AddressSpace;
    return space;
  }

  [[nodiscard]] bool contains(const void* pointer) const noexcept {
    const auto* byte = static_cast<const std::byte*>(pointer);
    return base_ <= byte && byte < base_ + size;
  }

  /// Aligned to 256, full of garbage, closed. It ends where the next page begins, as nearly as the
  /// alignment allows.
  void* allocate(std::size_t bytes) {
    const std::size_t length = rounded(bytes, page);
    if (length > size - used_ - page) throw std::bad_alloc();
    std::byte* first = base_ + used_;
    used_ += length + page;
    Block block{bytes, first, length};
    std::byte* data = first + (length - rounded(bytes, alignment));
    protect(block, PROT_READ | PROT_WRITE);
    fill_with_garbage(data, bytes);
    for_each_spare(data, block, [](std::byte& spare) { spare = canary; });
    if (open_ == 0) protect(block, PROT_NONE);
    blocks_.emplace(data, block);
    return data;
  }

  /// From now on nobody may touch it.
  void release(void* data) {
    const auto found = blocks_.find(static_cast<std::byte*>(data));
    if (found == blocks_.end())
      throw std::logic_error("simulated device: memory given back that was not given out");
    const Block& block = found->second;
    protect(block, PROT_READ);
    bool intact = true;
    for_each_spare(found->first, block, [&](std::byte& spare) { intact &= spare == canary; });
    protect(block, PROT_NONE);
    madvise(block.first, block.length, MADV_DONTNEED);
    blocks_.erase(found);
    if (!intact) throw std::logic_error("simulated device: a pass wrote beside its memory");
  }

  void fill_with_garbage(void* data, std::size_t bytes) {
    auto* to = static_cast<std::byte*>(data);
    for (std::size_t i = 0; i < bytes; i += sizeof(std::uint64_t)) {
      const std::uint64_t word = garbage_.bits64();
      std::memcpy(to + i, &word, std::min(sizeof word, bytes - i));
    }
  }

  /// While one of these lives, memory is open.
  class Open {
   public:
    Open() {
      if (instance().open_++ == 0) instance().protect_all(PROT_READ | PROT_WRITE);
    }
    ~Open() {
      if (--instance().open_ == 0) instance().protect_all(PROT_NONE);
    }
    Open(const Open&) = delete;
    Open& operator=(const Open&) = delete;
  };

  /// What runs now, for the line that a fault prints. Empty: the host.
  void name_work(const std::string& name) {
    const std::size_t length = std::min(name.size(), sizeof work_ - 1);
    std::memcpy(work_, name.data(), length);
    work_[length] = '\0';
  }

 private:
  struct Block {
    std::size_t bytes;
    std::byte* first;  ///< page
    std::size_t length;
  };

  static constexpr std::size_t size = std::size_t{1} << 40;
  static constexpr std::size_t alignment = 256;
  static constexpr std::byte canary{0xA5};

  AddressSpace() : page(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) {
    void* base = mmap(nullptr, size, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (base == MAP_FAILED) throw std::bad_alloc();
    base_ = static_cast<std::byte*>(base);
    used_ = page;
    struct sigaction action {};
    action.sa_sigaction = report_fault;
    action.sa_flags = SA_SIGINFO;
    sigaction(SIGSEGV, &action, &before_);
  }

  static std::size_t rounded(std::size_t bytes, std::size_t to) {
    return (bytes + to - 1) / to * to;
  }

  static void protect(const Block& block, int how) {
    if (mprotect(block.first, block.length, how) != 0) throw std::bad_alloc();
  }
  void protect_all(int how) {
    for (const auto& [data, block] : blocks_) protect(block, how);
  }

  /// Bytes of the block's pages that were not asked for.
  template <class Visit>
  static void for_each_spare(std::byte* data, const Block& block, const Visit& visit) {
    for (std::byte* byte = block.first; byte < data; ++byte) visit(*byte);
    for (std::byte* byte = data + block.bytes; byte < block.first + block.length; ++byte)
      visit(*byte);
  }

  /// Says who touched what, then lets the fault take its course.
  static void report_fault(int, siginfo_t* info, void*) {
    const AddressSpace& space = instance();
    char line[sizeof work_ + 200];
    int length = 0;
    if (space.open_ > 0)
      length =
          std::snprintf(line, sizeof line,
                        "simulated device: a pass touches memory it was not given, at %p: %s\n",
                        info->si_addr, space.work_);
    else
      length = std::snprintf(line, sizeof line, "simulated device: the host touches %s, at %p\n",
                             space.contains(info->si_addr) ? "device memory" : "what is not there",
                             info->si_addr);
    if (write(STDERR_FILENO, line, static_cast<std::size_t>(length)) < 0) _exit(1);
    sigaction(SIGSEGV, &space.before_, nullptr);
  }

  const std::size_t page;
  std::byte* base_ = nullptr;
  std::size_t used_ = 0;
  std::map<std::byte*, Block> blocks_;
  int open_ = 0;
  char work_[400] = "";
  test::Random garbage_{0x6A09E667F3BCC908u};
  struct sigaction before_ {};
};

}  // namespace zkd::simulated
