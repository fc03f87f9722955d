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
// share an edge never both miss a ray through it. Every constant here is derived in
// docs/accuracy.md, from which the names of sections are. For device code and the library: see
// arithmetic.hpp.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/candidate.hpp>
#include <zkd/traversal/ray.hpp>
#include <zkd/traversal/triangle.hpp>

namespace zkd::core {

/// Whether two of three edge functions are of opposite signs: the ray's line passes outside.
template <class T>
ZKD_HOST_DEVICE inline bool opposite(const Rounded<T> (&w)[3]) {
  const Rounded<T> zero = T(0);
  return (w[0] < zero || w[1] < zero || w[2] < zero) && (w[0] > zero || w[1] > zero || w[2] > zero);
}

/// Corners of a triangle relative to a ray, sheared so that the ray runs along z.
template <class T>
struct Sheared {
  Rounded<T> x[3];
  Rounded<T> y[3];
  Rounded<T> depth[3];

  /// The edge functions, by corner opposite: weights of the corners where the ray passes. Their
  /// signs are exact for these x and y, short of underflow.
  ZKD_HOST_DEVICE void weights(Rounded<T> (&w)[3]) const {
    w[0] = difference_of_products(x[2], y[1], y[2], x[1]);
    w[1] = difference_of_products(x[0], y[2], y[0], x[2]);
    w[2] = difference_of_products(x[1], y[0], y[1], x[0]);
  }

  /// Where the line passes, from weights no two of which are opposite, and their sum.
  /// `inverse_depth`: 1 / direction[kz].
  [[nodiscard]] ZKD_HOST_DEVICE Crossing at(const Rounded<T> (&w)[3], Rounded<T> sum,
                                            Rounded<T> inverse_depth) const {
    const Rounded<T> t =
        (w[0] * depth[0] + w[1] * depth[1] + w[2] * depth[2]) * inverse_depth / sum;
    return {static_cast<double>(t.value), static_cast<double>((w[1] / sum).value),
            static_cast<double>((w[2] / sum).value)};
  }

  /// Whether the line passes inside, and where.
  ZKD_HOST_DEVICE bool decide(Rounded<T> inverse_depth, Crossing& crossing) const {
    Rounded<T> w[3];
    weights(w);
    if (opposite(w)) return false;
    const Rounded<T> sum = w[0] + w[1] + w[2];
    if (!(magnitude(sum) > Rounded<T>(T(0)))) return false;
    crossing = at(w, sum, inverse_depth);
    return true;
  }
};

/// Whether the ray's line passes outside the triangle for certain, by single precision ("The
/// filter").
ZKD_HOST_DEVICE inline bool surely_misses(const PreparedRay& ray, const Corners& corners) {
  Sheared<float> sheared;
  Real size_x = 0.0F;
  Real size_y = 0.0F;
  Real across_x = 0.0F;
  Real across_y = 0.0F;
  for (int i = 0; i < 3; ++i) {
    const Real along = ray.from_origin(corners.p[i], 2);
    const Real right = ray.from_origin(corners.p[i], 0);
    const Real up = ray.from_origin(corners.p[i], 1);
    sheared.x[i] = fma(-ray.shear[0], along, right);
    sheared.y[i] = fma(-ray.shear[1], along, up);
    size_x = larger(size_x, magnitude(right) + magnitude(along));
    size_y = larger(size_y, magnitude(up) + magnitude(along));
    across_x = larger(across_x, magnitude(sheared.x[i]));
    across_y = larger(across_y, magnitude(sheared.y[i]));
  }
  Real w[3];
  sheared.weights(w);

  // A sheared coordinate is off by 3 units of its size (5 for a moved origin); 6 leaves room for
  // the products and for the bound's own rounding. Below 2^-96 edge functions lose digits to
  // underflow.
  constexpr float unit = 1.0F / 16777216.0F;
  constexpr float smallest = 1.2621774e-29F;
  const Real error_x = Real(6.0F * unit) * size_x;
  const Real error_y = Real(6.0F * unit) * size_y;
  const Real bound =
      larger(Real(2.0F) * (error_x * (across_y + error_y) + error_y * across_x), Real(smallest));
  const Real least = smaller(w[0], smaller(w[1], w[2]));
  const Real most = larger(w[0], larger(w[1], w[2]));
  return least < -bound && most > bound;
}

/// Whether the ray's line passes inside the triangle, and where, by double precision.
ZKD_HOST_DEVICE inline bool crosses(const PreparedRay& ray, const Corners& corners,
                                    Crossing& crossing) {
  Sheared<double> sheared;
  for (int i = 0; i < 3; ++i) {
    sheared.depth[i] = ray.wide_from_origin(corners.p[i], 2);
    sheared.x[i] = ray.wide_from_origin(corners.p[i], 0) - ray.wide_shear[0] * sheared.depth[i];
    sheared.y[i] = ray.wide_from_origin(corners.p[i], 1) - ray.wide_shear[1] * sheared.depth[i];
  }
  return sheared.decide(ray.wide_shear[2], crossing);
}

// An intersector is a type that is made from a prepared ray and the caller's, and called with the
// corners and the id of a triangle and the best candidate so far, which it replaces by a nearer
// one. `hit_distance` is how far from its triangle a hit may lie along an axis, as a part of the
// reach of the scene from the ray's origin: boxes are padded by it ("Boxes"). `plane_margin` is how
// far off a triangle's plane, in units of its largest coordinate, a ray begins that will not hit it
// ("Spawned rays").

/// Intersector::watertight.
class Watertight {
 public:
  using Candidate = core::Candidate;
  static constexpr float hit_distance = 32.0F * 0x1p-53F;  // 20, and room for roundings
  static constexpr double plane_margin = 0x1p-46;

  ZKD_HOST_DEVICE Watertight(const PreparedRay& ray, const Ray&) : ray_(ray) {}

  ZKD_HOST_DEVICE bool operator()(const Corners& corners, std::uint32_t id, Candidate& best) const {
    Crossing crossing;
    return !surely_misses(ray_, corners) && crosses(ray_, corners, crossing) &&
           accept(ray_, crossing, id, best);
  }

 private:
  const PreparedRay& ray_;
};

/// Intersector::double_precision: what Watertight answers, without its filter.
class DoublePrecision {
 public:
  using Candidate = core::Candidate;
  static constexpr float hit_distance = Watertight::hit_distance;
  static constexpr double plane_margin = Watertight::plane_margin;

  ZKD_HOST_DEVICE DoublePrecision(const PreparedRay& ray, const Ray&) : ray_(ray) {}

  ZKD_HOST_DEVICE bool operator()(const Corners& corners, std::uint32_t id, Candidate& best) const {
    Crossing crossing;
    return crosses(ray_, corners, crossing) && accept(ray_, crossing, id, best);
  }

 private:
  const PreparedRay& ray_;
};

}  // namespace zkd::core
