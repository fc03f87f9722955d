// SPDX-License-Identifier: Apache-2.0
//
// The poster taken at its word: split planes alone, a triangle known to the one leaf its centre
// lies in, a hit accepted inside that leaf's interval only, the first leaf with a hit ends the
// walk. What straddles a plane can be missed. For comparison: the library does none of this.
#pragma once

#include <cstdint>
#include <span>

#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/query.hpp>
#include <zkd/traversal/intersect.hpp>
#include <zkd/tree.hpp>

namespace zkd::bench {

/// Puts the nearest hit on a leaf's triangles between `near` and `far` into `best`, where it is
/// better. Returns whether one was found.
bool intersect_within(const TreeView& tree, const TriangleView& triangles,
                      const core::Watertight& intersect, std::uint32_t leaf, core::Real near,
                      core::Real far, core::Watertight::Candidate& best);

/// zkd::closest_hit by Kaplan's walk over the planes of a tree of References::once, with the
/// library's watertight intersector.
void closest_hit_literally(const cpu::Executor& executor, const TreeView& tree,
                           const TriangleView& triangles, std::span<const Ray> rays,
                           std::span<Hit> hits, std::span<TraversalCost> costs = {});

/// SAH cost of the cells that the planes cut the scene's box into (costs 1 and 1), in the place of
/// TreeStatistics' tight boxes, which that walk does not look at.
[[nodiscard]] double sah_cost_of_cells(const TreeView& tree);

}  // namespace zkd::bench
