// SPDX-License-Identifier: Apache-2.0
//
// The owner of a finished tree: moving, copying, giving back its memory.
#include <zkd/tree.hpp>

#include <cstring>
#include <utility>

#include "core/host_block.hpp"

namespace zkd {

void Tree::swap(Tree& other) noexcept {
  std::swap(view_, other.view_);
  std::swap(lattice_, other.lattice_);
  std::swap(options_, other.options_);
  std::swap(statistics_, other.statistics_);
  std::swap(node_block_, other.node_block_);
  std::swap(reference_block_, other.reference_block_);
  std::swap(memory_, other.memory_);
}

Tree::Tree(Tree&& other) noexcept : Tree() { swap(other); }

Tree& Tree::operator=(Tree&& other) noexcept {
  Tree(std::move(other)).swap(*this);
  return *this;
}

Tree::~Tree() {
  for (const Block& block : {node_block_, reference_block_})
    if (block.data != nullptr) memory_->deallocate(block.data, block.bytes, core::Arena::alignment);
}

Tree Tree::clone(std::pmr::memory_resource* memory) const {
  if (memory == nullptr) memory = std::pmr::get_default_resource();
  core::HostBlock nodes(memory, node_block_.bytes);
  core::HostBlock references(memory, reference_block_.bytes);
  Tree copy;
  copy.view_ = view_;
  copy.lattice_ = lattice_;
  copy.options_ = options_;
  copy.statistics_ = statistics_;
  copy.memory_ = memory;
  copy.node_block_ = {nodes.release(), node_block_.bytes};
  copy.reference_block_ = {references.release(), reference_block_.bytes};
  const auto moved = [](const Block& from, const Block& to, const auto* array) {
    if (array == nullptr) return array;
    const auto offset = reinterpret_cast<const char*>(array) - static_cast<const char*>(from.data);
    return reinterpret_cast<decltype(array)>(static_cast<const char*>(to.data) + offset);
  };
  if (node_block_.bytes != 0)
    std::memcpy(copy.node_block_.data, node_block_.data, node_block_.bytes);
  if (reference_block_.bytes != 0)
    std::memcpy(copy.reference_block_.data, reference_block_.data, reference_block_.bytes);
  copy.view_.header = moved(node_block_, copy.node_block_, view_.header);
  copy.view_.nodes = moved(node_block_, copy.node_block_, view_.nodes);
  copy.view_.leaf_offsets = moved(node_block_, copy.node_block_, view_.leaf_offsets);
  copy.view_.references = moved(reference_block_, copy.reference_block_, view_.references);
  return copy;
}

}  // namespace zkd
