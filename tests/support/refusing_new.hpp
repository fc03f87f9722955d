// SPDX-License-Identifier: Apache-2.0
//
// Every operator new of this program counts, and can be made to refuse. For one source file of a
// program of its own; not under a sanitizer, which has operator new for itself.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ZKD_COUNTS_NEW 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define ZKD_COUNTS_NEW 0
#endif
#endif
#ifndef ZKD_COUNTS_NEW
#define ZKD_COUNTS_NEW 1
#endif

namespace zkd::test {

inline std::atomic<std::size_t> news{0};         ///< calls of operator new
inline std::atomic<std::size_t> live_blocks{0};  ///< of these not yet deleted

/// Calls number first .. last (from 1, counted from the constructor) throw std::bad_alloc while
/// this lives.
class RefuseNew {
 public:
  static constexpr std::size_t all = std::numeric_limits<std::size_t>::max();

  RefuseNew(std::size_t first, std::size_t last) : before_(news) {
    last_refused = last == all ? all : before_ + last;
    first_refused = before_ + first;
  }
  ~RefuseNew() {
    first_refused = all;
    last_refused = 0;
  }
  RefuseNew(const RefuseNew&) = delete;
  RefuseNew& operator=(const RefuseNew&) = delete;

  [[nodiscard]] std::size_t calls() const { return news - before_; }

  static inline std::atomic<std::size_t> first_refused{all};
  static inline std::atomic<std::size_t> last_refused{0};

 private:
  std::size_t before_;
};

inline void count_new() {
  const std::size_t number = ++news;
  if (number >= RefuseNew::first_refused && number <= RefuseNew::last_refused) {
    throw std::bad_alloc();
  }
}

}  // namespace zkd::test

#if ZKD_COUNTS_NEW
// Not inlined, so that a compiler sees pairs of new and delete where there are some.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  zkd::test::count_new();
  void* const block = std::malloc(bytes == 0 ? 1 : bytes);
  if (block == nullptr) throw std::bad_alloc();
  ++zkd::test::live_blocks;
  return block;
}
[[gnu::noinline]] void* operator new(std::size_t bytes, std::align_val_t alignment) {
  zkd::test::count_new();
  const auto a = static_cast<std::size_t>(alignment);
  void* const block = std::aligned_alloc(a, (bytes + a - 1) / a * a + (bytes == 0 ? a : 0));
  if (block == nullptr) throw std::bad_alloc();
  ++zkd::test::live_blocks;
  return block;
}
[[gnu::noinline]] void operator delete(void* block) noexcept {
  if (block != nullptr) --zkd::test::live_blocks;
  std::free(block);
}
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept {
  operator delete(block);
}
[[gnu::noinline]] void operator delete(void* block, std::align_val_t) noexcept {
  operator delete(block);
}
[[gnu::noinline]] void operator delete(void* block, std::size_t, std::align_val_t) noexcept {
  operator delete(block);
}
#endif
