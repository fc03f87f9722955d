// SPDX-License-Identifier: Apache-2.0
//
// Exact predicates on triangles, boxes and numbers that are floats times a power of two.
//
// Every predicate is decided in double where a forward error bound allows and with GMP integers
// elsewhere. Arguments are finite doubles, each a float times a power of two with
// 2^-300 <= |x| <= 2^300 or zero: differences are then exact to one rounding, and products of three
// neither overflow nor underflow. (Floats as such qualify.)
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <zkd/geometry.hpp>

namespace zkd::verify {

using Point = std::array<double, 3>;
using Corners = std::array<Point, 3>;  ///< a triangle

/// A box with corners in double, closed.
struct ExactBox {
  Point lo;
  Point hi;
};

/// The corners of triangle `triangle`, or nothing if an index is out of range or a coordinate is
/// not finite.
[[nodiscard]] std::optional<Corners> finite_corners(const TriangleView& triangles,
                                                    std::size_t triangle);

/// Whether the area is exactly zero.
[[nodiscard]] bool exact_zero_area(const Corners& corners);

/// Whether the triangle may go into a tree: its indices exist, its coordinates are finite, and its
/// area is not exactly zero.
[[nodiscard]] bool valid_triangle(const TriangleView& triangles, std::size_t triangle);

/// Whether closed triangle and closed box share a point, exactly. False for an empty box.
[[nodiscard]] bool exact_overlap(const Corners& corners, const ExactBox& box);
[[nodiscard]] bool exact_overlap(const Corners& corners, const Box& box);

/// Whether a piece of the triangle that has an area lies in the closed box, exactly: a triangle
/// that only touches the box, or lies outside but for an edge, has none there. (One that lies in a
/// side of the box does.) The triangle must have an area.
[[nodiscard]] bool exact_shares_area(const Corners& corners, const ExactBox& box);

/// The widest gap between triangle and box along any separating axis, in double: at most their
/// distance up to rounding, and not positive (up to rounding) where they overlap.
[[nodiscard]] double separation(const Corners& corners, const ExactBox& box);

/// How far the products that make the triangle's normal cancel: their magnitudes, summed, over the
/// length of the exact normal. At least 1; large for slivers; infinite for zero area.
[[nodiscard]] double normal_condition(const Corners& corners);

/// The exact sign (-1, 0, 1) of det(d, a - o, b - o).
[[nodiscard]] int determinant_sign(const Point& d, const Point& o, const Point& a, const Point& b);

/// det(d, a - o, b - o), to a millionth of itself.
[[nodiscard]] double determinant_value(const Point& d, const Point& o, const Point& a,
                                       const Point& b);

/// det(d, p, q) in double, and its permanent: the same sum with every product taken absolute.
struct Determinant {
  double value;
  double permanent;

  /// Whether the sign of `value` is certain although p and q were rounded differences: seven
  /// roundings (two differences, two products, one inner and two outer sums) give
  /// |error| <= 7 * 2^-53 / (1 - 7 * 2^-53) * exact permanent < 7.8e-16 * permanent.
  /// A permanent of zero means that every product is zero.
  [[nodiscard]] bool certain() const {
    return value > bound * permanent || -value > bound * permanent || permanent == 0.0;
  }
  static constexpr double bound = 7.8e-16;
};

[[nodiscard]] inline Determinant determinant(const Point& d, const Point& p, const Point& q) {
  const auto magnitude = [](double x) { return x < 0.0 ? -x : x; };
  const double pq[3][2] = {
      {p[1] * q[2], p[2] * q[1]}, {p[2] * q[0], p[0] * q[2]}, {p[0] * q[1], p[1] * q[0]}};
  Determinant result{0.0, 0.0};
  for (std::size_t i = 0; i < 3; ++i) {
    result.value += d[i] * (pq[i][0] - pq[i][1]);
    result.permanent += magnitude(d[i]) * (magnitude(pq[i][0]) + magnitude(pq[i][1]));
  }
  return result;
}

[[nodiscard]] inline Point difference(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// Where the ray o + t * d meets the plane of a triangle (a, b, c), n = (b - a) x (c - a):
/// t = (a - o) . n / (d . n).
struct PlaneHit {
  double t;            ///< to the nearest double; NaN where d . n is zero
  double denominator;  ///< d . n, to a double
  double normal;       ///< |n|, to a few ulp
};

/// Computed in integers and rounded once.
[[nodiscard]] PlaneHit plane_hit(const Point& o, const Point& d, const Corners& corners);

/// Where the line o + t * d meets the plane of (a, b, c): at (1 - u - v) * a + u * b + v * c.
struct Barycentrics {
  double u;  ///< to the nearest double; NaN where d . n is zero
  double v;
};

/// Computed in integers and rounded once.
[[nodiscard]] Barycentrics barycentrics(const Point& o, const Point& d, const Corners& corners);

}  // namespace zkd::verify
