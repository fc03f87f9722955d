// SPDX-License-Identifier: Apache-2.0
//
// A ray made ready for one tree: brought to the scale and the neighbourhood of the scene, so that
// what follows may be done in single precision. Brute force prepares its rays in the same way. For
// device code and the library: see arithmetic.hpp.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/tree.hpp>

namespace zkd::core {

/// An origin further from the scene box than this many times the largest coordinate is moved along
/// the ray, in double, to the point nearest to the scene's centre.
inline constexpr double far_origin = 8.0;

struct PreparedRay {
  // In tree space. Axis kz is the one along which the direction is longest; kx, ky follow it.
  Real origin[3];
  Real inverse[3];          ///< of the direction; large instead of infinite
  Real padding[3];          ///< how far from a plane a hit may lie, in units of t
  Real far_slack;           ///< where a ray leaves a box is taken to be so many times as far
  Real shear[3];            ///< direction[kx] / direction[kz], [ky] / [kz]; 1 / direction[kz]
  Real permuted_origin[3];  ///< origin in the order kx, ky, kz
  Real permuted_rest[3];    ///< what rounding a moved origin to float took off it
  Wide wide_origin[3];      ///< the same in double, and not rounded
  Wide wide_shear[3];       ///< shear likewise
  bool moved = false;
  std::uint32_t k[3];
  std::uint32_t negative_axes = 0;  ///< bit a: the direction is negative along axis a

  // t in tree space, counted from `origin`, becomes the caller's by (t + t_shift) * t_scale.
  Wide t_shift = 0.0;
  Wide t_scale = 1.0;
  Real first;  ///< no accepted hit lies before, in tree space
  Real last;   ///< or behind
  float t_min;
  float t_max;
  Real scale;
  bool valid = false;

