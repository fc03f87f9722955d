// SPDX-License-Identifier: Apache-2.0
//
// Hands out aligned arrays from one block, or, without a block, only counts what they would take:
// the same layout function says how much memory is needed and then uses it.
#pragma once

#include <cstddef>

namespace zkd::core {

class Arena {
 public:
  static constexpr std::size_t alignment = 64;  ///< a cache line, a Node

  Arena() = default;
  explicit Arena(void* block) : block_(static_cast<std::byte*>(block)) {}

  /// An array of `count` uninitialised elements; null when only counting.
  template <class T>
  T* take(std::size_t count) {
    static_assert(alignof(T) <= alignment);
    T* array = block_ != nullptr ? reinterpret_cast<T*>(block_ + used_) : nullptr;
    used_ += (count * sizeof(T) + alignment - 1) / alignment * alignment;
    return array;
  }

  [[nodiscard]] std::size_t used() const { return used_; }

 private:
  std::byte* block_ = nullptr;
  std::size_t used_ = 0;
};

/// Bytes that `layout.lay_out(arena, counts...)` takes.
template <class Layout, class... Counts>
std::size_t bytes_of(Layout layout, Counts... counts) {
  Arena arena;
  layout.lay_out(arena, counts...);
  return arena.used();
}

}  // namespace zkd::core
