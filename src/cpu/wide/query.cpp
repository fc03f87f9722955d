// SPDX-License-Identifier: Apache-2.0
//
// Queries through a wide tree: single rays, and spans of rays on all threads.
#include <type_traits>

#include <zkd/cpu/wide_tree.hpp>
#include <zkd/traversal/ray.hpp>

#include "cpu/rays.hpp"
#include "cpu/wide/avx2.hpp"
#include "cpu/wide/portable.hpp"
#include "cpu/wide/walk.hpp"

namespace zkd::cpu {
namespace {

template <bool any, class Intersect, bool avx2>
inline auto trace(const WideTreeView& tree, const Ray& ray, TraversalCost* cost) {
  using Instructions = std::conditional_t<avx2, Avx2Wide, PortableWide>;
  using Decide = typename Instructions::template Decide<Intersect>;
  using Lanes = typename Instructions::template Lanes<Intersect>;
  const core::PreparedRay prepared(TreeView{tree.header}, ray, Intersect::hit_distance);
  if (prepared.valid) {
    const Decide intersect(prepared, ray);
    return walk<any, typename Instructions::Boxes, Lanes>(tree, prepared, intersect, cost);
  }
  if (cost != nullptr) *cost = {};
  return typename Decide::Candidate{};
}

}  // namespace

std::optional<Hit> closest_hit(const WideTreeView& tree, const Ray& ray,
                               Intersector intersector) noexcept {
  const Hit hit = trace_one(intersector, [&]<class Intersect, bool avx2>() {
    return core::to_hit(trace<false, Intersect, avx2>(tree, ray, nullptr));
  });
  if (hit.triangle == no_triangle) return std::nullopt;
  return hit;
}

bool any_hit(const WideTreeView& tree, const Ray& ray, Intersector intersector) noexcept {
  return trace_one(intersector, [&]<class Intersect, bool avx2>() {
    return trace<true, Intersect, avx2>(tree, ray, nullptr).found();
  });
}

void closest_hit(const Executor& executor, const WideTreeView& tree, std::span<const Ray> rays,
                 std::span<Hit> hits, std::span<TraversalCost> costs,
                 Intersector intersector) noexcept {
  trace_all(executor, rays_with_places(rays.size(), hits.size(), costs), intersector,
            [=]<class Intersect, bool avx2>(std::size_t i) {
              hits[i] =
                  core::to_hit(trace<false, Intersect, avx2>(tree, rays[i], cost_of(costs, i)));
            });
}

void any_hit(const Executor& executor, const WideTreeView& tree, std::span<const Ray> rays,
             std::span<std::uint8_t> occluded, std::span<TraversalCost> costs,
             Intersector intersector) noexcept {
  trace_all(executor, rays_with_places(rays.size(), occluded.size(), costs), intersector,
            [=]<class Intersect, bool avx2>(std::size_t i) {
              const auto found = trace<true, Intersect, avx2>(tree, rays[i], cost_of(costs, i));
              occluded[i] = found.found() ? 1 : 0;
            });
}

}  // namespace zkd::cpu
