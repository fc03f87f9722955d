// SPDX-License-Identifier: Apache-2.0
//
// Queries through a plane tree: single rays, and spans of rays on all threads.
#include <zkd/cpu/plane_tree.hpp>

#include "cpu/planes/walk.hpp"
#include "cpu/rays.hpp"

namespace zkd::cpu {
namespace {

template <bool any, class Intersect>
inline auto trace(const PlaneTreeView& tree, const TriangleView& triangles, const Ray& ray,
                  TraversalCost* cost) {
  const core::PreparedRay prepared(TreeView{tree.header}, ray, Intersect::hit_distance);
  if (prepared.valid) {
    const Intersect intersect(prepared, ray);
    return walk<any>(tree, triangles, prepared, intersect, cost);
  }
  if (cost != nullptr) *cost = {};
  return typename Intersect::Candidate{};
}

}  // namespace

std::optional<Hit> closest_hit(const PlaneTreeView& tree, const TriangleView& triangles,
                               const Ray& ray, Intersector intersector) noexcept {
  const Hit hit = trace_one(intersector, [&]<class Intersect, bool avx2>() {
    return core::to_hit(trace<false, Intersect>(tree, triangles, ray, nullptr));
  });
  if (hit.triangle == no_triangle) return std::nullopt;
  return hit;
}

bool any_hit(const PlaneTreeView& tree, const TriangleView& triangles, const Ray& ray,
             Intersector intersector) noexcept {
  return trace_one(intersector, [&]<class Intersect, bool avx2>() {
    return trace<true, Intersect>(tree, triangles, ray, nullptr).found();
  });
}

void closest_hit(const Executor& executor, const PlaneTreeView& tree, const TriangleView& triangles,
                 std::span<const Ray> rays, std::span<Hit> hits, std::span<TraversalCost> costs,
                 Intersector intersector) noexcept {
  trace_all(executor, rays_with_places(rays.size(), hits.size(), costs), intersector,
            [=]<class Intersect, bool avx2>(std::size_t i) {
              hits[i] = core::to_hit(
                  trace<false, Intersect>(tree, triangles, rays[i], cost_of(costs, i)));
            });
}

void any_hit(const Executor& executor, const PlaneTreeView& tree, const TriangleView& triangles,
             std::span<const Ray> rays, std::span<std::uint8_t> occluded,
             std::span<TraversalCost> costs, Intersector intersector) noexcept {
  trace_all(executor, rays_with_places(rays.size(), occluded.size(), costs), intersector,
            [=]<class Intersect, bool avx2>(std::size_t i) {
              const auto found =
                  trace<true, Intersect>(tree, triangles, rays[i], cost_of(costs, i));
              occluded[i] = found.found() ? 1 : 0;
            });
}

}  // namespace zkd::cpu
