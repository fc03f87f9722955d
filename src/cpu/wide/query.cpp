// SPDX-License-Identifier: Apache-2.0
//
// Queries through a wide tree: single rays, and spans of rays on all threads.
#include <algorithm>

#include <zkd/cpu/wide_tree.hpp>
#include <zkd/traversal/ray.hpp>

#include "cpu/float_environment.hpp"
#include "cpu/instruction_set.hpp"
#include "cpu/rays.hpp"
#include "cpu/threads.hpp"
#include "cpu/wide/avx2.hpp"
#include "cpu/wide/portable.hpp"
#include "cpu/wide/walk.hpp"

namespace zkd::cpu {
namespace {

template <bool any, class Instructions, class Intersect>
inline auto trace(const WideTreeView& tree, const Ray& ray, TraversalCost* cost) {
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

/// read(candidate) of the walk of one ray.
template <bool any, class Read>
auto trace_one(const WideTreeView& tree, const Ray& ray, Intersector intersector,
               Read read) noexcept {
  const FloatEnvironment environment;
  return with_intersector(intersector, [&]<class Intersect>() {
    if (use_avx2(InstructionSet::automatic)) {
      const auto body = [&](const Ray& one) {
        return read(trace<any, Avx2Wide, Intersect>(tree, one, nullptr));
      };
      return call_avx2(body, ray);
    }
    return read(trace<any, PortableWide, Intersect>(tree, ray, nullptr));
  });
}

/// write(i, candidate) for the walk of every ray i.
template <bool any, class Write>
void trace_all(const Executor& executor, const WideTreeView& tree, std::span<const Ray> rays,
               std::size_t count, std::span<TraversalCost> costs, Intersector intersector,
               Write write) noexcept {
  if (!costs.empty()) count = std::min(count, costs.size());
  const Threads threads(executor);
  with_intersector(intersector, [&]<class Intersect>() {
    const auto trace_with = [=]<class Instructions>(std::size_t i) {
      write(i, trace<any, Instructions, Intersect>(tree, rays[i],
                                                   costs.empty() ? nullptr : &costs[i]));
    };
    if (threads.avx2())
      for_each_ray(threads, count, rays_at_once,
                   [=](std::size_t i) { trace_with.template operator()<Avx2Wide>(i); });
    else
      for_each_ray(threads, count, rays_at_once,
                   [=](std::size_t i) { trace_with.template operator()<PortableWide>(i); });
  });
}

}  // namespace

std::optional<Hit> closest_hit(const WideTreeView& tree, const Ray& ray,
                               Intersector intersector) noexcept {
  const Hit hit = trace_one<false>(tree, ray, intersector,
                                   [](const auto& found) { return core::to_hit(found); });
  if (hit.triangle == no_triangle) return std::nullopt;
  return hit;
}

bool any_hit(const WideTreeView& tree, const Ray& ray, Intersector intersector) noexcept {
  return trace_one<true>(tree, ray, intersector, [](const auto& found) { return found.found(); });
}

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
