// SPDX-License-Identifier: Apache-2.0
//
// E5: rays from inside closed meshes, which must all hit: at random, at edges, at vertices and
// beside vertices. Needs no oracle, so that there can be very many.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <zkd/cpu/executor.hpp>

#include "runner.hpp"
#include "scenes.hpp"

namespace zkd::bench::accuracy {

/// What the rays are aimed at.
inline constexpr std::size_t target_kinds = 4;
inline constexpr std::array<const char*, target_kinds> target_names{"random", "edge", "vertex",
                                                                    "near_vertex"};

/// A second hit this near behind the first, in float ulps of t, is one surface hit twice.
inline constexpr double double_hit_ulps = 16.0;

struct LeakCounts {
  std::uint64_t rays = 0;
  std::uint64_t leaks = 0;
  std::uint64_t double_hits = 0;
};

struct LeaksOf {
  std::string name;  ///< the intersector, or "embree-..."
  bool peer = false;
  bool watertight = false;  ///< it is promised that nothing leaks
  std::array<LeakCounts, target_kinds> of_target{};
  std::string first_leak;  ///< mesh and ray of the first; empty if there is none

  [[nodiscard]] LeakCounts total() const;
};

struct Leaks {
  std::vector<std::string> meshes;
  std::vector<LeaksOf> of;
};

/// About `rays` rays on generated closed meshes and on those of `scenes` that are closed, for
/// each intersector (`exact`: a sixteenth). Peers get as many, 10^7 at most.
[[nodiscard]] Leaks count_leaks(const std::vector<TestScene>& scenes, std::uint64_t rays,
                                std::uint64_t seed, const cpu::Executor& executor,
                                const Beside& beside);

}  // namespace zkd::bench::accuracy
