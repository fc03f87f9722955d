// SPDX-License-Identifier: Apache-2.0
//
// The error band: which wrong answers of a float intersector are excused by rounding, and which
// are errors.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>

#include "verify/oracle.hpp"

namespace zkd::verify {

/// The provisional band, in units of the exact quantity's own scale, until the intersector's bounds
/// are derived.
///
/// - A determinant det(d, p, q): in the band when its magnitude is below
///   determinant_band * permanent, the permanent being the same sum with every product taken
///   absolute.
///   Where the edge functions are taken from corners sheared along the ray, as in the watertight
///   test, the band is less: what the corners' rounding, 16 * 2^-24 of their terms, moves the
///   determinant by. Underflow adds underflow_band * |d| * max |vertex - o|^2, less than anything
///   a float scene can tell apart, and in scenes that are scaled down what that loses. A
///   determinant whose products are all zero is never excused.
/// - t = (a - o) . n / (d . n): known to t_band * max |vertex - o| * |n| / |d . n|, in units of t,
///   and to the smallest float.
///   Two t differ outside the band when their difference is above the larger of their allowances.
inline constexpr double determinant_band = 16.0 * 0x1p-24;
inline constexpr double t_band = 16.0 * 0x1p-24;
inline constexpr double underflow_band = 0x1p-110;

/// One answer held against the oracle.
struct Verdict {
  enum Kind {
    correct,         ///< both miss, or the id is in the tie set
    missed,          ///< the oracle hits, the answer does not
    phantom,         ///< the answer hits, the oracle does not
    wrong_triangle,  ///< both hit, the id is not in the tie set
  };
  Kind kind = correct;
  bool in_band = false;  ///< the error is excused by rounding; false where correct
  double t_ulp = 0.0;    ///< |t - exact t| in float ulps of the exact t; 0 unless a correct hit
};

/// "correct", ... Static storage.
const char* to_string(Verdict::Kind kind) noexcept;

/// Judges `hit`, the answer of a float intersector to `ray`. `triangles` is what the oracle was
/// made from.
[[nodiscard]] Verdict judge(const Oracle& oracle, const TriangleView& triangles, const Ray& ray,
                            const Hit& hit);

}  // namespace zkd::verify
