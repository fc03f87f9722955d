// SPDX-License-Identifier: Apache-2.0
//
// Queries on the CPU: single rays, spans of rays on all threads, and brute force.
#include <zkd/query.hpp>

#include <algorithm>

#include <zkd/traversal/traverse.hpp>

#include "cpu/box_test.hpp"
#include "cpu/float_environment.hpp"
#include "cpu/instruction_set.hpp"
#include "cpu/threads.hpp"

namespace zkd {
namespace {

/// Rays that a thread takes at a time.
constexpr std::uint32_t rays_at_once = 64;

template <bool any>
core::Candidate trace_one(const TreeView& tree, const TriangleView& triangles,
                          const Ray& ray) noexcept {
  const cpu::FloatEnvironment environment;
  if (cpu::use_avx2(cpu::InstructionSet::automatic)) {
    const auto body = [&tree, &triangles](const Ray& one) {
      return core::trace<any, cpu::Avx2BoxTest>(tree, triangles, one, nullptr);
    };
    return cpu::call_avx2(body, ray);
  }
  return core::trace<any>(tree, triangles, ray, nullptr);
}

/// work(i) for every ray i. A pass counts in 32 bits: longer spans are done in several.
template <class Work>
void for_each_ray(const cpu::Threads& threads, std::size_t count, std::uint32_t at_once,
                  Work work) noexcept {
  constexpr std::size_t most = std::size_t{1} << 30;
  for (std::size_t done = 0; done < count; done += most) {
    const auto n = static_cast<std::uint32_t>(std::min(most, count - done));
    threads.share(n, at_once, [=](cpu::Range range) {
      for (std::size_t i = done + range.begin; i < done + range.end; ++i) work(i);
    });
  }
}

template <bool any, class Write>
void trace_all(const cpu::Executor& executor, const TreeView& tree, const TriangleView& triangles,
               std::span<const Ray> rays, std::size_t count, std::span<TraversalCost> costs,
               Write write) noexcept {
  if (!costs.empty()) count = std::min(count, costs.size());
  const auto trace_with = [=]<class Boxes>(std::size_t i) {
    write(i,
          core::trace<any, Boxes>(tree, triangles, rays[i], costs.empty() ? nullptr : &costs[i]));
  };
  const cpu::Threads threads(executor);
  if (threads.avx2())
    for_each_ray(threads, count, rays_at_once,
                 [=](std::size_t i) { trace_with.template operator()<cpu::Avx2BoxTest>(i); });
  else
    for_each_ray(threads, count, rays_at_once,
                 [=](std::size_t i) { trace_with.template operator()<core::BoxTest>(i); });
}

}  // namespace

std::optional<Hit> closest_hit(const TreeView& tree, const TriangleView& triangles,
                               const Ray& ray) noexcept {
  const core::Candidate found = trace_one<false>(tree, triangles, ray);
  if (!found.found()) return std::nullopt;
  return core::to_hit(found);
}

bool any_hit(const TreeView& tree, const TriangleView& triangles, const Ray& ray) noexcept {
  return trace_one<true>(tree, triangles, ray).found();
}

void closest_hit(const cpu::Executor& executor, const TreeView& tree, const TriangleView& triangles,
                 std::span<const Ray> rays, std::span<Hit> hits,
                 std::span<TraversalCost> costs) noexcept {
  trace_all<false>(
      executor, tree, triangles, rays, std::min(rays.size(), hits.size()), costs,
      [hits](std::size_t i, const core::Candidate& found) { hits[i] = core::to_hit(found); });
}

void any_hit(const cpu::Executor& executor, const TreeView& tree, const TriangleView& triangles,
             std::span<const Ray> rays, std::span<std::uint8_t> occluded,
             std::span<TraversalCost> costs) noexcept {
  trace_all<true>(executor, tree, triangles, rays, std::min(rays.size(), occluded.size()), costs,
                  [occluded](std::size_t i, const core::Candidate& found) {
                    occluded[i] = found.found() ? 1 : 0;
                  });
}

void closest_hit_brute_force(const cpu::Executor& executor, const TreeView& tree,
                             const TriangleView& triangles, std::span<const Ray> rays,
                             std::span<Hit> hits) noexcept {
  const std::size_t count = std::min(rays.size(), hits.size());
  for_each_ray(cpu::Threads(executor), count, 1, [=](std::size_t i) {
    hits[i] = core::to_hit(core::trace_brute_force(tree, triangles, rays[i]));
  });
}

}  // namespace zkd
