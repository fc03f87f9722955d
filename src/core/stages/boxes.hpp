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

/// An offset below the one before it, or behind the last reference.
struct OffsetIsWrong {
  const std::uint32_t* offsets;
  std::size_t references;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t t) const {
    const bool ascending = t == 0 ? offsets[0] == 0 : offsets[t - 1] <= offsets[t];
    return !ascending || offsets[t] > references;
  }
};

}  // namespace zkd::core

namespace zkd::stages {

template <class Executor>
void tight_boxes(const Executor& executor, std::span<const Box> boxes, const Skeleton& skeleton,
                 References policy, std::span<const std::uint32_t> leaf_offsets,
                 std::span<const std::uint32_t> references, std::span<Node> nodes) {
  core::check_references(policy);
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
                core::TightBoxes{boxes.data(), leaf_offsets.data(), references.data(),
                                 made.parents_of_nodes, made.parents_of_leaves, made.frame,
                                 policy == References::all, nodes.data()});
  backend.wait();
}

}  // namespace zkd::stages
