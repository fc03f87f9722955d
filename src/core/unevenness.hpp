// SPDX-License-Identifier: Apache-2.0
//
// For References::automatic: whether splitting triangles pays, told from the sizes of their boxes
// while they are validated.
//
// A triangle listed once hangs below the node where its centre falls, as deep as triangles are
// dense there, and its box makes all nodes on the way large. Were N triangles of equal boxes spread
// evenly, the node of a box of p of the scene's surface would lie log2(p N) levels higher than a
// leaf: a random line that meets the box visits about so many nodes that it would not need. Summed
// over all triangles that is the unevenness of a scene: 5 to 15 for scans, whatever they are of, 57
// for Sibenik, where splitting still saves nothing, 106 for the Conference room and 148 for Sponza,
// where it saves a third of the visits.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
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

/// ValidateTriangle, and the class of the triangle's box.
struct ValidateAndMeasure {
  ValidateTriangle validate;

  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t triangle, ValidationReport& report) const {
    validate(triangle, report);
    const Box& box = validate.boxes[triangle];
    return box.empty() ? SizeClasses::count : SizeClasses::of(half_area(box));
  }
};

/// From how much on triangles are split.
inline constexpr double uneven = 75.0;

/// Whether a scene of `valid` triangles within `bounds`, so many in each class, is uneven.
ZKD_HOST_DEVICE inline bool is_uneven(const std::uint32_t* classes, const Box& bounds,
                                      std::uint32_t valid) {
  if (valid == 0) return false;
  const double even = half_area(bounds) / static_cast<double>(valid);
  if (!(even > 0.0)) return false;
  // log2, with straight lines between powers of two: the same bits everywhere.
  const int exponent = exponent_of(even);
  const double log_even = exponent + (even * power_of_two(-exponent) - 1.0);
  double sum = 0.0;
  for (std::uint32_t c = 0; c < SizeClasses::count; ++c) {
    if (classes[c] == 0) continue;
    const int log_size = static_cast<int>(c) + SizeClasses::lowest;
    const double levels = log_size + 0.5 - log_even;
    if (levels <= 0.0) continue;
    const double size = 1.4142135623730951 * power_of_two(log_size);
    sum += static_cast<double>(classes[c]) * (size / half_area(bounds)) * levels;
  }
  return sum > uneven;
}

}  // namespace zkd::core
