// SPDX-License-Identifier: Apache-2.0
//
// Device memory of a build: one block for the tree, one for everything else, both of a size that is
// known before anything runs. How much, a run of the same pipeline says that launches nothing. And
// memory for single stages and builders that may wait for the device.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <zkd/cuda/executor.hpp>
#include <zkd/error.hpp>

#include "core/arena.hpp"

namespace zkd::cuda {

/// What blocks and workspaces are aligned to, as cudaMalloc's are.
inline constexpr std::size_t block_alignment = 256;

/// One block of device memory, given back in the order of the stream. Every failure to get one is
/// an Error.
class DeviceBlock {
 public:
  DeviceBlock() = default;
  DeviceBlock(MemoryResource& memory, Stream stream, std::size_t bytes)
      : memory_(&memory), stream_(stream), bytes_(bytes) {
    if (bytes == 0) return;
    try {
      data_ = memory.allocate(bytes, stream);
    } catch (const Error&) {
      throw;
    } catch (...) {
      data_ = nullptr;
    }
    if (data_ == nullptr)
      throw Error(ErrorCode::out_of_memory, bytes,
                  "the device's memory resource refused " + std::to_string(bytes) + " bytes");
    if (reinterpret_cast<std::uintptr_t>(data_) % block_alignment != 0) {
      memory.deallocate(data_, bytes, stream);
      throw Error(ErrorCode::invalid_option, 0,
                  "the memory resource gave a block that is not aligned to " +
                      std::to_string(block_alignment) + " bytes");
    }
  }
  DeviceBlock(DeviceBlock&& other) noexcept
      : memory_(other.memory_),
        stream_(other.stream_),
        data_(std::exchange(other.data_, nullptr)),
        bytes_(other.bytes_) {}
  DeviceBlock& operator=(DeviceBlock&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(stream_, other.stream_);
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~DeviceBlock() {
    if (data_ != nullptr) memory_->deallocate(data_, bytes_, stream_);
  }

  [[nodiscard]] void* data() const noexcept { return data_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
  /// The caller gives it back from now on.
  void* release() noexcept { return std::exchange(data_, nullptr); }

 private:
  MemoryResource* memory_ = nullptr;
  Stream stream_ = nullptr;
  void* data_ = nullptr;
  std::size_t bytes_ = 0;
};

/// What a build takes and does, known beforehand.
struct Plan {
  std::size_t tree_bytes = 0;
  std::size_t workspace_bytes = 0;  ///< scratch included
  std::size_t scratch_bytes = 0;    ///< of it, first: what single passes need while they run
  std::uint32_t passes = 0;         ///< over all elements; a sort or a scan counts as one
};

/// The memory of one build. Without blocks it only counts: arrays get addresses that nothing may
/// look at, and the result is the plan.
class PlannedMemory {
 public:
  PlannedMemory() : counting_(true), tree_(nowhere()), workspace_(nowhere()) {}

  PlannedMemory(void* tree, void* workspace, const Plan& plan)
      : counting_(false),
        scratch_(workspace),
        scratch_bytes_(plan.scratch_bytes),
        tree_(tree),
        workspace_(static_cast<std::byte*>(workspace) + plan.scratch_bytes) {}

  [[nodiscard]] bool counting() const { return counting_; }

  template <class Layout, class... Counts>
  void take(Layout& layout, Counts... counts) {
    layout.lay_out(workspace_, counts...);
  }
  template <class Layout, class... Counts>
  void take_for_tree(Layout& layout, Counts... counts) {
    layout.lay_out(tree_, counts...);
  }

  /// Room for one pass, for as long as it runs; passes run one after another. `size()` says how
  /// much it needs.
  struct Scratch {
    void* data;
    std::size_t bytes;
  };
  template <class Size>
  Scratch scratch(const Size& size) {
    if (counting_) scratch_bytes_ = std::max(scratch_bytes_, rounded(size()));
    return {scratch_, scratch_bytes_};
  }

  [[nodiscard]] Plan plan(std::uint32_t passes) const {
    return {rounded(tree_.used()), scratch_bytes_ + rounded(workspace_.used()), scratch_bytes_,
            passes};
  }

 private:
  static std::size_t rounded(std::size_t bytes) {
    return (bytes + block_alignment - 1) / block_alignment * block_alignment;
  }
  /// Aligned and not null, so that members of what is not there have addresses too.
  static void* nowhere() { return reinterpret_cast<void*>(block_alignment); }

  bool counting_;
  void* scratch_ = nullptr;
  std::size_t scratch_bytes_ = 0;
  core::Arena tree_;
  core::Arena workspace_;
};

/// Memory for single stages, which may wait for the device: a block for whatever is asked.
class BlocksOnDemand {
 public:
  BlocksOnDemand(MemoryResource& memory, Stream stream) : memory_(&memory), stream_(stream) {}

  [[nodiscard]] static bool counting() { return false; }

  template <class Layout, class... Counts>
  void take(Layout& layout, Counts... counts) {
    blocks_.emplace_back(*memory_, stream_, core::bytes_of(layout, counts...));
    core::Arena arena(blocks_.back().data());
    layout.lay_out(arena, counts...);
  }
  template <class Layout, class... Counts>
  void take_for_tree(Layout& layout, Counts... counts) {
    take(layout, counts...);
  }

  using Scratch = PlannedMemory::Scratch;
  template <class Size>
  Scratch scratch(const Size& size) {
    const std::size_t bytes = size();
    if (scratch_.bytes() < bytes || scratch_.data() == nullptr)
      scratch_ = DeviceBlock(*memory_, stream_, std::max<std::size_t>(bytes, 1));
    return {scratch_.data(), scratch_.bytes()};
  }
  [[nodiscard]] std::size_t scratch_bytes() const { return scratch_.bytes(); }

 private:
  MemoryResource* memory_;
  Stream stream_;
  std::vector<DeviceBlock> blocks_;
  DeviceBlock scratch_;
};

/// Memory for a build that waits for the device to know what it needs: blocks that are given back
/// before it ends, in the order of the stream, and in the end one for the tree.
class MemoryAsYouGo : public BlocksOnDemand {
 public:
  MemoryAsYouGo(MemoryResource& memory, Stream stream)
      : BlocksOnDemand(memory, stream), memory_(&memory), stream_(stream) {}

  /// A block that is counted as long as it lives, which is no longer than this memory.
  class Held {
   public:
    Held() = default;
    Held(MemoryAsYouGo& memory, std::size_t bytes)
        : memory_(&memory), block_(*memory.memory_, memory.stream_, bytes) {
      memory.held_ += bytes;
      memory.most_held_ = std::max(memory.most_held_, memory.held_);
    }
    Held(Held&& other) noexcept
        : memory_(std::exchange(other.memory_, nullptr)), block_(std::move(other.block_)) {}
    Held& operator=(Held&& other) noexcept {
      std::swap(memory_, other.memory_);
      std::swap(block_, other.block_);
      return *this;
    }
    ~Held() {
      if (memory_ != nullptr) memory_->held_ -= block_.bytes();
    }
    [[nodiscard]] void* data() const noexcept { return block_.data(); }
    [[nodiscard]] std::size_t bytes() const noexcept { return block_.bytes(); }

   private:
    MemoryAsYouGo* memory_ = nullptr;
    DeviceBlock block_;
  };
  Held hold(std::size_t bytes) { return Held(*this, bytes); }

  template <class Layout, class... Counts>
  void take_for_tree(Layout& layout, Counts... counts) {
    tree_ = DeviceBlock(*memory_, stream_, core::bytes_of(layout, counts...));
    core::Arena arena(tree_.data());
    layout.lay_out(arena, counts...);
  }
  DeviceBlock& tree_block() { return tree_; }

  /// Of what hold() gave and what passes took while they ran.
  [[nodiscard]] std::size_t most_held() const { return most_held_ + scratch_bytes(); }

 private:
  MemoryResource* memory_;
  Stream stream_;
  DeviceBlock tree_;
  std::size_t held_ = 0;
  std::size_t most_held_ = 0;
};

}  // namespace zkd::cuda
