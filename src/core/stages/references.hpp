// SPDX-License-Identifier: Apache-2.0
//
// Stage 10 by itself: references.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/check_input.hpp"
#include "core/crowded_leaves.hpp"
#include "core/morton.hpp"
#include "core/references.hpp"
#include "core/split.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"
#include "core/stages/skeleton.hpp"
#include "core/status.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// to[i]: the box of reference i
struct GatherBoxes {
  ListedParts listed;
  const std::uint32_t* numbers;
  Box* to;
  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const { to[i] = listed.box(numbers[i]); }
};

}  // namespace zkd::core

namespace zkd::stages {

template <class Executor>
std::uint64_t list_references(const Executor& executor, const TriangleView& triangles,
                              std::span<const Box> boxes, const Skeleton& skeleton,
                              const Lattice& lattice, References policy,
                              std::span<std::uint32_t> leaf_offsets,
                              std::span<std::uint32_t> references, std::span<Box> inside) {
  core::check_references(policy);
  core::check_view(triangles);
  core::check_length(boxes.size(), triangles.triangle_count, "boxes");
  core::check_length(leaf_offsets.size(), skeleton.first.size() + 1, "leaf_offsets");
  const core::Count valid = core::exactly(skeleton.ids.size());
  const core::Count trunks = core::exactly(skeleton.first.size());
  using Backend = core::ExactBackendOf<Executor>;
  Backend backend(executor);
  backend.allocate_tree(trunks);
  const core::MadeTree made = core::make_tree(backend, boxes, skeleton, backend.nodes());

  core::BuildCounts known;
  known.listed = valid.bound;
  known.trunks = trunks.bound;
  known.nodes = made.inner.bound;
  auto* counts = backend.keep(known);

  const std::uint32_t* const owners = skeleton.owners.empty() ? nullptr : skeleton.owners.data();
  core::check_each(backend, core::exactly(skeleton.owners.size()), "owners",
                   core::IsNotBelow{owners, triangles.triangle_count});
  const std::uint32_t* offsets_found = skeleton.first.data();
  const std::uint32_t* listed = skeleton.ids.data();
  std::uint64_t needed = valid.bound;
  core::StrictTree strict{};
  if (policy == References::all) {
    strict = core::strict_tree_of(backend, made, backend.nodes(), counts);
    auto* trunk_of = backend.template take_array<std::uint32_t>(valid.bound);
    const core::CellWalk walk{triangles,
                              skeleton.ids.data(),
                              owners,
                              trunk_of,
                              boxes.data(),
                              strict.nodes,
                              skeleton.levels.data(),
                              made.parents_of_nodes,
                              made.parents_of_leaves,
                              backend.keep(core::MortonCoder(lattice)),
                              made.frame};
    core::ReferenceAll<Backend>{walk,
                                skeleton.first.data(),
                                core::Count{&counts->listed, valid.bound},
                                counts,
                                trunk_of,
                                backend.template take_array<std::uint32_t>(valid.bound)}
        .run(backend, triangles, strict);
    offsets_found = strict.offsets;
    needed = backend.read(&counts->references_needed);
  } else if (owners != nullptr) {
    auto* first = backend.template take_array<std::uint32_t>(std::size_t{trunks.bound} + 1);
    backend.for_each(trunks, core::CopyTo<std::uint32_t>{skeleton.first.data(), first});
    backend.for_each(core::one, core::CloseTrunks{counts, first});
    const core::TrunkOfFragments fragments{skeleton.ids.data(), first, owners,
                                           core::most_leaf_size};
    auto* offsets = backend.template take_array<std::uint32_t>(trunks.bound);
    backend.exclusive_scan(trunks, core::CountOwners{fragments}, offsets, &counts->references);
    needed = backend.read(&counts->references);
    auto* triangles_found = backend.template take_array<std::uint32_t>(needed);
    backend.for_each(trunks, core::ListOwners{fragments, offsets, triangles_found});
    offsets_found = offsets;
    listed = triangles_found;
  }
  const core::Count written = core::exactly(std::min<std::size_t>(references.size(), needed));
  backend.for_each(trunks, core::CopyTo<std::uint32_t>{offsets_found, leaf_offsets.data()});
  auto* const end = backend.keep(static_cast<std::uint32_t>(needed));
  backend.for_each(core::one, core::CloseOffsets{&counts->trunks, end, leaf_offsets.data()});
  if (policy == References::all) {
    backend.for_each(written, core::GatherIds{strict.listed, strict.numbers, references.data()});
    backend.for_each(core::exactly(std::min<std::size_t>(inside.size(), needed)),
                     core::GatherBoxes{strict.listed, strict.numbers, inside.data()});
  } else {
    backend.for_each(written, core::CopyTo<std::uint32_t>{listed, references.data()});
  }
  backend.wait();
  return needed;
}

template <class Executor>
SplitLeaves split_crowded_leaves(const Executor& executor, const TriangleView& triangles,
                                 std::span<const Box> boxes, std::span<const TrunkKey> trunk_keys,
                                 const Skeleton& skeleton,
                                 std::span<const std::uint32_t> leaf_offsets,
                                 std::span<const std::uint32_t> references,
                                 std::span<const Box> inside, std::uint32_t leaf_size,
                                 AxisOrder order, const StrictArrays& out) {
  core::check_leaf_size(leaf_size);
  core::check_view(triangles);
  core::check_length(boxes.size(), triangles.triangle_count, "boxes");
  core::check_length(trunk_keys.size(), skeleton.first.size(), "trunk_keys");
  core::check_length(leaf_offsets.size(), skeleton.first.size() + 1, "leaf_offsets");
  core::check_length(inside.size(), references.size(), "inside");
  using Backend = core::ExactBackendOf<Executor>;
  Backend backend(executor);
  core::check_each(backend, core::exactly(leaf_offsets.size()), "leaf_offsets",
                   core::OffsetIsWrong{leaf_offsets.data(), references.size()});
  core::check_each(backend, core::exactly(references.size()), "references",
                   core::IsNotBelow{references.data(), boxes.size()});
  const core::Count leaves = core::exactly(skeleton.first.size());
  const core::Count listed = core::exactly(references.size());
  backend.allocate_tree(leaves);
  const core::MadeTree made = core::make_tree(backend, boxes, skeleton, backend.nodes());

  core::BuildCounts known;
  known.trunks = leaves.bound;
  known.nodes = made.inner.bound;
  known.first_references = listed.bound;
  auto* counts = backend.keep(known);
  core::StrictTree tree = core::strict_tree_of(backend, made, backend.nodes(), counts);
  auto* leaf_of = backend.template take_array<std::uint32_t>(listed.bound);
  backend.for_each(leaves, core::LabelTrunk{leaf_offsets.data(), &counts->trunks,
                                            &counts->first_references, leaf_of});
  tree.references = {&counts->first_references, listed.bound};
  tree.offsets = leaf_offsets.data();
  tree.leaf_of = leaf_of;
  tree.numbers = backend.template take_array<std::uint32_t>(listed.bound);
  backend.for_each(listed, core::Number{tree.numbers});
  tree.listed = {references.data(), inside.data(), nullptr, nullptr};
  core::CellWalk walk{};
  walk.triangles = triangles;
  walk.boxes = boxes.data();
  walk.frame = made.frame;
  auto* root = backend.keep(skeleton.root);
  core::SplitCrowdedLeaves<Backend>{
      walk,
      trunk_keys.data(),
      leaf_size,
      order,
      counts,
      root,
      core::most_reference_trunks(references.size(), skeleton.first.size())}
      .run(backend, triangles, tree);

  const std::uint32_t leaf_count = backend.read(&counts->trunks);
  const std::uint32_t reference_count = backend.read(tree.references.actual);
  const auto fitting = [](std::size_t room, std::uint64_t count) {
    return core::exactly(std::min<std::size_t>(room, count));
  };
  backend.for_each(fitting(out.nodes.size(), core::nodes_between(leaf_count).bound),
                   core::FinishNode{tree.nodes, out.nodes.data()});
  backend.for_each(fitting(out.leaf_offsets.size(), std::uint64_t{leaf_count} + 1),
                   core::CopyTo<std::uint32_t>{tree.offsets, out.leaf_offsets.data()});
  backend.for_each(fitting(out.references.size(), reference_count),
                   core::GatherIds{tree.listed, tree.numbers, out.references.data()});
  backend.for_each(fitting(out.inside.size(), reference_count),
                   core::GatherBoxes{tree.listed, tree.numbers, out.inside.data()});
  const Link new_root = backend.read(root);
  return {new_root, leaf_count, reference_count};
}

}  // namespace zkd::stages
