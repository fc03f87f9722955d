// SPDX-License-Identifier: Apache-2.0
//
// Stage 1, validation: which triangles go into the tree, their boxes, and the box of the scene.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>

#include "core/arithmetic.hpp"

namespace zkd::core {

inline constexpr std::uint32_t none_found = 0xFFFFFFFFu;

ZKD_HOST_DEVICE inline void include(Box& box, const Box& other) {
  for (int a = 0; a < 3; ++a) {
    box.lo[a] = smaller(box.lo[a], other.lo[a]);
    box.hi[a] = larger(box.hi[a], other.hi[a]);
  }
}

/// What validation found, over some triangles; the scene's is the combination of all.
struct ValidationReport {
  Box bounds;
  std::uint32_t valid = 0;
  std::uint32_t zero_area = 0;
  std::uint32_t non_finite = 0;
  std::uint32_t first_out_of_range = none_found;
  std::uint32_t first_non_finite = none_found;

  ZKD_HOST_DEVICE void combine(const ValidationReport& other) {
    include(bounds, other.bounds);
    valid += other.valid;
    zero_area += other.zero_area;
    non_finite += other.non_finite;
    first_out_of_range = smaller(first_out_of_range, other.first_out_of_range);
    first_non_finite = smaller(first_non_finite, other.first_non_finite);
  }
};

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

/// Whether the sum of six doubles is exactly zero, by keeping every rounding error (Shewchuk 1997,
/// grow-expansion: after each step the components add up to the exact sum and do not overlap).
ZKD_HOST_DEVICE inline bool sums_to_zero(const double (&terms)[6]) {
  double expansion[6];
  int length = 0;
  for (const double term : terms) {
    double carry = term;
    for (int i = 0; i < length; ++i) {
      const double sum = carry + expansion[i];
      const double virtual_part = sum - carry;
      expansion[i] = (carry - (sum - virtual_part)) + (expansion[i] - virtual_part);
      carry = sum;
    }
    expansion[length++] = carry;
  }
  for (int i = 0; i < length; ++i)
    if (expansion[i] != 0.0) return false;
  return true;
}

/// Twice the signed area of the triangle's projection along one axis: is it exactly zero?
/// The products of two floats are exact in double.
ZKD_HOST_DEVICE inline bool projection_has_zero_area(double ax, double ay, double bx, double by,
                                                     double cx, double cy) {
  const double left = (bx - ax) * (cy - ay);
  const double right = (by - ay) * (cx - ax);
  // Shewchuk's bound for the sign of the difference, (3 + 16 u) u with u = 2^-53.
  const double bound = 3.3306690738754716e-16 * (magnitude(left) + magnitude(right));
  if (magnitude(left - right) > bound) return false;
  const double terms[6] = {ax * by, -(ay * bx), bx * cy, -(by * cx), cx * ay, -(cy * ax)};
  return sums_to_zero(terms);
}

/// Exactly: corners that coincide or lie on one line. A float cross product of zero would also
/// throw away real slivers.
ZKD_HOST_DEVICE inline bool has_zero_area(const Corners& c) {
  const float* a = c.p[0];
  const float* b = c.p[1];
  const float* d = c.p[2];
  return projection_has_zero_area(a[0], a[1], b[0], b[1], d[0], d[1]) &&
         projection_has_zero_area(a[1], a[2], b[1], b[2], d[1], d[2]) &&
         projection_has_zero_area(a[2], a[0], b[2], b[0], d[2], d[0]);
}

/// Whether a build takes the triangle. Its indices must be in range.
ZKD_HOST_DEVICE inline bool is_valid(const Corners& c) {
  return all_finite(c) && !has_zero_area(c);
}

/// One triangle: writes its box (empty if left out) and adds to a report.
struct ValidateTriangle {
  TriangleView triangles;
  Box* boxes;

  ZKD_HOST_DEVICE void operator()(std::uint32_t triangle, ValidationReport& report) const {
    Box box;
    bool in_range = true;
    if (triangles.indices != nullptr)
      for (int corner = 0; corner < 3; ++corner)
        in_range = in_range && triangles.index(triangle, corner) < triangles.position_count;
    if (!in_range) {
      report.first_out_of_range = smaller(report.first_out_of_range, triangle);
    } else {
      const Corners c = corners_of(triangles, triangle);
      if (!all_finite(c)) {
        ++report.non_finite;
        report.first_non_finite = smaller(report.first_non_finite, triangle);
      } else if (has_zero_area(c)) {
        ++report.zero_area;
      } else {
        ++report.valid;
        for (int a = 0; a < 3; ++a) {
          // Adding +0 turns -0 into +0, so that equal coordinates have equal bits.
          const float x = c.p[0][a] + 0.0F;
          const float y = c.p[1][a] + 0.0F;
          const float z = c.p[2][a] + 0.0F;
          box.lo[a] = smaller(x, smaller(y, z));
          box.hi[a] = larger(x, larger(y, z));
        }
        include(report.bounds, box);
      }
    }
    boxes[triangle] = box;
  }
};

/// Boxes that are already made: only their union, for those who call a later stage by itself.
struct IncludeBox {
  const Box* boxes;
  ZKD_HOST_DEVICE void operator()(std::uint32_t triangle, ValidationReport& report) const {
    include(report.bounds, boxes[triangle]);
  }
};

/// A triangle goes into the tree if its box was written as not empty.
struct IsListed {
  const Box* boxes;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t triangle) const { return !boxes[triangle].empty(); }
};

}  // namespace zkd::core
