// SPDX-License-Identifier: Apache-2.0
//
// Stage 8, path compression: every essential node and trunk is linked directly to the essential
// node above it; the redundant nodes between are never made.
#pragma once

#include <cstdint>

#include <zkd/tree.hpp>

#include "core/key.hpp"
#include "core/search.hpp"

namespace zkd::core {

/// The way up from a node or leaf: which node, and as which of its children.
struct Parent {
  std::uint32_t bits = 0xFFFFFFFFu;  ///< node * 2 + side; all ones: none

  [[nodiscard]] ZKD_HOST_DEVICE bool is_none() const { return bits == 0xFFFFFFFFu; }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t node() const { return bits >> 1; }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t side() const { return bits & 1u; }
};

/// Where links go: the children of node j to links[stride * j] and the next, ways up to two arrays.
struct LinkWriter {
  Link* links;
  std::size_t stride;         ///< in links: 2, or what a node has
  Parent* parents_of_nodes;   ///< may be null
  Parent* parents_of_leaves;  ///< may be null
  Link* root;
  const std::uint32_t* trunk_count;
  std::uint32_t trunks = 0;

  ZKD_HOST_DEVICE void load() { trunks = *trunk_count; }

  /// Links `child`, which covers trunks left..right, to the node above it: the essential node where
  /// it parts from the trunk before it, or that where it parts from the trunk after it, whichever
  /// has the longer prefix and so lies lower.
  ZKD_HOST_DEVICE void link(Link child, std::uint32_t left, std::uint32_t right,
                            const std::uint8_t* levels) const {
    const bool has_left = left > 0;
    const bool has_right = right + 1 < trunks;
    Parent parent;
    if (!has_left && !has_right) {
      *root = child;
    } else {
      const bool after = has_left && (!has_right || levels[left - 1] > levels[right]);
      const std::uint32_t node = after ? left - 1 : right;
      const std::uint32_t side = after ? 1 : 0;
      parent = {node * 2 + side};
      links[stride * node + side] = child;
    }
    Parent* parents = child.is_leaf() ? parents_of_leaves : parents_of_nodes;
    if (parents != nullptr) parents[child.index()] = parent;
  }
};

/// Trunk t: a leaf.
struct LinkTrunk {
  const std::uint8_t* levels;
  LinkWriter writer;

  ZKD_HOST_DEVICE void load() { writer.load(); }

  ZKD_HOST_DEVICE void operator()(std::uint32_t trunk) const {
    writer.link(Link::leaf(trunk), trunk, trunk, levels);
  }
};

/// Essential node j: which trunks it covers, hence which node is above it.
struct LinkEssentialNode {
  const TrunkKey* trunk_keys;
  const std::uint8_t* levels;
  LinkWriter writer;

  ZKD_HOST_DEVICE void load() { writer.load(); }

  /// Neighbours to look at before searching the keys; a power of two, for run_length.
  static constexpr std::uint32_t near_by = 16;

  /// The trunks below a node are those with its prefix: neighbours, since keys are sorted.
  ZKD_HOST_DEVICE void operator()(std::uint32_t node) const {
    const std::uint32_t level = levels[node];
    const std::uint32_t before = node;                      // trunks before the two that part here
    const std::uint32_t behind = writer.trunks - node - 2;  // and after them
    // Most nodes have few trunks below: a look at the neighbours' levels settles those.
    std::uint32_t left = 0;
    while (left < before && left < near_by && levels[node - left - 1] > level) ++left;
    std::uint32_t right = 0;
    while (right < behind && right < near_by && levels[node + right + 1] > level) ++right;
    if (left == near_by) {
      const TrunkKey lowest = lowest_below(trunk_keys[node], level);
      left += run_length(before - left, near_by,
                         [&](std::uint32_t n) { return !(trunk_keys[node - left - n] < lowest); });
    }
    if (right == near_by) {
      const TrunkKey highest = highest_below(trunk_keys[node], level);
      right += run_length(behind - right, near_by, [&](std::uint32_t n) {
        return !(highest < trunk_keys[node + 1 + right + n]);
      });
    }
    writer.link(Link::node(node), node - left, node + 1 + right, levels);
  }
};

}  // namespace zkd::core
