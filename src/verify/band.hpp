// SPDX-License-Identifier: Apache-2.0
//
// The error band: which wrong answers of an intersector its published bounds excuse, and which are
// errors.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/query.hpp>

#include "verify/oracle.hpp"

namespace zkd::verify {

/// What an intersector promises, as docs/accuracy.md derives it. p is a corner less the origin of
/// the ray (an origin far outside the scene is brought near it first), z the axis along which the
/// direction is longest, s = d_x / d_z; x stands for y too.
///
/// - A sheared coordinate p_x - s p_z is off by unit * (corner * |p_x| + sheared * |s p_z|) at
/// most:
///   hit and miss are those of a triangle whose corners are moved so far.
/// - A hit lies within unit * hit * max |p| of its triangle, along each axis.
/// - t is that of the moved triangle to unit * t * max |p_z / d_z|.
/// - The point that u and v name lies within unit * point * max |p| of the ray's, along each axis.
///
/// `fast` moves no corners: its signs are off by unit * product times the terms they are summed
/// from, or, where it asks double precision, are those of that one's moved corners. Its t is what
/// the distance to the triangle leaves.
struct Bounds {
  double unit;
  double corner = 0.0;
  double sheared = 0.0;
  double hit;
  double t = 0.0;
  double point;
  double product = 0.0;
};

/// All zero for Intersector::exact.
[[nodiscard]] Bounds bounds_of(Intersector intersector) noexcept;

/// What zkd/query.hpp states of |t - exact t| |d|, before t is rounded to a float: for
/// `condition`, k there, and `reach`, R.
[[nodiscard]] double stated_t_bound(Intersector intersector, double condition,
                                    double reach) noexcept;

/// One answer held against the oracle.
struct Verdict {
  enum Kind {
    correct,         ///< both miss, or the id is in the tie set
    missed,          ///< the oracle hits, the answer does not
    phantom,         ///< the answer hits, the oracle does not
    wrong_triangle,  ///< both hit, the id is not in the tie set
  };
  Kind kind = correct;
  bool in_band = false;    ///< the error is excused by rounding; false where correct
  double t_ulp = 0.0;      ///< |t - exact t| in float ulps of the exact t; 0 unless a correct hit
  bool t_in_bound = true;  ///< t is as near to the exact one as the intersector promises; true
                           ///< unless a correct hit
  bool point_in_bound = true;  ///< so is the point that u and v name to the ray's at t; likewise

  [[nodiscard]] bool in_bound() const { return t_in_bound && point_in_bound; }
};

/// "correct", ... Static storage.
const char* to_string(Verdict::Kind kind) noexcept;

/// R of zkd/query.hpp, for a triangle of the oracle.
[[nodiscard]] double stated_reach(const Oracle& oracle, const Ray& ray, const Corners& corners);

/// Verdict::point_in_bound, of a hit on a valid triangle.
[[nodiscard]] bool point_in_bound(const Oracle& oracle, const TriangleView& triangles,
                                  const Ray& ray, const Hit& hit, Intersector intersector);

/// Judges `hit`, what `intersector` answered to `ray`. `triangles` is what the oracle was made
/// from.
[[nodiscard]] Verdict judge(const Oracle& oracle, const TriangleView& triangles, const Ray& ray,
                            const Hit& hit, Intersector intersector = Intersector::watertight);

}  // namespace zkd::verify
