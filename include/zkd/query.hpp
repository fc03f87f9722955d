// SPDX-License-Identifier: Apache-2.0
//
// Rays through a finished tree.
//
// Rules, the same for every function here and on every backend:
//
// - A triangle is hit on both sides, edges and vertices included, and the hit is accepted when
//   t_min <= t <= t_max for the t that is returned (a t below 0 that rounds to 0 is below 0).
// - The nearest hit wins; of equally near ones, the triangle with the lowest index. Nearness is
//   compared before t is rounded to a float of the caller's units.
// - A ray that lies in a triangle's plane, up to the rounding of the intersector, does not hit it.
// - A degenerate ray (see Ray) misses at once.
// - The tree never changes an answer: closest_hit equals a loop over all triangles with the same
//   intersector, bit for bit.
// - Answers do not depend on the caller's compiler flags or floating-point mode (rounding,
//   flush-to-zero): the mode is set for the call and put back.
//
// How near an answer is to the exact one is said at Intersector, and proven in docs/accuracy.md.
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

/// How a ray is tested against a triangle: a choice of the query, of which the tree knows nothing.
///
/// In what follows, R is the largest distance along an axis from the ray's origin to a corner of
/// the triangle (for an origin further than 8 C from the scene's box, C being its largest
/// coordinate: 32 C), and k = |d| |n| / |d . n| says how edge-on it is seen (d the direction, n the
/// normal; 1: from the front). "Within e" means: hit and miss are those of exact arithmetic for a
/// triangle whose corners are moved by e at most along each axis, the same corner in the same way
/// for all its edges. |t - exact t| |d| is bounded too, and how far along an axis the point that u
/// and v name may lie from the ray's at t; rounding to floats adds half a unit in the last place of
/// each of the three, and from a far origin t is off by 2^-51 of itself besides. For scenes whose
/// largest coordinate is less than 2^100 times the smallest that is not 0.
enum class Intersector : std::uint8_t {
  /// Woop, Benthin, Wald: Watertight Ray/Triangle Intersection, JCGT 2013. Single precision
  /// rejects, with an error bound; double precision decides what is left and gives t, u and v.
  /// Within 6 * 2^-53 R; t to (9 k + 25) * 2^-53 R; u and v to 34 * 2^-53 R. The signs of its edge
  /// functions are those of one set of sheared corners, exactly, so triangles that share an edge
  /// never both miss a ray through it.
  watertight,

  /// Moeller, Trumbore, JGT 1997, in single precision. Rays may slip between triangles that share
  /// an edge: the sign of an edge function is certain beyond 12 * 2^-24 times the terms that it is
  /// summed from and what `watertight` may be wrong by, which decides doubtful cases. The point
  /// found on the ray lies within 32 * 2^-24 R of the triangle, else double precision decides: t
  /// to 56 k * 2^-24 R, u and v to 32 * 2^-24 R.
  fast,

  /// Woop, Benthin, Wald in single precision, with Kahan's difference of products: for devices on
  /// which double precision is slow. Watertight. Within 9 * 2^-24 R; t to (13 k + 26) * 2^-24 R;
  /// u and v to 38 * 2^-24 R.
  single_precision,

  /// The answers of `watertight`, bit for bit, by double precision alone: what its filter
  /// is checked against.
  double_precision,

  /// No rounding: the triangle that is exactly hit first, of equally near ones the lowest index;
  /// t, u and v are the exact ones, rounded once. t_min and t_max are compared with the exact t.
  /// Long integers decide where double precision cannot. On the host only.
  exact,
};

/// "watertight", "fast", "single", "double", "exact": the names used on command lines and in JSON.
/// Static storage.
ZKD_API const char* to_string(Intersector value) noexcept;

/// The nearest hit along `ray`, or nothing. O(depth) for most rays, O(tree) at worst.
[[nodiscard]] ZKD_API std::optional<Hit> closest_hit(
    const TreeView& tree, const TriangleView& triangles, const Ray& ray,
    Intersector intersector = Intersector::watertight) noexcept;

/// Whether anything is hit; true exactly when closest_hit finds something. Stops at the first hit.
[[nodiscard]] ZKD_API bool any_hit(const TreeView& tree, const TriangleView& triangles,
                                   const Ray& ray,
                                   Intersector intersector = Intersector::watertight) noexcept;

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
                         std::span<Hit> hits, std::span<TraversalCost> costs = {},
                         Intersector intersector = Intersector::watertight) noexcept;

/// any_hit for each ray: occluded[i] is 1 if rays[i] hits anything, else 0. As above otherwise.
ZKD_API void any_hit(const cpu::Executor& executor, const TreeView& tree,
                     const TriangleView& triangles, std::span<const Ray> rays,
                     std::span<std::uint8_t> occluded, std::span<TraversalCost> costs = {},
                     Intersector intersector = Intersector::watertight) noexcept;

/// The same answers by a loop over all triangles: what the tree is checked against. Takes from
/// `tree` its bounds and scale only, so that both prepare the ray in the same way. O(n) a ray.
/// Triangles that a build would leave out (NaN, zero area) are never hit here either.
ZKD_API void closest_hit_brute_force(const cpu::Executor& executor, const TreeView& tree,
                                     const TriangleView& triangles, std::span<const Ray> rays,
                                     std::span<Hit> hits,
                                     Intersector intersector = Intersector::watertight) noexcept;

/// Where a ray begins that leaves the surface at `hit` in `direction`: the point of the hit, moved
/// off the plane of its triangle to the side that the direction goes to. A ray from there with that
/// direction and t_min = 0 never hits the same triangle again (by the intersector given, which
/// should be the one it will be traced with).
///
/// No coordinate moves by more than 2^-46 of the largest coordinate of the triangle (2^-16 for
/// `fast` and `single_precision`), and on to the next float. That is proven to be enough
/// ("Spawned rays" in docs/accuracy.md), but for `single_precision` and a triangle whose largest
/// coordinate is less than 2^-100 of the scene's. Near an edge the point may lie behind another
/// triangle that meets this one there, as with every offset.
///
/// `hit` is one of `triangles`, not a miss. A coordinate stays at most the largest float: there the
/// point may lie in the plane. O(1); allocates nothing.
[[nodiscard]] ZKD_API glm::vec3 offset_origin(
    const TriangleView& triangles, const Hit& hit, const glm::vec3& direction,
    Intersector intersector = Intersector::watertight) noexcept;

}  // namespace zkd
