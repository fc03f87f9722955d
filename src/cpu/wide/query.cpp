// SPDX-License-Identifier: Apache-2.0
//
// Queries through a wide tree: single rays, and spans of rays on all threads.
#include <algorithm>

#include <zkd/cpu/wide_tree.hpp>
#include <zkd/traversal/intersect.hpp>

#include "cpu/float_environment.hpp"
#include "cpu/rays.hpp"
#include "cpu/wide/avx2.hpp"
#include "cpu/wide/walk.hpp"

namespace zkd::cpu {
namespace {

/// What decides of the triangles that the filter left over: it is not asked twice.
template <class Intersect>
struct AfterFilter {
  using type = Intersect;
};
template <>
struct AfterFilter<core::Watertight> {
  using type = core::DoublePrecision;
};

template <bool any, class Boxes, class Lanes, class Intersect>
inline typename Intersect::Candidate trace(const WideTreeView& tree, const Ray& ray,
                                           TraversalCost* cost) {
  const core::PreparedRay prepared(TreeView{tree.header}, ray, Intersect::hit_distance);
  if (prepared.valid) {
    const typename AfterFilter<Intersect>::type intersect(prepared, ray);
    return walk<any, Boxes, Lanes>(tree, prepared, intersect, cost);
  }
  if (cost != nullptr) *cost = {};
  return {};
}

template <bool any, class Write>
void trace_all(const Executor& executor, const WideTreeView& tree, std::span<const Ray> rays,
               std::size_t count, std::span<TraversalCost> costs, Intersector intersector,
               Write write) noexcept {
  if (!costs.empty()) count = std::min(count, costs.size());
  const Threads threads(executor);
  with_intersector(intersector, [&]<class Intersect>() {
    for_each_ray(threads, count, rays_at_once, [=](std::size_t i) {
      write(i, trace<any, Avx2WideBoxes, Avx2Lanes, Intersect>(
                   tree, rays[i], costs.empty() ? nullptr : &costs[i]));
    });
  });
}

}  // namespace

void closest_hit(const Executor& executor, const WideTreeView& tree, std::span<const Ray> rays,
                 std::span<Hit> hits, std::span<TraversalCost> costs,
                 Intersector intersector) noexcept {
  trace_all<false>(executor, tree, rays, std::min(rays.size(), hits.size()), costs, intersector,
                   [hits](std::size_t i, const auto& found) { hits[i] = core::to_hit(found); });
}

void any_hit(const Executor& executor, const WideTreeView& tree, std::span<const Ray> rays,
             std::span<std::uint8_t> occluded, std::span<TraversalCost> costs,
             Intersector intersector) noexcept {
  trace_all<true>(
      executor, tree, rays, std::min(rays.size(), occluded.size()), costs, intersector,
      [occluded](std::size_t i, const auto& found) { occluded[i] = found.found() ? 1 : 0; });
}

}  // namespace zkd::cpu
