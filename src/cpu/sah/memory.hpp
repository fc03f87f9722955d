// SPDX-License-Identifier: Apache-2.0
//
// Memory of an SAH build: blocks from the caller's resource, counted, taken by the calling thread
// only; and rooms in them that one thread takes arrays from and gives back in reverse order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <memory_resource>
#include <utility>

#include "core/arena.hpp"
#include "core/host_block.hpp"

namespace zkd::cpu::sah {

/// The resource, and what is held of it.
class Memory {
 public:
  explicit Memory(std::pmr::memory_resource* resource) : resource_(resource) {}

  [[nodiscard]] std::pmr::memory_resource* resource() const { return resource_; }
  [[nodiscard]] std::size_t most_held() const { return most_held_; }

 private:
  friend class Block;
  std::pmr::memory_resource* resource_;
  std::size_t held_ = 0;
  std::size_t most_held_ = 0;
};

/// Working memory, given back at the end of its life or by clear().
class Block {
 public:
  Block() = default;
  /// Throws Error out_of_memory.
  Block(Memory& memory, std::size_t bytes) : memory_(&memory), block_(memory.resource_, bytes) {
    memory_->held_ += bytes;
    memory_->most_held_ = std::max(memory_->most_held_, memory_->held_);
  }
  Block(Block&& other) noexcept
      : memory_(std::exchange(other.memory_, nullptr)), block_(std::move(other.block_)) {}
  Block& operator=(Block&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(block_, other.block_);
    return *this;
  }
  ~Block() {
    if (memory_ != nullptr) memory_->held_ -= block_.bytes();
  }
  void clear() { *this = Block(); }

  [[nodiscard]] void* data() const { return block_.data(); }
  [[nodiscard]] std::size_t bytes() const { return block_.bytes(); }

 private:
  Memory* memory_ = nullptr;
  core::HostBlock block_;
};

/// A block of the size that `lay_out(arena)` takes, laid out.
template <class LayOut>
Block lay_out_block(Memory& memory, const LayOut& lay_out) {
  core::Arena count;
  lay_out(count);
  Block block(memory, count.used());
  core::Arena arena(block.data());
  lay_out(arena);
  return block;
}

/// Part of a block that arrays are taken from until it is exhausted. They are given back last taken
/// first, by going back to a mark.
class Room {
 public:
  Room() = default;
  Room(void* block, std::size_t bytes) : block_(static_cast<std::byte*>(block)), bytes_(bytes) {}

  /// Null, and exhausted() from then on until it is taken back to a mark, where there is too little
  /// left.
  template <class T>
  T* take(std::size_t count) {
    static_assert(alignof(T) <= alignment);
    const std::size_t size = (count * sizeof(T) + alignment - 1) / alignment * alignment;
    if (size > bytes_ - used_) {
      exhausted_ = true;
      return nullptr;
    }
    T* array = reinterpret_cast<T*>(block_ + used_);
    used_ += size;
    return array;
  }

  [[nodiscard]] std::size_t mark() const { return used_; }
  void back_to(std::size_t mark) {
    used_ = mark;
    exhausted_ = false;
  }
  [[nodiscard]] bool exhausted() const { return exhausted_; }

 private:
  static constexpr std::size_t alignment = 8;  // most parts are small

  std::byte* block_ = nullptr;
  std::size_t bytes_ = 0;
  std::size_t used_ = 0;
  bool exhausted_ = false;
};

/// An array that grows, of things that can be moved.
template <class T>
class List {
 public:
  explicit List(Memory& memory) : memory_(&memory) {}
  ~List() { std::destroy_n(data(), size_); }
  List(const List&) = delete;             // one owner
  List& operator=(const List&) = delete;  // likewise

  /// Throws Error out_of_memory, and is then as before.
  T& add(T&& value) {
    if ((size_ + 1) * sizeof(T) > block_.bytes()) {
      Block larger(*memory_, std::max<std::size_t>(16, 2 * size_) * sizeof(T));
      std::uninitialized_move_n(data(), size_, static_cast<T*>(larger.data()));
      std::destroy_n(data(), size_);
      block_ = std::move(larger);
    }
    return *std::construct_at(data() + size_++, std::move(value));
  }

  [[nodiscard]] T* data() const { return static_cast<T*>(block_.data()); }
  [[nodiscard]] std::size_t size() const { return size_; }
  T& operator[](std::size_t i) const { return data()[i]; }

 private:
  Memory* memory_;
  Block block_;
  std::size_t size_ = 0;
};

}  // namespace zkd::cpu::sah
