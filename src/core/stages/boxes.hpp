// SPDX-License-Identifier: Apache-2.0
//
// Stage 11 by itself: tight boxes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/boxes.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"
#include "core/stages/skeleton.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// The way up from the children of a finished node.
struct FindParents {
  const Node* nodes;
  Parent* parents_of_nodes;
  Parent* parents_of_leaves;

  ZKD_HOST_DEVICE void operator()(std::uint32_t index) const {
    for (std::uint32_t side = 0; side < 2; ++side) {
      const Link child = nodes[index].child[side];
      Parent* parents = child.is_leaf() ? parents_of_leaves : parents_of_nodes;
      parents[child.index()] = {index * 2 + side};
    }
  }
};

/// A node with a link to what is not there.
struct NodeIsDangling {
  const Node* nodes;
  std::uint32_t leaves;
  std::uint32_t inner;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t i) const {
    return IsDangling{nodes[i].child, leaves, inner}(0) ||
           IsDangling{nodes[i].child, leaves, inner}(1);
  }
};

}  // namespace zkd::core

namespace zkd::stages {

template <class Executor>
void tight_boxes(const Executor& executor, std::span<const Box> boxes, const Skeleton& skeleton,
                 std::span<const std::uint32_t> leaf_offsets,
                 std::span<const std::uint32_t> references, std::span<Node> nodes) {
  core::check_length(leaf_offsets.size(), skeleton.first.size() + 1, "leaf_offsets");
  core::check_length(nodes.size(), skeleton.levels.size(), "nodes");
  core::ExactBackendOf<Executor> backend(executor);
  core::check_each(backend, core::exactly(leaf_offsets.size()), "leaf_offsets",
                   core::OffsetIsWrong{leaf_offsets.data(), references.size()});
  core::check_each(backend, core::exactly(references.size()), "references",
                   core::IsNotBelow{references.data(), boxes.size()});
  const core::MadeTree made = core::make_tree(backend, boxes, skeleton, nodes.data());
  auto* arrivals = backend.template take_array<std::uint32_t>(made.inner.bound);
  backend.for_each(made.inner, core::Fill{arrivals, 0});
  backend.climb(made.leaves, arrivals,
                core::TightBoxes{boxes.data(),
                                 leaf_offsets.data(),
                                 references.data(),
                                 made.parents_of_nodes,
                                 made.parents_of_leaves,
                                 made.frame,
                                 {},
                                 nullptr,
                                 nodes.data()});
  backend.wait();
}

template <class Executor>
void tight_boxes(const Executor& executor, Link root, std::span<const std::uint32_t> leaf_offsets,
                 std::span<const Box> inside, std::span<Node> nodes) {
  const core::Count leaves = core::exactly(leaf_offsets.empty() ? 0 : leaf_offsets.size() - 1);
  const core::Count inner = core::nodes_between(leaves.bound);
  core::check_length(nodes.size(), inner.bound, "nodes");
  core::ExactBackendOf<Executor> backend(executor);
  core::check_each(backend, core::exactly(leaf_offsets.size()), "leaf_offsets",
                   core::OffsetIsWrong{leaf_offsets.data(), inside.size()});
  core::check_each(backend, inner, "nodes",
                   core::NodeIsDangling{nodes.data(), leaves.bound, inner.bound});
  if (!root.is_none() && core::IsDangling{&root, leaves.bound, inner.bound}(0))
    throw Error(ErrorCode::invalid_view, root.index(), "root is out of range");
  auto* parents_of_nodes = backend.template take_array<core::Parent>(inner.bound);
  auto* parents_of_leaves = backend.template take_array<core::Parent>(leaves.bound);
  auto* arrivals = backend.template take_array<std::uint32_t>(inner.bound);
  if (!root.is_none())
    backend.for_each(
        core::one,
        core::EndAt{(root.is_leaf() ? parents_of_leaves : parents_of_nodes) + root.index()});
  backend.for_each(inner, core::FindParents{nodes.data(), parents_of_nodes, parents_of_leaves});
  backend.for_each(inner, core::Fill{arrivals, 0});
  backend.climb(leaves, arrivals,
                core::TightBoxes{nullptr,
                                 leaf_offsets.data(),
                                 nullptr,
                                 parents_of_nodes,
                                 parents_of_leaves,
                                 nullptr,
                                 {nullptr, inside.data(), nullptr, nullptr},
                                 nullptr,
                                 nodes.data()});
  backend.wait();
}

}  // namespace zkd::stages
