// SPDX-License-Identifier: Apache-2.0
//
// For References::automatic and ::all: whether splitting triangles pays, told from the sizes of
// their boxes while they are validated.
//
// A triangle listed once hangs below the node where its centre falls, as deep as triangles are
// dense there, and its box makes all nodes on the way large. Were N triangles of equal boxes spread
// evenly, the node of a box of p of the scene's surface would lie log2(p N) levels higher than a
// leaf: a random line that meets the box visits about so many nodes that it would not need. Summed
// over all triangles for which these are more than `few_levels`, that is the unevenness of a scene:
// 0 for scans, 7 for the Fairy's meadow, 44 for Sibenik, where splitting saves `budget` nothing,
// 110 for the Conference room and 160 for Sponza, where it saves a third of the visits.
//
// Triangles of fewer levels are most of a scan and do not tell scenes apart; leaving them out is
// what makes the measure cheap.
#pragma once

#include <cmath>
#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/traversal/arithmetic.hpp>

#include "core/area.hpp"
#include "core/validate.hpp"

namespace zkd::core {

/// Classes of sizes of boxes: an octave each, over all that three floats can make.
struct SizeClasses {
  static constexpr std::int32_t lowest = -300;
  static constexpr std::uint32_t count = 580;

  /// The class of a half surface; `count` for none.
  [[nodiscard]] static ZKD_HOST_DEVICE std::uint32_t of(double half_area) {
    if (!(half_area > 0.0)) return count;
    return static_cast<std::uint32_t>(exponent_of(half_area) - lowest);
  }
};

/// Nodes that a box may cost a line without being counted.
inline constexpr int few_levels = 5;

/// ValidateTriangle, and the class of the triangle's box; of boxes that can only cost few levels,
/// which are told by their longest sides: none.
struct ValidateAndMeasure {
  ValidateTriangle validate;
  /// A side that is too short, by the part of the scene seen so far: which ones are left out
  /// depends on the order, but none that unevenness_of() counts.
  float too_short = 0.0F;
  std::uint32_t measured = 0;

  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t triangle, ValidationReport& report) {
    bool is_long = false;
    validate(triangle, report, [this, &is_long](const TriangleLanes& lanes) {
      is_long = lanes.has_side_above(too_short);
    });
    if (!is_long) return SizeClasses::count;
    if (measured++ % 16 == 0) too_short = side_of_few_levels(report.bounds);
    return SizeClasses::of(half_area(validate.boxes[triangle]));
  }

 private:
  /// Half the surface is at most three squares of the longest side, and bounds only grow. Rounding,
  /// of this and of a side, is far less than the part that is taken off; a side that no float holds
  /// is longer than any.
  [[nodiscard]] ZKD_HOST_DEVICE float side_of_few_levels(const Box& bounds) const {
    const double half = half_area(bounds) / static_cast<double>(validate.triangles.triangle_count) *
                        power_of_two(few_levels);
    constexpr double float_max = 3.4028234663852886e38;
    return static_cast<float>(smaller(0.999 * ::sqrt(half / 3.0), float_max));
  }
};

/// Whether the scene decides if triangles are split.
ZKD_HOST_DEVICE inline bool splits_if_uneven(References references) {
  return references == References::automatic || references == References::all;
}

/// Whether a scene of so much unevenness has its triangles split, where it decides. A triangle that
/// is listed once is split for its box alone, which pays in Conference, not in Sibenik. Cells are
/// better that are made of fragments wherever large triangles lie among small ones: SAH cost 54 to
/// 89 of 100 in Conference, the Fairy's meadow, Sponza and Sibenik, with leaves of one size. But
/// where lines meet dozens of boxes that lie in each other (a million about one point), more cells
/// list them all more often.
ZKD_HOST_DEVICE inline bool is_uneven(References references, double unevenness) {
  return references == References::all ? unevenness > 3.0 && unevenness < 1000.0
                                       : unevenness > 75.0;
}

/// Unevenness of a scene of `valid` triangles within `bounds`, so many in each class.
ZKD_HOST_DEVICE inline double unevenness_of(const std::uint32_t* classes, const Box& bounds,
                                            std::uint32_t valid) {
  if (valid == 0) return 0.0;
  const double even = half_area(bounds) / static_cast<double>(valid);
  if (!(even > 0.0)) return 0.0;
  // log2, with straight lines between powers of two: the same bits everywhere.
  const int exponent = exponent_of(even);
  const double log_even = exponent + (even * power_of_two(-exponent) - 1.0);
  double sum = 0.0;
  for (std::uint32_t c = 0; c < SizeClasses::count; ++c) {
    if (classes[c] == 0) continue;
    const int log_size = static_cast<int>(c) + SizeClasses::lowest;
    const double levels = log_size + 0.5 - log_even;
    // A box of few_levels may be in the class of half a level more; log_even is 0.09 low at most.
    if (levels <= few_levels + 0.6) continue;
    const double size = 1.4142135623730951 * power_of_two(log_size);
    sum += static_cast<double>(classes[c]) * (size / half_area(bounds)) * levels;
  }
  return sum;
}

}  // namespace zkd::core
