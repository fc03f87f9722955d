// SPDX-License-Identifier: Apache-2.0
//
// Queries on the CPU: single rays, and spans of rays on all threads.
#include <zkd/query.hpp>

#include <type_traits>

#include <zkd/traversal/offset.hpp>
#include <zkd/traversal/traverse.hpp>

#include "cpu/box_test.hpp"
#include "cpu/float_environment.hpp"
#include "cpu/rays.hpp"

namespace zkd {
namespace {

using cpu::cost_of;
using cpu::rays_with_places;
using cpu::trace_all;
using cpu::trace_one;

template <bool avx2>
using BoxTestFor = std::conditional_t<avx2, cpu::Avx2BoxTest, core::BoxTest>;

}  // namespace

std::optional<Hit> closest_hit(const TreeView& tree, const TriangleView& triangles, const Ray& ray,
                               Intersector intersector) noexcept {
  const Hit hit = trace_one(intersector, [&]<class Intersect, bool avx2>() {
    return core::to_hit(
        core::trace<false, BoxTestFor<avx2>, Intersect>(tree, triangles, ray, nullptr));
  });
  if (hit.triangle == no_triangle) return std::nullopt;
  return hit;
}

bool any_hit(const TreeView& tree, const TriangleView& triangles, const Ray& ray,
             Intersector intersector) noexcept {
  return trace_one(intersector, [&]<class Intersect, bool avx2>() {
    return core::trace<true, BoxTestFor<avx2>, Intersect>(tree, triangles, ray, nullptr).found();
  });
}

void closest_hit(const cpu::Executor& executor, const TreeView& tree, const TriangleView& triangles,
                 std::span<const Ray> rays, std::span<Hit> hits, std::span<TraversalCost> costs,
                 Intersector intersector) noexcept {
  trace_all(executor, rays_with_places(rays.size(), hits.size(), costs), intersector,
            [=]<class Intersect, bool avx2>(std::size_t i) {
              hits[i] = core::to_hit(core::trace<false, BoxTestFor<avx2>, Intersect>(
                  tree, triangles, rays[i], cost_of(costs, i)));
            });
}

void any_hit(const cpu::Executor& executor, const TreeView& tree, const TriangleView& triangles,
             std::span<const Ray> rays, std::span<std::uint8_t> occluded,
             std::span<TraversalCost> costs, Intersector intersector) noexcept {
  trace_all(executor, rays_with_places(rays.size(), occluded.size(), costs), intersector,
            [=]<class Intersect, bool avx2>(std::size_t i) {
              const auto found = core::trace<true, BoxTestFor<avx2>, Intersect>(
                  tree, triangles, rays[i], cost_of(costs, i));
              occluded[i] = found.found() ? 1 : 0;
            });
}

glm::vec3 offset_origin(const TriangleView& triangles, const Hit& hit, const glm::vec3& direction,
                        Intersector intersector) noexcept {
  const cpu::FloatEnvironment environment;
  return cpu::with_intersector(intersector, [&]<class Intersect>() {
    return core::offset_origin(core::corners_of(triangles, hit.triangle), hit.u, hit.v, direction,
                               Intersect::plane_margin);
  });
}

}  // namespace zkd
