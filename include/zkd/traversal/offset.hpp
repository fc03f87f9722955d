// SPDX-License-Identifier: Apache-2.0
//
// Where a ray begins that leaves a triangle: a float point off its plane, as near as proven to be
// enough. For device code and the library: see arithmetic.hpp.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>

namespace zkd::core {

/// The next float up or down, for any but the largest; from 0 to the smallest.
ZKD_HOST_DEVICE inline float next_float(float x, bool up) {
  if (x == 0.0F) return up ? float_of(1) : float_of(0x80000001u);
  const std::uint32_t bits = bits_of(x);
  return float_of((x > 0.0F) == up ? bits + 1 : bits - 1);
}

/// The nearest float that is not below x (`up`), or not above it; at most the largest.
ZKD_HOST_DEVICE inline float rounded_toward(Wide x, bool up) {
  constexpr double float_max = 3.4028234663852886e38;
  if (!(magnitude(x) < Wide(float_max)))
    return static_cast<float>(x.value < 0.0 ? -float_max : float_max);
  const auto nearest = static_cast<float>(x.value);
  const auto exactly = static_cast<double>(nearest);
  const bool beyond = up ? exactly >= x.value : exactly <= x.value;
  return beyond ? nearest : next_float(nearest, up);
}

/// The point of a hit, moved off the plane of the triangle to the side that `direction` goes to.
///
/// Every coordinate moves the way the normal points, by `margin` times the largest coordinate of
/// the triangle and then up to the next float: no rounding takes anything off the distance from the
/// plane ("Spawned rays" in docs/accuracy.md).
ZKD_HOST_DEVICE inline glm::vec3 offset_origin(const Corners& corners, float u, float v,
                                               const glm::vec3& direction, double margin) {
  const double along[3] = {static_cast<double>(direction.x), static_cast<double>(direction.y),
                           static_cast<double>(direction.z)};
  Wide n[3];
  Wide side = 0.0;
  float largest = 0.0F;
  for (int a = 0; a < 3; ++a) {
    n[a] = normal(corners, a);
    side = side + n[a] * Wide(along[a]);
    for (int c = 0; c < 3; ++c) largest = larger(largest, magnitude(corners.p[c][a]));
  }
  const bool front = !(side < Wide(0.0));
  const Wide distance = Wide(margin) * Wide(static_cast<double>(largest));
  float at[3];
  for (int a = 0; a < 3; ++a) {
    const Wide from = static_cast<double>(corners.p[0][a]);
    const Wide ab = Wide(static_cast<double>(corners.p[1][a])) - from;
    const Wide ac = Wide(static_cast<double>(corners.p[2][a])) - from;
    const Wide p = from + Wide(static_cast<double>(u)) * ab + Wide(static_cast<double>(v)) * ac;
    const bool flat = n[a] == Wide(0.0);
    const bool up = (n[a] > Wide(0.0)) == front;
    at[a] =
        flat ? static_cast<float>(p.value) : rounded_toward(up ? p + distance : p - distance, up);
  }
  return {at[0], at[1], at[2]};
}

}  // namespace zkd::core
