// SPDX-License-Identifier: Apache-2.0
//
// What every query on the CPU is made of: the intersector's code by its name, for the instruction
// set by its name, of one ray or in a loop over rays on all threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <zkd/query.hpp>
#include <zkd/traversal/intersectors.hpp>

#include "core/exact/intersect.hpp"
#include "cpu/float_environment.hpp"
#include "cpu/instruction_set.hpp"
#include "cpu/threads.hpp"

namespace zkd::cpu {

/// Rays that a thread takes at a time.
inline constexpr std::uint32_t rays_at_once = 64;

/// call<type of the intersector>()
template <class Call>
auto with_intersector(Intersector intersector, Call call) {
  if (intersector == Intersector::exact) return call.template operator()<core::ExactIntersect>();
  return core::with_intersector(intersector, call);
}

/// work(begin, end) for ranges of rays that are all of them. A pass counts in 32 bits: longer spans
/// are done in several.
template <class Work>
void for_each_range_of_rays(const Threads& threads, std::size_t count, std::uint32_t at_once,
                            Work work) {
  constexpr std::size_t most = std::size_t{1} << 30;
  for (std::size_t done = 0; done < count; done += most) {
    const auto n = static_cast<std::uint32_t>(std::min(most, count - done));
    threads.share(n, at_once, [=](Range range) { work(done + range.begin, done + range.end); });
  }
}

/// work(i) for every ray i.
template <class Work>
void for_each_ray(const Threads& threads, std::size_t count, std::uint32_t at_once, Work work) {
  for_each_range_of_rays(threads, count, at_once, [=](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) work(i);
  });
}

/// trace.operator()<type of the intersector, whether in AVX2 code>(), of one ray.
template <class Trace>
auto trace_one(Intersector intersector, Trace trace) noexcept {
  const FloatEnvironment environment;
  return with_intersector(intersector, [&]<class Intersect>() {
    if (use_avx2(InstructionSet::automatic)) {
      const auto body = [&] { return trace.template operator()<Intersect, true>(); };
      return call_avx2(body);
    }
    return trace.template operator()<Intersect, false>();
  });
}

/// The same (i) for every ray i, on the executor's threads.
template <class Trace>
void trace_all(const Executor& executor, std::size_t count, Intersector intersector,
               Trace trace) noexcept {
  const Threads threads(executor);
  with_intersector(intersector, [&]<class Intersect>() {
    if (threads.avx2())
      for_each_ray(threads, count, rays_at_once,
                   [=](std::size_t i) { trace.template operator()<Intersect, true>(i); });
    else
      for_each_ray(threads, count, rays_at_once,
                   [=](std::size_t i) { trace.template operator()<Intersect, false>(i); });
  });
}

/// How many rays have places for all that is asked of them. Only costs may be left out.
inline std::size_t rays_with_places(std::size_t rays, std::size_t answers,
                                    std::span<const TraversalCost> costs) {
  const std::size_t count = std::min(rays, answers);
  return costs.empty() ? count : std::min(count, costs.size());
}

/// Where a ray's cost goes; null: nowhere.
inline TraversalCost* cost_of(std::span<TraversalCost> costs, std::size_t i) {
  return costs.empty() ? nullptr : &costs[i];
}

}  // namespace zkd::cpu
