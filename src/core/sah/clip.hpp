// SPDX-License-Identifier: Apache-2.0
//
// "Perfect splits": the box of what of a triangle lies in a cell (Havran 2000; Wald and Havran
// 2006, section 3.2).
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>

#include "core/frame.hpp"
#include "core/sah/rounding.hpp"

namespace zkd::core::sah {

/// Clips triangles to cells (Sutherland and Hodgman 1974), always the whole triangle, so that
/// errors do not add up from level to level. The box it makes truly holds what lies in the cell,
/// and a triangle that it finds to miss the cell truly misses it:
///
/// Let M be the largest coordinate, w = 2^-53. Beside each corner of the polygon, as computed,
/// think of one that is exact: for a corner of the triangle itself the same, for one cut at a side
/// the point on the exact edge for the same computed parameter s in [0, 1]. Exact corners span a
/// part G of the triangle. A cut adds to the distance e between both, along each axis, the errors
/// of s (3 w, of a difference of at most 2 M), of the product and of the sum: less than 11 w M. So
/// e <= 66 w M after six cuts. The computed corner lies on the side at h itself; what G loses by
/// the cut is spanned by exact corners, all of which lie beyond h - e. With cells made larger by
/// slack = 128 w M > e on all sides, nothing that G loses lies in the cell: G holds all of the
/// triangle that does. Its corners lie within e of the computed ones, and no corner left means that
/// nothing of the triangle lies in the cell.
class Clipper {
 public:
  ZKD_HOST_DEVICE Clipper(const TriangleView& triangles, const SceneFrame& frame)
      : triangles_(triangles), scale_(frame.scale), slack_(0x1p-46 * frame.largest) {}

  /// `box`: a box that holds what of triangle `id` lies in `cell`, within the cell. Makes it
  /// smaller where clipping finds it smaller. False: nothing of the triangle lies in the cell.
  ZKD_HOST_DEVICE bool operator()(std::uint32_t id, const Box& cell, Box& box) const {
    Polygon room[2];
    Polygon* polygon = &room[0];
    Polygon* other = &room[1];
    place(id, *polygon);
    for (int a = 0; a < 3; ++a)
      for (int side = 0; side < 2; ++side) {
        const double h = side == 0 ? static_cast<double>(cell.lo[a]) - slack_
                                   : static_cast<double>(cell.hi[a]) + slack_;
        const double inwards = side == 0 ? 1.0 : -1.0;
        const int lost = count_lost(*polygon, a, h, inwards);
        if (lost == polygon->count) return false;
        if (lost == 0) continue;
        cut(*polygon, a, h, inwards, *other);
        Polygon* const was = polygon;
        polygon = other;
        other = was;
      }
    for (int a = 0; a < 3; ++a) {
      double lo = polygon->corner[0].p[a];
      double hi = lo;
      for (int i = 0; i < polygon->count; ++i) {
        const Corner& corner = polygon->corner[i];
        lo = smaller(lo, corner.is_cut ? corner.p[a] - slack_ : corner.p[a]);
        hi = larger(hi, corner.is_cut ? corner.p[a] + slack_ : corner.p[a]);
      }
      box.lo[a] = larger(box.lo[a], float_below(lo));
      box.hi[a] = smaller(box.hi[a], float_above(hi));
    }
    return !box.empty();
  }

 private:
  struct Corner {
    double p[3];
    bool is_cut;  ///< not a corner of the triangle
  };
  struct Polygon {
    // A cut adds one for each run of corners that it takes away: by rounding there may be several,
    // but at most one of every two corners. 3, 4, 6, 9, 13, 19, 28.
    Corner corner[28];
    int count;
  };

  ZKD_HOST_DEVICE void place(std::uint32_t id, Polygon& polygon) const {
    const Corners corners = corners_of(triangles_, id);
    polygon.count = 3;
    for (int i = 0; i < 3; ++i) {
      polygon.corner[i].is_cut = false;
      for (int a = 0; a < 3; ++a)
        polygon.corner[i].p[a] = static_cast<double>(corners.p[i][a]) * scale_;
    }
  }

  ZKD_HOST_DEVICE static bool is_lost(const Corner& corner, int a, double h, double inwards) {
    return (corner.p[a] - h) * inwards < 0.0;
  }
  ZKD_HOST_DEVICE static int count_lost(const Polygon& polygon, int a, double h, double inwards) {
    int lost = 0;
    for (int i = 0; i < polygon.count; ++i)
      lost += is_lost(polygon.corner[i], a, h, inwards) ? 1 : 0;
    return lost;
  }

  /// What is left of `polygon` on the inner side of h.
  ZKD_HOST_DEVICE static void cut(const Polygon& polygon, int a, double h, double inwards,
                                  Polygon& left) {
    left.count = 0;
    const Corner* from = &polygon.corner[polygon.count - 1];
    bool from_is_lost = is_lost(*from, a, h, inwards);
    for (int i = 0; i < polygon.count; ++i) {
      const Corner* to = &polygon.corner[i];
      const bool to_is_lost = is_lost(*to, a, h, inwards);
      if (from_is_lost != to_is_lost)
        left.corner[left.count++] = from_is_lost ? meet(*to, *from, a, h) : meet(*from, *to, a, h);
      if (!to_is_lost) left.corner[left.count++] = *to;
      from = to;
      from_is_lost = to_is_lost;
    }
  }

  /// Where the edge from a corner that is kept to one that is not meets the side.
  ZKD_HOST_DEVICE static Corner meet(const Corner& kept, const Corner& lost, int a, double h) {
    const double s = (h - kept.p[a]) / (lost.p[a] - kept.p[a]);
    Corner corner;
    for (int b = 0; b < 3; ++b) corner.p[b] = b == a ? h : kept.p[b] + s * (lost.p[b] - kept.p[b]);
    corner.is_cut = true;
    return corner;
  }

  TriangleView triangles_;
  double scale_;
  double slack_;
};

}  // namespace zkd::core::sah
