// SPDX-License-Identifier: Apache-2.0
//
// XXH3-128 over the named fields of a tree.
#include "verify/tree_hash.hpp"

#include <xxhash.h>
#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <new>
#include <stdexcept>
#include <vector>

namespace zkd::verify {
namespace {

// Collects 32-bit words, little-endian on every machine, and hashes them block by block.
class Hasher {
 public:
  Hasher() : state_(XXH3_createState()) {
    if (state_ == nullptr || XXH3_128bits_reset(state_.get()) != XXH_OK) throw std::bad_alloc();
  }

  void add(std::uint32_t word) {
    for (unsigned shift = 0; shift < 32; shift += 8) {
      block_[used_++] = static_cast<unsigned char>(word >> shift & 0xFFU);
    }
    if (used_ == block_.size()) flush();
  }
  void add(float value) { add(std::bit_cast<std::uint32_t>(value)); }

  std::string digits() {
    flush();
    const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
    std::string text;
    for (const XXH64_hash_t half : {hash.high64, hash.low64}) {
      for (int shift = 60; shift >= 0; shift -= 4) {
        text += "0123456789abcdef"[half >> shift & 0xFU];
      }
    }
    return text;
  }

 private:
  void flush() {
    if (XXH3_128bits_update(state_.get(), block_.data(), used_) != XXH_OK) {
      throw std::runtime_error("tree_hash: xxHash refused its input");
    }
    used_ = 0;
  }

  struct Free {
    void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
  };
  std::unique_ptr<XXH3_state_t, Free> state_;
  std::array<unsigned char, 1U << 14U> block_{};
  std::size_t used_ = 0;
};

// Everything but the references.
void add_structure(Hasher& hasher, const TreeView& tree) {
  hasher.add(tree.leaf_count());
  hasher.add(tree.reference_count());
  hasher.add(tree.root().bits);
  const Box bounds = tree.bounds();
  for (const float x : bounds.lo) hasher.add(x);
  for (const float x : bounds.hi) hasher.add(x);
  hasher.add(tree.scale());
  for (std::uint32_t i = 0; i < tree.node_count(); ++i) {
    const Node& node = tree.nodes[i];
    for (const auto& axis : node.bounds) {
      for (const float x : axis) hasher.add(x);
    }
    for (const Link link : node.child) hasher.add(link.bits);
    hasher.add(node.plane);
    hasher.add(node.axis);
  }
  if (tree.leaf_count() > 0) {
    for (std::uint32_t i = 0; i <= tree.leaf_count(); ++i) hasher.add(tree.leaf_offsets[i]);
  }
}

}  // namespace

std::string tree_hash(const TreeView& tree) {
  Hasher hasher;
  add_structure(hasher, tree);
  for (std::uint32_t i = 0; i < tree.reference_count(); ++i) hasher.add(tree.references[i]);
  return hasher.digits();
}

std::string tree_hash_mapped(const TreeView& tree, std::span<const std::uint32_t> new_id_of_old) {
  Hasher hasher;
  add_structure(hasher, tree);
  std::vector<std::uint32_t> ids;
  for (std::uint32_t leaf = 0; leaf < tree.leaf_count(); ++leaf) {
    ids.assign(tree.references + tree.leaf_offsets[leaf],
               tree.references + tree.leaf_offsets[leaf + 1]);
    for (std::uint32_t& id : ids) {
      if (new_id_of_old.empty()) continue;
      if (id >= new_id_of_old.size()) {
        throw std::out_of_range("tree_hash_mapped: leaf " + std::to_string(leaf) +
                                " lists triangle " + std::to_string(id) + ", but the map has " +
                                std::to_string(new_id_of_old.size()));
      }
      id = new_id_of_old[id];
    }
    std::sort(ids.begin(), ids.end());
    for (const std::uint32_t id : ids) hasher.add(id);
  }
  return hasher.digits();
}

}  // namespace zkd::verify
