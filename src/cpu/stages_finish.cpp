// SPDX-License-Identifier: Apache-2.0
//
// The last two stages by themselves, references and tight boxes: they need the tree that the others
// made.
#include <zkd/stages.hpp>

#include <algorithm>

#include "core/boxes.hpp"
#include "core/check_input.hpp"
#include "core/frame.hpp"
#include "core/morton.hpp"
#include "core/references.hpp"
#include "cpu/backend.hpp"
#include "cpu/stage_input.hpp"

namespace zkd::stages {
namespace {

using core::CopyTo;

/// Essential node j as a node: links, plane in tree space, and the way up for what is below it.
struct MakeNode {
  const Link* children;
  const std::uint32_t* axes;
  const float* planes;
  const core::SceneFrame* frame;
  core::Parent* parents_of_nodes;
  core::Parent* parents_of_leaves;
  Node* nodes;

  void operator()(std::uint32_t index) const {
    Node& node = nodes[index];
    node.axis = axes[index];
    node.plane = static_cast<float>(static_cast<double>(planes[index]) * frame->scale) + 0.0F;
    for (std::uint32_t side = 0; side < 2; ++side) {
      const Link child = children[2 * index + side];
      node.child[side] = child;
      core::Parent* parents = child.is_leaf() ? parents_of_leaves : parents_of_nodes;
      parents[child.index()] = {index * 2 + side};
    }
  }
};

/// A skeleton as the pipeline has it at this point.
class MadeTree {
 public:
  MadeTree(cpu::Backend& backend, std::span<const Box> boxes, const Skeleton& skeleton, Node* nodes)
      : leaves(exactly(skeleton.first.size())),
        inner(exactly(std::max<std::size_t>(skeleton.first.size(), 1) - 1)) {
    check(backend, boxes, skeleton);
    struct Room {
      core::Parent* parents_of_nodes;
      core::Parent* parents_of_leaves;
      void lay_out(core::Arena& arena, std::size_t count) {
        parents_of_nodes = arena.take<core::Parent>(count);
        parents_of_leaves = arena.take<core::Parent>(count);
      }
    } room{};
    backend.take(room, leaves.bound);
    parents_of_nodes = room.parents_of_nodes;
    parents_of_leaves = room.parents_of_leaves;
    core::ValidationReport scene;
    backend.reduce(exactly(boxes.size()), &scene, core::IncludeBox{boxes.data()});
    frame = core::SceneFrame(scene.bounds);
    if (!skeleton.root.is_none()) {
      core::Parent* parents = skeleton.root.is_leaf() ? parents_of_leaves : parents_of_nodes;
      parents[skeleton.root.index()] = core::Parent{};
    }
    backend.for_each(
        inner, MakeNode{skeleton.children.data(), skeleton.axes.data(), skeleton.planes.data(),
                        &frame, parents_of_nodes, parents_of_leaves, nodes});
  }

  Count leaves;
  Count inner;
  core::SceneFrame frame;
  core::Parent* parents_of_nodes = nullptr;
  core::Parent* parents_of_leaves = nullptr;

