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

/// Edge functions of the sheared corners, each twice the area opposite a corner, and their sum.
template <class T>
struct Edges {
  T a;
  T b;
  T c;

  [[nodiscard]] ZKD_HOST_DEVICE bool mixed_signs() const {
    const T zero = T(0);
    return (a < zero || b < zero || c < zero) && (a > zero || b > zero || c > zero);
  }
  [[nodiscard]] ZKD_HOST_DEVICE T determinant() const { return a + b + c; }
};

/// Below this, 2^-96, edge functions in single precision lose digits to underflow.
inline constexpr float smallest_edge = 1.2621774e-29F;

/// Replaces `best` by the hit on this triangle, if there is one in the ray's interval and nearer.
/// Returns whether it did.
ZKD_HOST_DEVICE inline bool intersect(const PreparedRay& ray, const Corners& corners,
                                      std::uint32_t id, Candidate& best) {
  Real x[3];
  Real y[3];
  Real depth[3];
  for (int i = 0; i < 3; ++i) {
    // Scaled before the origin is taken off: exact, and the same with and without fma.
    const Real along = ray.from_origin(corners.p[i], 2);
    x[i] = fma(-ray.shear[0], along, ray.from_origin(corners.p[i], 0));
    y[i] = fma(-ray.shear[1], along, ray.from_origin(corners.p[i], 1));
    depth[i] = along;
  }
  const Edges<Real> edges{difference_of_products(x[2], y[1], y[2], x[1]),
                          difference_of_products(x[0], y[2], y[0], x[2]),
                          difference_of_products(x[1], y[0], y[1], x[0])};
  Real t;
  Real u;
  Real v;
  const float largest =
      larger(magnitude(edges.a.value), larger(magnitude(edges.b.value), magnitude(edges.c.value)));
  if (!(largest < smallest_edge)) {
    if (edges.mixed_signs()) return false;
    const Real determinant = edges.determinant();
    if (determinant == Real(0.0F)) return false;
    t = fma(edges.a, depth[0], fma(edges.b, depth[1], edges.c * depth[2])) * ray.shear[2] /
        determinant;
    u = edges.b / determinant;
    v = edges.c / determinant;
  } else {
    // Products of floats are exact in double, so signs are again.
    const Wide wx[3] = {x[0].value, x[1].value, x[2].value};
    const Wide wy[3] = {y[0].value, y[1].value, y[2].value};
    const Edges<Wide> wide{wx[2] * wy[1] - wy[2] * wx[1], wx[0] * wy[2] - wy[0] * wx[2],
                           wx[1] * wy[0] - wy[1] * wx[0]};
    if (wide.mixed_signs()) return false;
    const Wide determinant = wide.determinant();
    if (!(determinant < Wide(0.0)) && !(determinant > Wide(0.0))) return false;
    const Wide sum = wide.a * Wide(depth[0].value) + wide.b * Wide(depth[1].value) +
                     wide.c * Wide(depth[2].value);
    t = static_cast<float>((sum * Wide(ray.shear[2].value) / determinant).value);
    u = static_cast<float>((wide.b / determinant).value);
    v = static_cast<float>((wide.c / determinant).value);
  }
  // Written so that NaN, from coordinates that are not finite, is never accepted.
  if (!(t <= best.t)) return false;
  if (t == best.t && !(id < best.triangle)) return false;
  const float callers_t = ray.callers_t(t);
  if (!(ray.t_min <= callers_t && callers_t <= ray.t_max) || !is_finite(callers_t)) return false;
  // Adding +0 turns -0 into +0.
  best = {t, callers_t, (u + Real(0.0F)).value, (v + Real(0.0F)).value, id};
  return true;
}

}  // namespace zkd::core
