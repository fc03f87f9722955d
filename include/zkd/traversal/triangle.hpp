// SPDX-License-Identifier: Apache-2.0
//
// One triangle and its box: corners, centre, whether it has an area. For device code and the
// library: see arithmetic.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>

namespace zkd::core {

/// Makes `box` hold `other` too.
ZKD_HOST_DEVICE inline void include(Box& box, const Box& other) {
  for (int a = 0; a < 3; ++a) {
    box.lo[a] = smaller(box.lo[a], other.lo[a]);
    box.hi[a] = larger(box.hi[a], other.hi[a]);
  }
}

/// Centre of a box along one axis: exact in double but for floats 2^29 times apart.
ZKD_HOST_DEVICE inline double centre(const Box& box, int a) {
  const Wide lo = static_cast<double>(box.lo[a]);
  const Wide hi = static_cast<double>(box.hi[a]);
  return ((lo + hi) * Wide(0.5)).value;
}

/// The corners of one triangle.
struct Corners {
  const float* p[3];
};

ZKD_HOST_DEVICE inline Corners corners_of(const TriangleView& triangles, std::size_t triangle) {
  return {{triangles.position(triangles.index(triangle, 0)),
           triangles.position(triangles.index(triangle, 1)),
           triangles.position(triangles.index(triangle, 2))}};
}

ZKD_HOST_DEVICE inline bool all_finite(const Corners& c) {
  std::uint32_t largest = 0;
  for (int corner = 0; corner < 3; ++corner)
    for (int a = 0; a < 3; ++a) largest = larger(largest, bits_of(c.p[corner][a]) & 0x7FFFFFFFu);
  return largest < 0x7F800000u;
}

/// The sum of six doubles to an ulp, and with the exact sign: every rounding error is kept
/// (Shewchuk 1997, grow-expansion: after each step the components add up to the exact sum, do not
/// overlap, and grow, so that the last that is not zero outweighs those before it).
ZKD_HOST_DEVICE inline Wide exact_sum(const Wide (&terms)[6]) {
  Wide expansion[6];
  int length = 0;
  for (const Wide term : terms) {
    Wide carry = term;
    for (int i = 0; i < length; ++i) {
      const Wide sum = carry + expansion[i];
      const Wide virtual_part = sum - carry;
      expansion[i] = (carry - (sum - virtual_part)) + (expansion[i] - virtual_part);
      carry = sum;
    }
    expansion[length++] = carry;
  }
  Wide total = 0.0;
  for (int i = 0; i < length; ++i) total = total + expansion[i];
  return total;
}

/// Twice the signed area of the triangle (a, b, c) in a plane, to an ulp and with the exact sign.
/// The products of two floats are exact in double.
ZKD_HOST_DEVICE inline Wide projected_area(Wide ax, Wide ay, Wide bx, Wide by, Wide cx, Wide cy) {
  const Wide terms[6] = {ax * by, -(ay * bx), bx * cy, -(by * cx), cx * ay, -(cy * ax)};
  return exact_sum(terms);
}

/// Component `axis` of (b - a) x (c - a), to an ulp and with the exact sign.
ZKD_HOST_DEVICE inline Wide normal(const Corners& c, int axis) {
  const int i = axis == 2 ? 0 : axis + 1;
  const int j = i == 2 ? 0 : i + 1;
  return projected_area(static_cast<double>(c.p[0][i]), static_cast<double>(c.p[0][j]),
                        static_cast<double>(c.p[1][i]), static_cast<double>(c.p[1][j]),
                        static_cast<double>(c.p[2][i]), static_cast<double>(c.p[2][j]));
}

/// Shewchuk's bound for the sign of a difference of products, relative to the sum of their
/// magnitudes: (3 + 16 u) u with u = 2^-53.
inline constexpr double projection_bound = 3.3306690738754716e-16;

/// Whether the area of the triangle's projection differs from zero for certain.
ZKD_HOST_DEVICE inline bool projection_surely_has_area(Wide ax, Wide ay, Wide bx, Wide by, Wide cx,
                                                       Wide cy) {
  const Wide left = (bx - ax) * (cy - ay);
  const Wide right = (by - ay) * (cx - ax);
  const Wide bound = Wide(projection_bound) * (magnitude(left) + magnitude(right));
  return magnitude(left - right) > bound;
}

/// The same of one of the three projections.
ZKD_HOST_DEVICE inline bool any_projection_surely_has_area(const Corners& c) {
  const float* a = c.p[0];
  const float* b = c.p[1];
  const float* d = c.p[2];
  return projection_surely_has_area(a[0], a[1], b[0], b[1], d[0], d[1]) ||
         projection_surely_has_area(a[1], a[2], b[1], b[2], d[1], d[2]) ||
         projection_surely_has_area(a[2], a[0], b[2], b[0], d[2], d[0]);
}

/// Whether two points are the same.
ZKD_HOST_DEVICE inline bool coincide(const float* a, const float* b) {
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/// Zero area of a triangle that does not surely have one. Exact sums, which take long, are left for
/// corners that differ.
ZKD_HOST_DEVICE inline bool has_zero_area_exactly(const Corners& c) {
  if (coincide(c.p[0], c.p[1]) || coincide(c.p[1], c.p[2]) || coincide(c.p[2], c.p[0])) return true;
  return normal(c, 0) == Wide(0.0) && normal(c, 1) == Wide(0.0) && normal(c, 2) == Wide(0.0);
}

/// Exactly: corners that coincide or lie on one line. A float cross product of zero would also
/// throw away real slivers. One projection with an area is enough, and that of a wall need not be
/// the first.
ZKD_HOST_DEVICE inline bool has_zero_area(const Corners& c) {
  return !any_projection_surely_has_area(c) && has_zero_area_exactly(c);
}

/// Whether a build takes the triangle. Its indices must be in range.
ZKD_HOST_DEVICE inline bool is_valid(const Corners& c) {
  return all_finite(c) && !has_zero_area(c);
}

}  // namespace zkd::core
