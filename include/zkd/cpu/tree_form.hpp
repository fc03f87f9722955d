// SPDX-License-Identifier: Apache-2.0
//
// What owns another form of a tree on the CPU (zkd/cpu/wide_tree.hpp, zkd/cpu/plane_tree.hpp).
#pragma once

#include <cstddef>
#include <memory_resource>
#include <utility>

namespace zkd::cpu {

/// Owns what a View names: one block from the memory resource that it was made with. Movable; one
/// that was moved from is empty. Reading one from several threads is safe.
template <class View>
class TreeForm {
 public:
  /// An empty one: every ray misses.
  TreeForm() = default;
  TreeForm(TreeForm&& other) noexcept { swap(other); }
  TreeForm& operator=(TreeForm&& other) noexcept {
    TreeForm(std::move(other)).swap(*this);
    return *this;
  }
  TreeForm(const TreeForm&) = delete;             // megabytes: make it again
  TreeForm& operator=(const TreeForm&) = delete;  // likewise
  ~TreeForm() {
    if (data_ != nullptr) memory_->deallocate(data_, bytes_, alignment);
  }

  /// What queries take. Valid until this is destroyed, assigned or moved from.
  [[nodiscard]] const View& view() const noexcept { return view_; }

  /// Bytes that it holds.
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }

 private:
  friend struct TreeFormAssembler;
  static constexpr std::size_t alignment = 64;

  void swap(TreeForm& other) noexcept {
    std::swap(view_, other.view_);
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    std::swap(memory_, other.memory_);
  }

  View view_;
  void* data_ = nullptr;
  std::size_t bytes_ = 0;
  std::pmr::memory_resource* memory_ = nullptr;
};

}  // namespace zkd::cpu
