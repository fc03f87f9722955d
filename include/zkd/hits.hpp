// SPDX-License-Identifier: Apache-2.0
//
// All hits of a ray, from near to far, each exactly once: for transparency, thickness, inside and
// outside, constructive solid geometry.
//
//     float inside = 0.0F;
//     float entered = 0.0F;
//     bool in = false;
//     zkd::for_each_hit(tree.view(), triangles, ray, [&](const zkd::Hit& hit) {
//       if (in) inside += hit.t - entered;
//       entered = hit.t;
//       in = !in;
//     });
//
// Rules besides those of zkd/query.hpp (which triangles are hit, t_min and t_max, degenerate rays,
// the caller's flags and floating-point mode):
//
// - Every triangle that the ray hits is reported, once, in whatever many leaves it is listed.
// - From near to far: by nearness as closest_hit compares it, before t is rounded to a float, and
// of
//   equally near ones by index. So t never decreases, but may be the same float several times.
// - The first hit reported is closest_hit's, bit for bit; the next is what closest_hit would answer
//   if the triangles reported so far were not there. That is so for any tree of any builder:
//   the list equals that of a loop over all triangles with the same intersector
//   (closest_hits_brute_force), bit for bit.
// - A closed triangle has its edges and vertices: a ray through an edge that two triangles share
//   hits both, and both are reported, though the surface is crossed once. At the silhouette the ray
//   touches it and does not cross. Triangles that are given twice are reported twice. A program
//   that counts crossings has to tell these apart, by the ids or with rays that keep off edges.
//
// Nothing is allocated: a ray takes a fixed amount of stack, 10 KB (29 KB with `exact`). Hits that
// were found and may still have a nearer one before them are kept there, 256 at most. Where there
// are more at once, in effect only where hundreds of triangles are hit at nearly the same t, the
// furthest are found again by another walk. A walk that is stopped after the first hits has looked
// at little more than closest_hit; to the end it takes O(depth + leaves met + hits) for most rays,
// and O(tree * (1 + hits / 256)) at worst.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

#include <zkd/config.hpp>
#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/query.hpp>
#include <zkd/tree.hpp>

namespace zkd {

namespace detail {

/// A visitor as the compiled library sees it: whether to go on after this hit of rays[ray].
using CallHitVisitor = bool (*)(void* visitor, std::size_t ray, const Hit& hit);

ZKD_API void for_each_hit(const TreeView& tree, const TriangleView& triangles, const Ray& ray,
                          CallHitVisitor call, void* visitor, Intersector intersector);
ZKD_API void for_each_hit(const cpu::Executor& executor, const TreeView& tree,
                          const TriangleView& triangles, std::span<const Ray> rays,
                          CallHitVisitor call, void* visitor, Intersector intersector);

/// visitor(arguments...); one that returns nothing always goes on.
template <class Visitor, class... Arguments>
bool visit(Visitor& visitor, const Arguments&... arguments) {
  using Result = std::invoke_result_t<Visitor&, const Arguments&...>;
  static_assert(std::is_void_v<Result> || std::same_as<Result, bool>,
                "a visitor returns whether to go on, as a bool, or nothing");
  if constexpr (std::is_void_v<Result>) {
    visitor(arguments...);
    return true;
  } else {
    return visitor(arguments...);
  }
}

}  // namespace detail

/// visitor(hit) for every hit of the ray, from near to far. Where it returns a bool, false ends the
/// walk; it may also return nothing. It is called on this thread, in the floating-point mode of the
/// library (to nearest, denormals kept), and may trace rays itself. What it throws passes through.
/// Nothing else is thrown. May be called from any number of threads.
template <std::invocable<const Hit&> Visitor>
void for_each_hit(const TreeView& tree, const TriangleView& triangles, const Ray& ray,
                  Visitor&& visitor, Intersector intersector = Intersector::watertight) {
  const auto call = [](void* context, std::size_t, const Hit& hit) {
    return detail::visit(**static_cast<std::remove_reference_t<Visitor>**>(context), hit);
  };
  auto* address = &visitor;
  detail::for_each_hit(tree, triangles, ray, call, static_cast<void*>(&address), intersector);
}

/// visitor(i, hit) for every hit of every rays[i], on all threads of the executor. The hits of one
/// ray come from near to far, from one thread; those of different rays in no order, and at the same
/// time: the visitor has to bear that. False ends the walk of that ray only. When it throws, no
/// further ray is begun, and once all threads are done the exception is thrown here; of several,
/// one. Blocks until done. Otherwise as above.
template <std::invocable<std::size_t, const Hit&> Visitor>
void for_each_hit(const cpu::Executor& executor, const TreeView& tree,
                  const TriangleView& triangles, std::span<const Ray> rays, Visitor&& visitor,
                  Intersector intersector = Intersector::watertight) {
  const auto call = [](void* context, std::size_t ray, const Hit& hit) {
    return detail::visit(**static_cast<std::remove_reference_t<Visitor>**>(context), ray, hit);
  };
  auto* address = &visitor;
  detail::for_each_hit(executor, tree, triangles, rays, call, static_cast<void*>(&address),
                       intersector);
}

/// The first `hits_per_ray` hits of each ray, on all threads of the executor. Those of rays[i] are
/// hits[i * hits_per_ray + k], k < counts[i] <= hits_per_ray, from near to far; what is left of its
/// places is filled with misses. (Whether there are more than hits_per_ray is not said: ask for one
/// more.) With hits_per_ray = 1 these are closest_hit's answers. Blocks until done.
///
/// `hits` should be hits_per_ray times as long as `rays`, `counts` and `costs`, unless empty, as
/// long as `rays`; a shorter one ends the work at the last ray for which all have room. Spans must
/// not overlap. With hits_per_ray = 0 all counts are 0. Counts of a cost stay at 2^32 - 1 where
/// they would be larger.
ZKD_API void closest_hits(const cpu::Executor& executor, const TreeView& tree,
                          const TriangleView& triangles, std::span<const Ray> rays,
                          std::uint32_t hits_per_ray, std::span<Hit> hits,
                          std::span<std::uint32_t> counts = {}, std::span<TraversalCost> costs = {},
                          Intersector intersector = Intersector::watertight) noexcept;

/// The same answers by loops over all triangles: what the tree is checked against. Takes from
/// `tree` its bounds and scale only. O(n) for each hit. As above otherwise.
ZKD_API void closest_hits_brute_force(const cpu::Executor& executor, const TreeView& tree,
                                      const TriangleView& triangles, std::span<const Ray> rays,
                                      std::uint32_t hits_per_ray, std::span<Hit> hits,
                                      std::span<std::uint32_t> counts = {},
                                      Intersector intersector = Intersector::watertight) noexcept;

}  // namespace zkd
