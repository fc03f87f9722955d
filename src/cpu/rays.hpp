// SPDX-License-Identifier: Apache-2.0
//
// What every query on the CPU is made of: the intersector's code by its name, and a loop over rays
// on all threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <zkd/traversal/intersectors.hpp>

#include "core/exact/intersect.hpp"
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

}  // namespace zkd::cpu
