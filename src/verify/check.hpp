// SPDX-License-Identifier: Apache-2.0
//
// Many answers held against the oracle, counted.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <zkd/geometry.hpp>

#include "verify/band.hpp"
#include "verify/oracle.hpp"

namespace zkd::verify {

/// Wrong answers by kind.
struct Mistakes {
  std::uint64_t missed = 0;
  std::uint64_t phantom = 0;
  std::uint64_t wrong_triangle = 0;

  [[nodiscard]] std::uint64_t total() const { return missed + phantom + wrong_triangle; }
};

/// What check() found. `missed`, `phantom` and `wrong_triangle` count all of their kind, in the
/// band or not; `in_band` counts those of them that the band excuses.
struct Summary {
  std::uint64_t rays = 0;
  std::uint64_t correct = 0;
  std::uint64_t missed = 0;
  std::uint64_t phantom = 0;
  std::uint64_t wrong_triangle = 0;
  Mistakes in_band;
  double t_ulp_p999 = 0.0;  ///< 99.9th percentile over correct hits, see Verdict::t_ulp
  double t_ulp_max = 0.0;
  std::uint64_t beyond_bound = 0;  ///< correct hits whose t, u or v is further off than promised
  std::vector<std::uint64_t> first_offenders;  ///< the first 10 rays answered outside the band or
                                               ///< with a t, u or v beyond its bound

  /// Answers that are errors: the target is 0.
  [[nodiscard]] std::uint64_t outside_band() const {
    return missed + phantom + wrong_triangle - in_band.total() + beyond_bound;
  }

  /// Adds the counts of other rays, not their t_ulp figures nor their first_offenders.
  void add_counts(const Summary& other);
};

/// Judges hits[i] as what `intersector` answered to rays[i], on `threads` threads (0: all).
/// `progress` is called now and then on the calling thread with the rays done so far, at last with
/// their number; it must not throw. The summary does not depend on the number of threads.
///
/// Throws std::invalid_argument where the spans differ in length.
[[nodiscard]] Summary check(const Oracle& oracle, const TriangleView& triangles,
                            std::span<const Ray> rays, std::span<const Hit> hits, int threads,
                            const std::function<void(std::uint64_t)>& progress = {},
                            Intersector intersector = Intersector::watertight);

}  // namespace zkd::verify
