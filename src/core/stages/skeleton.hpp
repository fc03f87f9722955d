// SPDX-License-Identifier: Apache-2.0
//
// What stages 5 to 9 made, checked and put back into the form in which the pipeline has it when its
// last two stages begin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>
#include <zkd/tree.hpp>

#include "core/compress.hpp"
#include "core/frame.hpp"
#include "core/references.hpp"
#include "core/stages/frame.hpp"
#include "core/stages/input.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

using stages::Skeleton;

/// A link to what is not there.
struct IsDangling {
  const Link* links;
  std::uint32_t leaves;
  std::uint32_t nodes;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t i) const {
    return links[i].index() >= (links[i].is_leaf() ? leaves : nodes);
  }
};

/// A trunk that does not begin after the one before it, or begins behind the last triangle.
struct BeginsWrongly {
  const std::uint32_t* first;
  std::size_t triangles;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t t) const {
    const bool ascending = t == 0 ? first[0] == 0 : first[t - 1] < first[t];
    return !ascending || first[t] >= triangles;
  }
};

/// An offset below the one before it, or behind the last reference.
struct OffsetIsWrong {
  const std::uint32_t* offsets;
  std::size_t references;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t t) const {
    const bool ascending = t == 0 ? offsets[0] == 0 : offsets[t - 1] <= offsets[t];
    return !ascending || offsets[t] > references;
  }
};

/// Essential node j as a node: links, plane in tree space, and the way up for what is below it.
struct MakeNode {
  const Link* children;
  const std::uint32_t* axes;
  const float* planes;
  const SceneFrame* frame;
  Parent* parents_of_nodes;
  Parent* parents_of_leaves;
  Node* nodes;

  ZKD_HOST_DEVICE void operator()(std::uint32_t index) const {
    Node& node = nodes[index];
    node.axis = axes[index];
    node.plane = static_cast<float>(static_cast<double>(planes[index]) * frame->scale) + 0.0F;
    for (std::uint32_t side = 0; side < 2; ++side) {
      const Link child = children[2 * index + side];
      node.child[side] = child;
      Parent* parents = child.is_leaf() ? parents_of_leaves : parents_of_nodes;
      parents[child.index()] = {index * 2 + side};
    }
  }
};

/// What a walk needs of a node.
struct MakeSplitNode {
  const Node* nodes;
  SplitNode* split_nodes;

  ZKD_HOST_DEVICE void operator()(std::uint32_t index) const {
    const Node& node = nodes[index];
    split_nodes[index] = {node.plane, node.axis, {node.child[0], node.child[1]}};
  }
};

/// From the root there is no way up.
struct EndAt {
  Parent* root;
  ZKD_HOST_DEVICE void operator()(std::uint32_t) const { *root = Parent{}; }
};

struct MadeTree {
  Count leaves;
  Count inner;
  const SceneFrame* frame;
  Parent* parents_of_nodes;
  Parent* parents_of_leaves;
};

template <class Backend>
void check_skeleton(Backend& backend, std::span<const Box> boxes, const Skeleton& skeleton) {
  const Count leaves = exactly(skeleton.first.size());
  const Count inner = nodes_between(skeleton.first.size());
  check_length(skeleton.levels.size(), inner.bound, "levels");
  check_length(skeleton.children.size(), std::size_t{inner.bound} * 2, "children");
  check_length(skeleton.axes.size(), inner.bound, "axes");
  check_length(skeleton.planes.size(), inner.bound, "planes");
  if (!skeleton.root.is_none() && IsDangling{&skeleton.root, leaves.bound, inner.bound}(0))
    throw Error(ErrorCode::invalid_view, skeleton.root.index(), "root is out of range");
  const bool fragments = !skeleton.owners.empty();
  check_each(backend, exactly(skeleton.ids.size()), "ids",
             IsNotBelow{skeleton.ids.data(), fragments ? skeleton.owners.size() : boxes.size()});
  check_each(backend, exactly(skeleton.children.size()), "children",
             IsDangling{skeleton.children.data(), leaves.bound, inner.bound});
  check_each(backend, inner, "axes", IsNotBelow{skeleton.axes.data(), 3});
  check_each(backend, leaves, "first", BeginsWrongly{skeleton.first.data(), skeleton.ids.size()});
}

/// Writes `nodes`, but for their boxes.
template <class Backend>
MadeTree make_tree(Backend& backend, std::span<const Box> boxes, const Skeleton& skeleton,
                   Node* nodes) {
  check_skeleton(backend, boxes, skeleton);
  MadeTree made{};
  made.leaves = exactly(skeleton.first.size());
  made.inner = nodes_between(skeleton.first.size());
  made.frame = frame_of(backend, boxes);
  made.parents_of_nodes = backend.template take_array<Parent>(made.inner.bound);
  made.parents_of_leaves = backend.template take_array<Parent>(made.leaves.bound);
  if (!skeleton.root.is_none()) {
    Parent* parents = skeleton.root.is_leaf() ? made.parents_of_leaves : made.parents_of_nodes;
    backend.for_each(one, EndAt{parents + skeleton.root.index()});
  }
  backend.for_each(made.inner,
                   MakeNode{skeleton.children.data(), skeleton.axes.data(), skeleton.planes.data(),
                            made.frame, made.parents_of_nodes, made.parents_of_leaves, nodes});
  return made;
}

/// The same for the two stages of strict trees; `nodes` as above.
template <class Backend>
StrictTree strict_tree_of(Backend& backend, const MadeTree& made, const Node* nodes,
                          const BuildCounts* counts) {
  StrictTree tree{};
  auto* split_nodes = backend.template take_array<SplitNode>(made.inner.bound);
  backend.for_each(made.inner, MakeSplitNode{nodes, split_nodes});
  tree.leaves = {&counts->trunks, made.leaves.bound};
  tree.inner = {&counts->nodes, made.inner.bound};
  tree.nodes = split_nodes;
  tree.parents_of_nodes = made.parents_of_nodes;
  tree.parents_of_leaves = made.parents_of_leaves;
  return tree;
}

}  // namespace zkd::core
