// SPDX-License-Identifier: Apache-2.0
//
// Queries on the CPU: single rays, and spans of rays on all threads.
#include <zkd/query.hpp>

#include <algorithm>

#include <zkd/traversal/offset.hpp>
#include <zkd/traversal/traverse.hpp>

#include "cpu/box_test.hpp"
#include "cpu/float_environment.hpp"
#include "cpu/instruction_set.hpp"
#include "cpu/rays.hpp"
#include "cpu/threads.hpp"

namespace zkd {
namespace {

using cpu::for_each_ray;
using cpu::rays_at_once;
using cpu::with_intersector;

/// read(candidate) of the walk of one ray.
template <bool any, class Read>
auto trace_one(const TreeView& tree, const TriangleView& triangles, const Ray& ray,
               Intersector intersector, Read read) noexcept {
  const cpu::FloatEnvironment environment;
  return with_intersector(intersector, [&]<class Intersect>() {
    if (cpu::use_avx2(cpu::InstructionSet::automatic)) {
      const auto body = [&](const Ray& one) {
        return read(core::trace<any, cpu::Avx2BoxTest, Intersect>(tree, triangles, one, nullptr));
      };
      return cpu::call_avx2(body, ray);
    }
    return read(core::trace<any, core::BoxTest, Intersect>(tree, triangles, ray, nullptr));
  });
}

/// write(i, candidate) for the walk of every ray i.
template <bool any, class Write>
void trace_all(const cpu::Executor& executor, const TreeView& tree, const TriangleView& triangles,
               std::span<const Ray> rays, std::size_t count, std::span<TraversalCost> costs,
               Intersector intersector, Write write) noexcept {
  if (!costs.empty()) count = std::min(count, costs.size());
  const cpu::Threads threads(executor);
  with_intersector(intersector, [&]<class Intersect>() {
    const auto trace_with = [=]<class Boxes>(std::size_t i) {
      write(i, core::trace<any, Boxes, Intersect>(tree, triangles, rays[i],
                                                  costs.empty() ? nullptr : &costs[i]));
    };
    if (threads.avx2())
      for_each_ray(threads, count, rays_at_once,
                   [=](std::size_t i) { trace_with.template operator()<cpu::Avx2BoxTest>(i); });
    else
      for_each_ray(threads, count, rays_at_once,
                   [=](std::size_t i) { trace_with.template operator()<core::BoxTest>(i); });
  });
}

}  // namespace

std::optional<Hit> closest_hit(const TreeView& tree, const TriangleView& triangles, const Ray& ray,
                               Intersector intersector) noexcept {
  const Hit hit = trace_one<false>(tree, triangles, ray, intersector,
                                   [](const auto& found) { return core::to_hit(found); });
  if (hit.triangle == no_triangle) return std::nullopt;
  return hit;
}

bool any_hit(const TreeView& tree, const TriangleView& triangles, const Ray& ray,
             Intersector intersector) noexcept {
  return trace_one<true>(tree, triangles, ray, intersector,
                         [](const auto& found) { return found.found(); });
}

void closest_hit(const cpu::Executor& executor, const TreeView& tree, const TriangleView& triangles,
                 std::span<const Ray> rays, std::span<Hit> hits, std::span<TraversalCost> costs,
                 Intersector intersector) noexcept {
  trace_all<false>(executor, tree, triangles, rays, std::min(rays.size(), hits.size()), costs,
                   intersector,
                   [hits](std::size_t i, const auto& found) { hits[i] = core::to_hit(found); });
}

void any_hit(const cpu::Executor& executor, const TreeView& tree, const TriangleView& triangles,
             std::span<const Ray> rays, std::span<std::uint8_t> occluded,
             std::span<TraversalCost> costs, Intersector intersector) noexcept {
  trace_all<true>(
      executor, tree, triangles, rays, std::min(rays.size(), occluded.size()), costs, intersector,
      [occluded](std::size_t i, const auto& found) { occluded[i] = found.found() ? 1 : 0; });
}

glm::vec3 offset_origin(const TriangleView& triangles, const Hit& hit, const glm::vec3& direction,
                        Intersector intersector) noexcept {
  const cpu::FloatEnvironment environment;
  return with_intersector(intersector, [&]<class Intersect>() {
    return core::offset_origin(core::corners_of(triangles, hit.triangle), hit.u, hit.v, direction,
                               Intersect::plane_margin);
  });
}

}  // namespace zkd
