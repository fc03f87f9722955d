// SPDX-License-Identifier: Apache-2.0
//
// The owner of a tree in device memory: moving, and giving back its memory. What it says about the
// build is in build.cu.
#include <zkd/cuda/tree.hpp>

#include <utility>

namespace zkd::cuda {

MemoryResource::~MemoryResource() = default;

void Tree::swap(Tree& other) noexcept {
  std::swap(view_, other.view_);
  std::swap(triangles_, other.triangles_);
  std::swap(options_, other.options_);
  std::swap(block_, other.block_);
  std::swap(triangle_block_, other.triangle_block_);
  std::swap(record_, other.record_);
  std::swap(triangle_capacity_, other.triangle_capacity_);
  std::swap(workspace_bytes_, other.workspace_bytes_);
  std::swap(incomplete_, other.incomplete_);
  std::swap(memory_, other.memory_);
  std::swap(stream_, other.stream_);
  std::swap(device_, other.device_);
}

Tree::Tree(Tree&& other) noexcept : Tree() { swap(other); }

Tree& Tree::operator=(Tree&& other) noexcept {
  Tree(std::move(other)).swap(*this);
  return *this;
}

Tree::~Tree() {
  for (const Block& block : {block_, triangle_block_})
    if (block.data != nullptr) memory_->deallocate(block.data, block.bytes, stream_);
}

}  // namespace zkd::cuda
