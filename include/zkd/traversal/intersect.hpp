// SPDX-License-Identifier: Apache-2.0
//
// Ray against triangle, watertight: Woop, Benthin, Wald, Watertight Ray/Triangle Intersection, JCGT
// 2013, in two precisions. Single precision rejects most triangles; what it cannot reject for
// certain is decided, and its t, u and v computed, in double.
//
// Corners are sheared along the ray; the signs of the edge functions of the sheared corners say
// whether the ray passes inside. Where two of them differ in sign by more than an error bound, the
// corners sheared in double differ as well; else those are looked at, by Kahan's difference of
// products, whose sign is exact. So all signs belong to one set of points, and two triangles that
// share an edge never both miss a ray through it. For device code and the library: see
// arithmetic.hpp.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/ray.hpp>
#include <zkd/traversal/triangle.hpp>

namespace zkd::core {

/// A hit in tree space. Nearer is a smaller t; of equal ones, the lower id.
struct Candidate {
  Wide t = 3.4028234663852886e38;  ///< no hit in tree space is further
  Real limit =
      3.4028234663852886e38F;  ///< not less than t: a box that begins behind it is of no use
  float callers_t = 0.0F;
  float u = 0.0F;
  float v = 0.0F;
  std::uint32_t triangle = no_triangle;

  [[nodiscard]] ZKD_HOST_DEVICE bool found() const { return triangle != no_triangle; }
};

/// Whether the ray's line passes outside the triangle for certain, by single precision.
ZKD_HOST_DEVICE inline bool surely_misses(const PreparedRay& ray, const Corners& corners) {
  Real x[3];
  Real y[3];
  Real size_x = 0.0F;
  Real size_y = 0.0F;
  Real across_x = 0.0F;
  Real across_y = 0.0F;
  for (int i = 0; i < 3; ++i) {
    const Real along = ray.from_origin(corners.p[i], 2);
    const Real right = ray.from_origin(corners.p[i], 0);
    const Real up = ray.from_origin(corners.p[i], 1);
    x[i] = fma(-ray.shear[0], along, right);
    y[i] = fma(-ray.shear[1], along, up);
    size_x = larger(size_x, magnitude(right) + magnitude(along));
    size_y = larger(size_y, magnitude(up) + magnitude(along));
    across_x = larger(across_x, magnitude(x[i]));
    across_y = larger(across_y, magnitude(y[i]));
  }
  const Real a = difference_of_products(x[2], y[1], y[2], x[1]);
  const Real b = difference_of_products(x[0], y[2], y[0], x[2]);
  const Real c = difference_of_products(x[1], y[0], y[1], x[0]);

  // Subtraction, the slope and the shear round a sheared coordinate by 3 * 2^-24 of its size at
  // most (5 for a moved origin); 6 leaves room for the products and for the bound's own rounding.
  // Below 2^-96 edge functions lose digits to underflow.
  constexpr float unit = 1.0F / 16777216.0F;
  constexpr float smallest = 1.2621774e-29F;
  const Real error_x = Real(6.0F * unit) * size_x;
  const Real error_y = Real(6.0F * unit) * size_y;
  const Real bound =
      larger(Real(2.0F) * (error_x * (across_y + error_y) + error_y * across_x), Real(smallest));
  const Real least = smaller(a, smaller(b, c));
  const Real most = larger(a, larger(b, c));
  return least < -bound && most > bound;
}

/// Where a ray's line meets a triangle: t in tree space, and u, v as in Hit.
struct Crossing {
  Wide t;
  Wide u;
  Wide v;
};

/// Whether the ray's line passes inside the triangle, and where.
ZKD_HOST_DEVICE inline bool crosses(const PreparedRay& ray, const Corners& corners,
                                    Crossing& crossing) {
  Wide x[3];
  Wide y[3];
  Wide depth[3];
  for (int i = 0; i < 3; ++i) {
    depth[i] = ray.wide_from_origin(corners.p[i], 2);
    x[i] = ray.wide_from_origin(corners.p[i], 0) - ray.wide_shear[0] * depth[i];
    y[i] = ray.wide_from_origin(corners.p[i], 1) - ray.wide_shear[1] * depth[i];
  }
  const Wide a = difference_of_products(x[2], y[1], y[2], x[1]);
  const Wide b = difference_of_products(x[0], y[2], y[0], x[2]);
  const Wide c = difference_of_products(x[1], y[0], y[1], x[0]);
  const Wide zero = 0.0;
  if ((a < zero || b < zero || c < zero) && (a > zero || b > zero || c > zero)) return false;
  const Wide determinant = a + b + c;
  if (!(determinant < zero) && !(determinant > zero)) return false;
  crossing = {(a * depth[0] + b * depth[1] + c * depth[2]) * ray.wide_shear[2] / determinant,
              b / determinant, c / determinant};
  return true;
}

/// Replaces `best` by the hit on this triangle, if there is one in the ray's interval and nearer.
/// Returns whether it did.
ZKD_HOST_DEVICE inline bool intersect(const PreparedRay& ray, const Corners& corners,
                                      std::uint32_t id, Candidate& best) {
  if (surely_misses(ray, corners)) return false;
  Crossing crossing;
  if (!crosses(ray, corners, crossing)) return false;
  // Written so that NaN, from coordinates that are not finite, is never accepted.
  if (!(crossing.t <= best.t)) return false;
  if (crossing.t == best.t && !(id < best.triangle)) return false;
  const float callers_t = ray.callers_t(crossing.t);
  if (!(ray.t_min <= callers_t && callers_t <= ray.t_max) || !is_finite(callers_t)) return false;

  constexpr float slack = 1.0F / 4194304.0F;  // 2^-22, more than rounding t to float takes
  const Real t = static_cast<float>(crossing.t.value);
  const Real limit = t + Real(slack) * magnitude(t) + Real(1.0e-37F);
  const Real zero = 0.0F;  // adding +0 turns -0 into +0
  const Real u = Real(static_cast<float>(crossing.u.value)) + zero;
  const Real v = Real(static_cast<float>(crossing.v.value)) + zero;
  best = {crossing.t, limit, callers_t, u.value, v.value, id};
  return true;
}

}  // namespace zkd::core