 private:
  void check(cpu::Backend& backend, std::span<const Box> boxes, const Skeleton& skeleton) const {
    check_length(skeleton.levels.size(), inner.bound, "levels");
    check_length(skeleton.children.size(), std::size_t{inner.bound} * 2, "children");
    check_length(skeleton.axes.size(), inner.bound, "axes");
    check_length(skeleton.planes.size(), inner.bound, "planes");
    check_each(backend, exactly(skeleton.ids.size()), "ids",
               [=](std::uint32_t i) { return skeleton.ids[i] >= boxes.size(); });
    check_each(backend, exactly(skeleton.children.size()), "children", [=, this](std::uint32_t i) {
      const Link child = skeleton.children[i];
      return child.index() >= (child.is_leaf() ? leaves.bound : inner.bound);
    });
    check_each(backend, inner, "axes", [=](std::uint32_t i) { return skeleton.axes[i] > 2; });
    check_each(backend, leaves, "first", [=](std::uint32_t t) {
      const bool ascending =
          t == 0 ? skeleton.first[0] == 0 : skeleton.first[t - 1] < skeleton.first[t];
      return !ascending || skeleton.first[t] >= skeleton.ids.size();
    });
  }
};

void check_references(References references) {
  BuildOptions options;
  options.references = references;
  core::check_options(options);
}

}  // namespace

std::uint64_t list_references(const cpu::Executor& executor, const TriangleView& triangles,
                              std::span<const Box> boxes, const Skeleton& skeleton,
                              const Lattice& lattice, References policy,
                              std::span<std::uint32_t> leaf_offsets,
                              std::span<std::uint32_t> references) {
  check_references(policy);
  core::check_view(triangles);
  check_length(boxes.size(), triangles.triangle_count, "boxes");
  check_length(leaf_offsets.size(), skeleton.first.size() + 1, "leaf_offsets");
  cpu::Backend backend(executor);
  const Count valid = exactly(skeleton.ids.size());
  const Count trunks = exactly(skeleton.first.size());
  backend.allocate_tree(trunks);
  const MadeTree made(backend, boxes, skeleton, backend.nodes());

  std::uint64_t needed = valid.bound;
  if (policy == References::once) {
    const Count fit = exactly(std::min(references.size(), skeleton.ids.size()));
    backend.for_each(trunks, CopyTo<std::uint32_t>{skeleton.first.data(), leaf_offsets.data()});
    backend.for_each(fit, CopyTo<std::uint32_t>{skeleton.ids.data(), references.data()});
  } else {
    struct Room {
      core::SplitNode* split_nodes;
      std::uint32_t* trunk_of;
      std::uint32_t* offsets;
      void lay_out(core::Arena& arena, std::size_t trunk_count, std::size_t count) {
        split_nodes = arena.take<core::SplitNode>(trunk_count);
        trunk_of = arena.take<std::uint32_t>(count);
        offsets = arena.take<std::uint32_t>(count);
      }
    } room{};
    backend.take(room, trunks.bound, valid.bound);
    const core::MortonCoder coder(lattice);
    const core::CellWalk walk{triangles,
                              skeleton.ids.data(),
                              room.trunk_of,
                              boxes.data(),
                              room.split_nodes,
                              skeleton.levels.data(),
                              made.parents_of_nodes,
                              made.parents_of_leaves,
                              &coder,
                              &made.frame};
    core::BuildCounts counts;
    counts.listed = valid.bound;
    counts.trunks = trunks.bound;
    counts.nodes = made.inner.bound;
    core::ReferenceAll<cpu::Backend>{walk,
                                     skeleton.first.data(),
                                     Count{&counts.listed, valid.bound},
                                     Count{&counts.trunks, trunks.bound},
                                     Count{&counts.nodes, made.inner.bound},
                                     &counts,
                                     backend.nodes(),
                                     room.split_nodes,
                                     room.trunk_of,
                                     room.offsets}
        .run(backend, triangles);
    needed = counts.references_needed;
    const Count fit = exactly(std::min<std::size_t>(references.size(), counts.references));
    backend.for_each(trunks, CopyTo<std::uint32_t>{backend.leaf_offsets(), leaf_offsets.data()});
    backend.for_each(fit, CopyTo<std::uint32_t>{backend.references(), references.data()});
  }
  leaf_offsets.back() = static_cast<std::uint32_t>(needed);
  return needed;
}

void tight_boxes(const cpu::Executor& executor, std::span<const Box> boxes,
                 const Skeleton& skeleton, References policy,
                 std::span<const std::uint32_t> leaf_offsets,
                 std::span<const std::uint32_t> references, std::span<Node> nodes) {
  check_references(policy);
  check_length(leaf_offsets.size(), skeleton.first.size() + 1, "leaf_offsets");
  check_length(nodes.size(), skeleton.levels.size(), "nodes");
  cpu::Backend backend(executor);
  check_each(backend, exactly(leaf_offsets.size()), "leaf_offsets", [=](std::uint32_t t) {
    const bool ascending = t == 0 ? leaf_offsets[0] == 0 : leaf_offsets[t - 1] <= leaf_offsets[t];
    return !ascending || leaf_offsets[t] > references.size();
  });
  check_each(backend, exactly(references.size()), "references",
             [=](std::uint32_t r) { return references[r] >= boxes.size(); });
  const MadeTree made(backend, boxes, skeleton, nodes.data());
  struct Room {
    std::uint32_t* arrivals;
    void lay_out(core::Arena& arena, std::size_t count) {
      arrivals = arena.take<std::uint32_t>(count);
    }
  } room{};
  backend.take(room, made.inner.bound);
  backend.for_each(made.inner, core::Fill{room.arrivals, 0});
  backend.climb(made.leaves, room.arrivals,
                core::TightBoxes{boxes.data(), leaf_offsets.data(), references.data(),
                                 made.parents_of_nodes, made.parents_of_leaves, &made.frame,
                                 policy == References::all, nodes.data()});
}

}  // namespace zkd::stages