  /// `hit_distance`: how far from its triangle a hit may lie along an axis, as a part of the reach:
  /// the largest distance along an axis from the origin to a side of the scene box.
  ZKD_HOST_DEVICE PreparedRay(const TreeView& tree, const Ray& ray, float hit_distance)
      : t_min(ray.t_min), t_max(ray.t_max), scale(tree.scale()) {
    const float origin_in[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
    const float direction_in[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
    float longest = 0.0F;
    for (int a = 0; a < 3; ++a) {
      if (!is_finite(origin_in[a]) || !is_finite(direction_in[a])) return;
      longest = larger(longest, magnitude(direction_in[a]));
    }
    if (!(longest > 0.0F) || !(t_min <= t_max) || tree.empty()) return;

    // The direction is brought to a length between 1 and 4 by a power of two, the origin to tree
    // space; both are exact in double.
    const int direction_exponent = exponent_of(static_cast<double>(longest));
    const Wide direction_scale = power_of_two(-direction_exponent);
    const Wide wide_scale = static_cast<double>(scale.value);
    t_scale = direction_scale / wide_scale;
    const Wide to_tree = Wide(power_of_two(direction_exponent)) * wide_scale;

    Wide from[3];
    Wide direction[3];
    Wide low[3];
    Wide high[3];
    const Box& bounds = tree.header->bounds;  // a tree that is not empty has a header
    Wide coordinate = 0.0;
    Wide distance = 0.0;
    for (int a = 0; a < 3; ++a) {
      from[a] = Wide(static_cast<double>(origin_in[a])) * wide_scale;
      direction[a] = Wide(static_cast<double>(direction_in[a])) * direction_scale;
      low[a] = Wide(static_cast<double>(bounds.lo[a])) * wide_scale;
      high[a] = Wide(static_cast<double>(bounds.hi[a])) * wide_scale;
      coordinate = larger(coordinate, larger(magnitude(low[a]), magnitude(high[a])));
      distance = larger(distance, larger(low[a] - from[a], from[a] - high[a]));
    }
    if (distance > Wide(far_origin) * coordinate &&
        !approach(low, high, direction, from, coordinate))
      return;

    Real reach = 0.0F;
    Real furthest = 0.0F;
    for (int a = 0; a < 3; ++a) {
      origin[a] = static_cast<float>(from[a].value);
      furthest = larger(furthest, magnitude(origin[a]));
      const Real lo = static_cast<float>(low[a].value);
      const Real hi = static_cast<float>(high[a].value);
      reach = larger(reach, larger(magnitude(lo - origin[a]), magnitude(hi - origin[a])));
    }
    // A box test rounds where the ray enters and leaves by 4 units of 2^-24 each. Where no hit lies
    // behind the origin, that is a part of t: 16 units on the far side cover it. Else it is a part
    // of the reach, and padding. Boxes are tested from a moved origin that was rounded to float,
    // triangles are not.
    constexpr float unit = 1.0F / 16777216.0F;
    const bool ahead = !moved && !(t_min < 0.0F);
    far_slack = ahead ? 1.0F + 16.0F * unit : 1.0F;
    Real half_width = Real(hit_distance) * reach;
    if (!ahead) half_width = half_width + Real(5.0F * unit) * reach;
    if (moved) half_width = half_width + Real(2.0F * unit) * furthest;

    Real d[3];
    for (int a = 0; a < 3; ++a) {
      d[a] = static_cast<float>(direction[a].value);
      const bool negative = d[a] < Real(0.0F);
      if (negative) negative_axes |= 1u << a;
      // A component below 2^-100 moves a ray by less than half_width anywhere near the scene, but
      // its true inverse could make 0 * infinity.
      constexpr float largest_inverse = 1.2676506e30F;  // 2^100
      inverse[a] = magnitude(d[a]) > Real(1.0F / largest_inverse)
                       ? Real(1.0F) / d[a]
                       : Real(negative ? -largest_inverse : largest_inverse);
      padding[a] = half_width * magnitude(inverse[a]);
    }
    k[2] = magnitude(d[0]) >= magnitude(d[1]) ? (magnitude(d[0]) >= magnitude(d[2]) ? 0 : 2)
                                              : (magnitude(d[1]) >= magnitude(d[2]) ? 1 : 2);
    k[0] = k[2] == 2 ? 0 : k[2] + 1;
    k[1] = k[0] == 2 ? 0 : k[0] + 1;
    const Wide longest_component = element(direction, k[2]);
    wide_shear[0] = element(direction, k[0]) / longest_component;
    wide_shear[1] = element(direction, k[1]) / longest_component;
    wide_shear[2] = Wide(1.0) / longest_component;
    for (int i = 0; i < 3; ++i) {
      shear[i] = static_cast<float>(wide_shear[i].value);
      permuted_origin[i] = element(origin, k[i]);
      wide_origin[i] = element(from, k[i]);
      const Wide rounded = static_cast<double>(permuted_origin[i].value);
      permuted_rest[i] = static_cast<float>((wide_origin[i] - rounded).value);
    }

    first = bound(t_min, to_tree, -1.0);
    last = bound(t_max, to_tree, 1.0);
    valid = true;
  }

  /// Whether the direction is negative along this axis.
  [[nodiscard]] ZKD_HOST_DEVICE bool is_negative(std::uint32_t axis) const {
    return ((negative_axes >> axis) & 1u) != 0;
  }

  /// Coordinate k[i] of a corner, in tree space, from the ray's origin.
  [[nodiscard]] ZKD_HOST_DEVICE Real from_origin(const float* corner, int i) const {
    const Real difference = Real(corner[k[i]]) * scale - permuted_origin[i];
    return moved ? difference - permuted_rest[i] : difference;
  }

  /// Component k[i] of the way from one corner to another, in tree space.
  [[nodiscard]] ZKD_HOST_DEVICE Real along_edge(const float* from, const float* to, int i) const {
    return Real(to[k[i]]) * scale - Real(from[k[i]]) * scale;
  }

  [[nodiscard]] ZKD_HOST_DEVICE Wide wide_from_origin(const float* corner, int i) const {
    return Wide(static_cast<double>(corner[k[i]])) * Wide(static_cast<double>(scale.value)) -
           wide_origin[i];
  }

  /// The caller's t of a hit at `t` in tree space.
  [[nodiscard]] ZKD_HOST_DEVICE Wide callers_t(Wide t) const { return (t + t_shift) * t_scale; }

 private:
  /// Moves `from` along the ray to the point nearest to the scene's centre. False: that point is so
  /// far out that the ray passes the scene.
  ///
  /// An origin may be further away than a double can tell two points of the scene apart: `from` is
  /// moved without losing a digit, as a sum of two doubles, and moved again while t_shift, rounded,
  /// leaves it far from the scene.
  ZKD_HOST_DEVICE bool approach(const Wide (&low)[3], const Wide (&high)[3],
                                const Wide (&direction)[3], Wide (&from)[3], Wide coordinate) {
    moved = true;
    Wide squared = 0.0;
    for (int a = 0; a < 3; ++a) squared = squared + direction[a] * direction[a];
    Wide rest[3] = {0.0, 0.0, 0.0};
    for (;;) {
      Wide projected = 0.0;
      for (int a = 0; a < 3; ++a)
        projected = projected + ((low[a] + high[a]) * Wide(0.5) - from[a]) * direction[a];
      const Wide shift = projected / squared;
      t_shift = t_shift + shift;
      Wide furthest = 0.0;
      for (int a = 0; a < 3; ++a) {
        move(from[a], rest[a], shift, direction[a]);
        furthest = larger(furthest, magnitude(from[a]));
      }
      if (furthest <= Wide(16.0) * coordinate) return true;
      // What is left of the way along the ray is lost in the rounding of t_shift: another step is
      // of use while this one was the longer by far.
      if (!(magnitude(shift) > Wide(1024.0) * furthest)) return false;
    }
  }

  /// (from + rest) + shift * along, by sums and products without error (Dekker 1971; Knuth),
  /// rounded to the two doubles.
  static ZKD_HOST_DEVICE void move(Wide& from, Wide& rest, Wide shift, Wide along) {
    const Wide product = shift * along;
    const Wide product_rest = fma(shift, along, -product);
    const Wide sum = from + product;
    const Wide added = sum - from;
    const Wide sum_rest = (from - (sum - added)) + (product - added);
    const Wide small = (rest + product_rest) + sum_rest;
    from = sum + small;
    rest = small - (from - sum);
  }

  /// An end of the interval in tree space, moved outward by more than the rounding of t.
  [[nodiscard]] ZKD_HOST_DEVICE Real bound(float t, Wide to_tree, Wide outward) const {
    if (!is_finite(t)) return t;
    const Wide end = Wide(static_cast<double>(t)) * to_tree;
    // The t that is compared with it was rounded to float once, and in the caller's units: by a
    // relative error or, where it is denormal, by an absolute one.
    const Wide relative = 1.0 / 2097152.0;  // 2^-21
    const Wide absolute = Wide(power_of_two(-149)) * to_tree;
    const Wide reached =
        (end - t_shift) + outward * (relative * magnitude(end) + absolute + Wide(1.0e-30));
    constexpr double float_max = 3.4028234663852886e38;
    if (reached > Wide(float_max)) return 3.4028234663852886e38F;
    if (reached < Wide(-float_max)) return -3.4028234663852886e38F;
    return static_cast<float>(reached.value);
  }
};

}  // namespace zkd::core
