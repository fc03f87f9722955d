// SPDX-License-Identifier: Apache-2.0
//
// What of a triangle lies in a cell: a convex polygon, cut plane by plane (Sutherland and Hodgman
// 1974), and the box about it.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>
#include <zkd/tree.hpp>

#include "core/lanes.hpp"

namespace zkd::core {

/// By how much cells are larger here than they are, of the largest coordinate of the scene, so that
/// nothing that truly lies in a cell is lost by rounding:
///
/// Let M be the largest coordinate, w = 2^-53. Beside each corner of the polygon, as computed,
/// think of one that is exact: for a corner of the triangle itself the same, for one cut at a plane
/// h the point between the exact corners for the same computed parameter s in [0, 1]. Exact corners
/// span a part G of the triangle. A cut adds to the distance e between both, along each axis, the
/// errors of s (3 w, of a difference of at most 2 M), of the product and of the sum: less than
/// 11 w M. There is at most a cut a level, and six more where a walk takes a cell up again:
/// e < 102 * 11 w M < 2^-42 M. The computed corner lies on the plane itself; what G loses by the
/// cut is spanned by exact corners, all of which lie beyond h - e. With planes moved outwards by
/// slack > e, nothing that G loses lies in the cell: G holds all of the triangle that does. Its
/// corners lie within e of the computed ones, so a polygon that keeps away from a plane by more
/// than the slack says that the triangle in this cell does not reach it.
inline constexpr double cell_slack = 0x1p-42;

static_assert((max_depth + 6) * 11 < 2048, "slack is more than what cuts add up to");

/// A polygon in tree space. Of what its points are is part of its name: device code has others.
template <class Lanes>
struct PolygonOf {
  /// Nine are what a triangle and six planes make. Rounding can bend a polygon inwards, so that it
  /// gets more; one that would become too long is cut no more.
  static constexpr std::uint32_t most_corners = 12;

  Lanes corner[most_corners];
  Lanes lo;
  Lanes hi;
  std::uint32_t corners;

  ZKD_HOST_DEVICE void place(const Corners& triangle, double scale) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      for (std::uint32_t a = 0; a < 3; ++a)
        corner[i][a] = static_cast<double>(triangle.p[i][a]) * scale;
      corner[i][3] = 0.0;
    }
    lo = hi = corner[0];
    for (std::uint32_t i = 1; i < 3; ++i) {
      keep_least(lo, corner[i]);
      keep_most(hi, corner[i]);
    }
    corners = 3;
  }

  /// What of `from` lies below h along axis a (`sign` 1) or above it (-1). A corner of it must.
  ZKD_HOST_DEVICE void cut(const PolygonOf& from, std::uint32_t a, double h, double sign) {
    const std::uint32_t n = from.corners;
    std::uint64_t lost = 0;
    for (std::uint32_t i = 0; i < n; ++i)
      lost |= static_cast<std::uint64_t>((from.corner[i][a] - h) * sign > 0.0 ? 1 : 0) << i;
    // Corners that are lost follow one another, but for rounding: then none is taken away, and more
    // is kept than need be.
    const std::uint64_t kept = ~lost & ((std::uint64_t{1} << n) - 1);
    const std::uint64_t begins = kept & (lost << 1 | lost >> (n - 1));  // after one that is lost
    const std::uint64_t ends = kept & (lost >> 1 | lost << (n - 1));
    if (lost == 0 || (begins & (begins - 1)) != 0) {
      copy(from);
      return;
    }
    const std::uint32_t first = bit(begins);
    const std::uint32_t last = bit(ends);
    const std::uint32_t run = first <= last ? last - first + 1 : last + n - first + 1;
    if (run + 2 > most_corners) {
      copy(from);
      return;
    }
    Lanes end;
    meet(from.corner[first], from.corner[first == 0 ? n - 1 : first - 1], a, h, corner[0]);
    meet(from.corner[last], from.corner[last + 1 == n ? 0 : last + 1], a, h, end);
    Lanes least = corner[0];
    Lanes most = corner[0];
    keep_least(least, end);
    keep_most(most, end);
    std::uint32_t at = first;
    for (std::uint32_t i = 1; i <= run; ++i) {
      const Lanes point = from.corner[at];
      corner[i] = point;
      keep_least(least, point);
      keep_most(most, point);
      at = at + 1 == n ? 0 : at + 1;
    }
    corner[run + 1] = end;
    lo = least;
    hi = most;
    corners = run + 2;
  }

 private:
  ZKD_HOST_DEVICE static std::uint32_t bit(std::uint64_t only) { return 63 - leading_zeros(only); }

  /// Where the edge from a corner that is kept to one that is not meets the plane.
  ZKD_HOST_DEVICE static void meet(const Lanes& kept, const Lanes& gone, std::uint32_t axis,
                                   double h, Lanes& at) {
    const double s = (h - kept[axis]) / (gone[axis] - kept[axis]);
    at = kept + s * (gone - kept);
    at[axis] = h;
  }
  ZKD_HOST_DEVICE void copy(const PolygonOf& from) {
    corners = from.corners;
    for (std::uint32_t i = 0; i < corners; ++i) corner[i] = from.corner[i];
    lo = from.lo;
    hi = from.hi;
  }
};

using Polygon = PolygonOf<Lanes>;

/// The box of what of a triangle lies in a cell, `cell` being the part of it inside the triangle's
/// box. Rounded outwards: 2^-23 of a number is more than its rounding to a float takes back, and of
/// the slack enough is left for the polygon's own error.
ZKD_HOST_DEVICE inline Box box_inside(const Polygon& polygon, const Box& cell, double slack) {
  Box box;
  for (int a = 0; a < 3; ++a) {
    const double lo = polygon.lo[a] - slack - 0x1p-23 * magnitude(polygon.lo[a]);
    const double hi = polygon.hi[a] + slack + 0x1p-23 * magnitude(polygon.hi[a]);
    box.lo[a] = larger(cell.lo[a], static_cast<float>(lo) + 0.0F);
    box.hi[a] = smaller(cell.hi[a], static_cast<float>(hi) + 0.0F);
  }
  return box;
}

}  // namespace zkd::core
