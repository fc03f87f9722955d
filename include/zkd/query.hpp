// SPDX-License-Identifier: Apache-2.0
//
// Rays through a finished tree.
//
// Rules, the same for every function here and on every backend:
//
// - A triangle is hit on both sides, edges and vertices included, and the hit is accepted when
//   t_min <= t <= t_max for the t that is returned.
// - The nearest hit wins; of equally near ones, the triangle with the lowest index. Nearness is
//   compared before t is rounded to the caller's units, which matters for far origins only.
// - A ray that lies in a triangle's plane, up to rounding, does not hit it.
// - A degenerate ray (see Ray) misses at once.
// - The intersector is watertight (Woop, Benthin, Wald: Watertight Ray/Triangle Intersection, JCGT
//   2013): single precision, with an error bound, rejects; double precision decides what is left
//   and gives t, u and v, rounded to float once. The signs of its edge functions are those of one
//   set of sheared corners, exactly, so triangles that share an edge never both miss a ray through
//   it.
// - The tree never changes an answer: closest_hit equals a loop over all triangles with the same
//   intersector, bit for bit.
// - Answers do not depend on the caller's compiler flags or floating-point mode (rounding,
//   flush-to-zero): the mode is set for the call and put back.
//
// `triangles` must be the view the tree was built from (or a copy of its data at other addresses).
// Nothing is allocated. The single-ray functions may be called from any number of threads.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <zkd/config.hpp>
#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/tree.hpp>

namespace zkd {

/// The nearest hit along `ray`, or nothing. O(depth) for most rays, O(tree) at worst.
[[nodiscard]] ZKD_API std::optional<Hit> closest_hit(const TreeView& tree,
                                                     const TriangleView& triangles,
                                                     const Ray& ray) noexcept;

/// Whether anything is hit; true exactly when closest_hit finds something. Stops at the first hit.
[[nodiscard]] ZKD_API bool any_hit(const TreeView& tree, const TriangleView& triangles,
                                   const Ray& ray) noexcept;

/// Work one ray caused. Counts may differ between backends and instruction sets, by rounding in
/// box tests; answers do not.
struct TraversalCost {
  std::uint32_t node_visits = 0;     ///< inner nodes whose two boxes were tested
  std::uint32_t triangle_tests = 0;  ///< a triangle counts once for each leaf it was tested in
};

/// closest_hit for each ray, on all threads of the executor: hits[i] belongs to rays[i]; a miss has
/// triangle == no_triangle, t == infinity, u == v == 0. Blocks until done.
///
/// `hits` (and `costs`, unless empty) should be as long as `rays`; a shorter one ends the work at
/// its length. Spans must not overlap.
ZKD_API void closest_hit(const cpu::Executor& executor, const TreeView& tree,
                         const TriangleView& triangles, std::span<const Ray> rays,
                         std::span<Hit> hits, std::span<TraversalCost> costs = {}) noexcept;

/// any_hit for each ray: occluded[i] is 1 if rays[i] hits anything, else 0. As above otherwise.
ZKD_API void any_hit(const cpu::Executor& executor, const TreeView& tree,
                     const TriangleView& triangles, std::span<const Ray> rays,
                     std::span<std::uint8_t> occluded,
                     std::span<TraversalCost> costs = {}) noexcept;

/// The same answers by a loop over all triangles: what the tree is checked against. Takes from
/// `tree` its bounds and scale only, so that both prepare the ray in the same way. O(n) a ray.
/// Triangles that a build would leave out (NaN, zero area) are never hit here either.
ZKD_API void closest_hit_brute_force(const cpu::Executor& executor, const TreeView& tree,
                                     const TriangleView& triangles, std::span<const Ray> rays,
                                     std::span<Hit> hits) noexcept;

}  // namespace zkd
