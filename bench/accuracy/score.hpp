// SPDX-License-Identifier: Apache-2.0
//
// Answers held against the truth: E1 (missed, phantom), E2 (wrong triangle), E4 (t, u, v), each by
// the class of the exact hit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <zkd/geometry.hpp>
#include <zkd/query.hpp>

#include "histogram.hpp"
#include "truth.hpp"
#include "verify/oracle.hpp"

namespace zkd::bench::accuracy {

/// A wrong triangle whose t is this near to the exact one, in float ulps, does no harm.
inline constexpr double benign_ulps = 4.0;

/// Rays of one class, and what was answered wrongly. `in_band_...`: how many of them the
/// intersector's error bound excuses (0 where nobody judged).
struct Counts {
  std::uint64_t rays = 0;
  std::uint64_t missed = 0;
  std::uint64_t phantom = 0;
  std::uint64_t wrong_benign = 0;  ///< id outside the tie set, t within benign_ulps
  std::uint64_t wrong_real = 0;    ///< the other wrong ids
  std::uint64_t in_band_missed = 0;
  std::uint64_t in_band_phantom = 0;
  std::uint64_t in_band_wrong = 0;

  Counts& operator+=(const Counts& other);

  [[nodiscard]] std::uint64_t wrong() const { return wrong_benign + wrong_real; }
  /// E1 + E2.
  [[nodiscard]] std::uint64_t errors() const { return missed + phantom + wrong(); }
  [[nodiscard]] std::uint64_t outside_band() const {
    return errors() - in_band_missed - in_band_phantom - in_band_wrong;
  }
};

/// Upper ends of the bins of E4, of |d| |n| / |d . n|; the last bin holds the rest.
inline constexpr std::array<double, 6> condition_ends{2.0, 10.0, 100.0, 1e3, 1e4, 1e6};
inline constexpr std::size_t condition_bins = condition_ends.size() + 1;

struct Score {
  std::array<Counts, ray_classes> of_class{};

  /// Of correct hits, by condition: |t - exact t| in float ulps of the exact t; |u - exact u| and
  /// |v - exact v| in units of 2^-24, the spacing of floats below 1 (of hits whose id is the first
  /// of the tie set).
  std::array<Histogram, condition_bins> t_ulps;
  std::array<Histogram, condition_bins> uv_units;

  /// How far outside its triangle each phantom hit lies: minus the least barycentric coordinate of
  /// the point where the exact ray meets the plane, in units of 2^-24. Infinite for a ray in the
  /// plane.
  Histogram phantom_units;

  /// Correct hits whose t, u or v is further off than Intersector promises; known where there is
  /// such a promise.
  std::optional<std::uint64_t> above_bound;

  /// The first ray answered outside the band (or, where nobody judged, wrongly), and the first
  /// whose t, u or v is beyond the bound.
  std::optional<Ray> first_offender;
  std::optional<Ray> first_above_bound;

  bool judged = false;  ///< whether the counts in the band are known

  [[nodiscard]] Counts total() const;
  [[nodiscard]] Histogram all_t_ulps() const;
  void add(const Score& other);
};

/// Origin, direction and interval, in hexadecimal: to be shot again.
[[nodiscard]] std::string describe(const Ray& ray);

/// The float ulp at x.
[[nodiscard]] double float_ulp(double x);

/// What score() holds answers against. With `oracle` and `intersector` every wrong answer is judged
/// by the error band of that intersector (verify/band.hpp), and every t, u and v by its bound.
struct Exam {
  const Truth& truth;
  const TriangleView& triangles;
  const verify::Oracle* oracle = nullptr;
  std::optional<Intersector> intersector;
  int threads = 1;
};

/// hits[i] answers ray i * stride of the truth.
[[nodiscard]] Score score(const Exam& exam, std::span<const Hit> hits, std::size_t stride = 1);

}  // namespace zkd::bench::accuracy
