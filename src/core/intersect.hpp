// SPDX-License-Identifier: Apache-2.0
//
// Ray against triangle, watertight: Woop, Benthin, Wald, Watertight Ray/Triangle Intersection, JCGT
// 2013, with Kahan's difference of products for the edge functions. Their signs are then exact for
// the sheared coordinates, so two triangles that share an edge never both miss a ray through it.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>

#include "core/arithmetic.hpp"
#include "core/ray.hpp"
#include "core/validate.hpp"

namespace zkd::core {

/// A hit in tree space. Nearer is a smaller t; of equal ones, the lower id.
struct Candidate {
  Real t = 3.4028234663852886e38F;
  float callers_t = 0.0F;
  float u = 0.0F;
  float v = 0.0F;
  std::uint32_t triangle = no_triangle;

  [[nodiscard]] ZKD_HOST_DEVICE bool found() const { return triangle != no_triangle; }
};

/// Replaces `best` by the hit on this triangle, if there is one in the ray's interval and nearer.
/// Returns whether it did.
ZKD_HOST_DEVICE inline bool intersect(const PreparedRay& ray, const Corners& corners,
                                      std::uint32_t id, Candidate& best) {
  Real x[3];
  Real y[3];
  Real depth[3];
  for (int i = 0; i < 3; ++i) {
    // Scaled before the origin is taken off: exact, and the same with and without fma.
    const Real along = Real(corners.p[i][ray.k[2]]) * ray.scale - ray.sheared_origin[2];
    x[i] =
        fma(-ray.shear[0], along, Real(corners.p[i][ray.k[0]]) * ray.scale - ray.sheared_origin[0]);
    y[i] =
        fma(-ray.shear[1], along, Real(corners.p[i][ray.k[1]]) * ray.scale - ray.sheared_origin[1]);
    depth[i] = along;
  }
  const Real zero = 0.0F;
  const Real edge_a = difference_of_products(x[2], y[1], y[2], x[1]);
  const Real edge_b = difference_of_products(x[0], y[2], y[0], x[2]);
  const Real edge_c = difference_of_products(x[1], y[0], y[1], x[0]);
  const bool any_negative = edge_a < zero || edge_b < zero || edge_c < zero;
  const bool any_positive = edge_a > zero || edge_b > zero || edge_c > zero;
  if (any_negative && any_positive) return false;
  const Real determinant = edge_a + edge_b + edge_c;
  if (determinant == zero) return false;

  const Real scaled_t =
      fma(edge_a, depth[0], fma(edge_b, depth[1], edge_c * depth[2])) * ray.shear[2];
  const Real t = scaled_t / determinant;
  // Written so that NaN, from coordinates that are not finite, is never accepted.
  if (!(t <= best.t)) return false;
  if (t == best.t && !(id < best.triangle)) return false;
  const float callers_t = ray.callers_t(t);
  if (!(ray.t_min <= callers_t && callers_t <= ray.t_max) || !is_finite(callers_t)) return false;
  best.t = t;
  best.callers_t = callers_t;
  best.u = (edge_b / determinant).value;
  best.v = (edge_c / determinant).value;
  best.triangle = id;
  return true;
}

}  // namespace zkd::core
