// SPDX-License-Identifier: Apache-2.0
//
// From the records of all levels to one tree, numbered depth first: sizes of subtrees from the last
// level up, then places from the root down.
#pragma once

#include <cstdint>

#include <zkd/traversal/arithmetic.hpp>
#include <zkd/tree.hpp>

#include "core/arena.hpp"
#include "core/pipeline.hpp"
#include "core/search.hpp"
#include "core/wu2011/divide.hpp"

namespace zkd::core::wu2011 {

/// What lies below a node, and in its lower child alone.
struct SubtreeSize {
  std::uint32_t leaves;
  std::uint32_t references;
  std::uint32_t lower_leaves;  ///< 0: the node is a leaf
  std::uint32_t lower_references;
};

/// Where leaves and references of a subtree begin in the tree.
struct SubtreePlace {
  std::uint32_t leaf;
  std::uint32_t reference;
};

struct Subtrees {
  SubtreeSize* sizes;
  SubtreePlace* places;

  void lay_out(Arena& arena, std::size_t nodes) {
    sizes = arena.take<SubtreeSize>(nodes);
    places = arena.take<SubtreePlace>(nodes);
  }
};

/// A node, when those of the next level know their sizes.
struct MeasureSubtree {
  LevelRecord record;
  Subtrees own;
  Subtrees next;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    const Node& node = record.nodes[i];
    SubtreeSize size{1, record.leaf_begin[i + 1] - record.leaf_begin[i], 0, 0};
    if (node.axis != LevelRecord::not_divided) {
      size = {};
      for (int which = 0; which < 2; ++which) {
        const Link child = node.child[which];
        size.lower_leaves = size.leaves;
        size.lower_references = size.references;
        size.leaves += child.is_leaf() ? 1 : next.sizes[child.index()].leaves;
        size.references += child.is_leaf() ? child.index() : next.sizes[child.index()].references;
      }
    }
    own.sizes[i] = size;
  }
};

/// The link to a node in the tree.
ZKD_HOST_DEVICE inline Link link_to(const SubtreeSize& size, const SubtreePlace& place) {
  return size.lower_leaves == 0 ? Link::leaf(place.leaf)
                                : Link::node(place.leaf + size.lower_leaves - 1);
}

/// A node, when it knows its place: writes itself, the offsets of its leaves, and the places of its
/// children.
struct PlaceSubtree {
  LevelRecord record;
  Subtrees own;
  Subtrees next;
  Node* nodes;
  std::uint32_t* leaf_offsets;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    const SubtreeSize size = own.sizes[i];
    const SubtreePlace place = own.places[i];
    Node node = record.nodes[i];
    if (node.axis == LevelRecord::not_divided) {
      leaf_offsets[place.leaf] = place.reference;
      return;
    }
    const SubtreePlace child_place[2] = {
        place, {place.leaf + size.lower_leaves, place.reference + size.lower_references}};
    for (int which = 0; which < 2; ++which) {
      Link& child = node.child[which];
      if (child.is_leaf()) {
        child = Link::leaf(child_place[which].leaf);
        leaf_offsets[child_place[which].leaf] = child_place[which].reference;
      } else {
        next.places[child.index()] = child_place[which];
        child = link_to(next.sizes[child.index()], child_place[which]);
      }
    }
    nodes[link_to(size, place).index()] = node;
  }
};

/// Copies what the leaves of a level list.
struct PlaceLeafReference {
  LevelRecord record;
  Subtrees own;
  std::uint32_t* references;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    // The last that begins there: those before it have no leaves here.
    const std::uint32_t node = last_at_or_before(record.leaf_begin, record.node_count, i);
    const std::uint32_t index = i - record.leaf_begin[node];
    const SubtreeSize& size = own.sizes[node];
    const Link lower = record.nodes[node].child[0];
    std::uint32_t before = 0;  // references of the lower child that are not here
    if (size.lower_leaves != 0) {
      const std::uint32_t here = lower.is_leaf() ? lower.index() : 0;
      if (index >= here) before = size.lower_references - here;
    }
    references[own.places[node].reference + before + index] = record.leaf_references[i];
  }
};

/// The root of the tree, and its counts.
struct FinishTree {
  BuildState* state;
  TreeHeader* header;
  std::uint32_t* leaf_offsets;
  Subtrees top;  ///< of the first level; sizes null: the root is a leaf, or there is none
  std::uint32_t leaves;
  std::uint32_t references;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    if (top.sizes != nullptr)
      state->root = link_to(top.sizes[0], top.places[0]);
    else if (leaves > 0)
      state->root = Link::leaf(0);
    state->counts.trunks = leaves;
    state->counts.nodes = leaves > 0 ? leaves - 1 : 0;
    state->counts.references = references;
    state->counts.references_needed = references;
    if (leaves == 1) leaf_offsets[0] = 0;
    leaf_offsets[leaves] = references;
    WriteHeader{state, header}(0);
  }
};

}  // namespace zkd::core::wu2011
