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
#include "core/morton.hpp"
#include "core/references.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"
#include "core/stages/skeleton.hpp"
#include "core/status.hpp"
#include "core/verbs.hpp"

namespace zkd::stages {

template <class Executor>
std::uint64_t list_references(const Executor& executor, const TriangleView& triangles,
                              std::span<const Box> boxes, const Skeleton& skeleton,
                              const Lattice& lattice, References policy,
                              std::span<std::uint32_t> leaf_offsets,
                              std::span<std::uint32_t> references) {
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
  known.references = valid.bound;  // of `once`; `all` counts them
  known.references_needed = valid.bound;
  auto* counts = backend.keep(known);

  const std::uint32_t* offsets_found = skeleton.first.data();
  const std::uint32_t* references_found = skeleton.ids.data();
  if (policy == References::all) {
    auto* split_nodes = backend.template take_array<core::SplitNode>(trunks.bound);
    auto* trunk_of = backend.template take_array<std::uint32_t>(valid.bound);
    const core::CellWalk walk{triangles,
                              skeleton.ids.data(),
                              trunk_of,
                              boxes.data(),
                              split_nodes,
                              skeleton.levels.data(),
                              made.parents_of_nodes,
                              made.parents_of_leaves,
                              backend.keep(core::MortonCoder(lattice)),
                              made.frame};
    core::ReferenceAll<Backend>{walk,
                                skeleton.first.data(),
                                core::Count{&counts->listed, valid.bound},
                                core::Count{&counts->trunks, trunks.bound},
                                core::Count{&counts->nodes, made.inner.bound},
                                counts,
                                backend.nodes(),
                                split_nodes,
                                trunk_of,
                                backend.template take_array<std::uint32_t>(valid.bound)}
        .run(backend, triangles);
    offsets_found = backend.leaf_offsets();
    references_found = backend.references();
  }
  const std::uint64_t needed = backend.read(&counts->references_needed);
  const std::size_t fit = std::min<std::size_t>(references.size(), needed);
  backend.for_each(trunks, core::CopyTo<std::uint32_t>{offsets_found, leaf_offsets.data()});
  backend.for_each(core::one, core::CloseOffsets{counts, leaf_offsets.data()});
  backend.for_each(core::exactly(fit),
                   core::CopyTo<std::uint32_t>{references_found, references.data()});
  backend.wait();
  return needed;
}

}  // namespace zkd::stages
