// SPDX-License-Identifier: Apache-2.0
//
// Ray against triangle in single precision: the intersectors that most renderers use. The constants
// are derived in docs/accuracy.md. For device code and the library: see arithmetic.hpp.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/candidate.hpp>
#include <zkd/traversal/intersect.hpp>
#include <zkd/traversal/ray.hpp>
#include <zkd/traversal/triangle.hpp>

namespace zkd::core {

/// Sums of products below this, or t divided by them, may lose digits to underflow: double
/// precision is asked. A sum is at most 24 times the square of the reach, so that here the reach is
/// above 2^-43, and what t loses, four times 2^-150 over the sum, below 2^-25 of that.
inline constexpr float smallest_sum = 8.2718061e-25F;  // 2^-80

/// Intersector::single_precision: Woop, Benthin, Wald 2013, with Kahan's difference of products in
/// the place of their fallback to double; that decides, for the same points, where single precision
/// underflows.
class SinglePrecision {
 public:
  using Candidate = core::Candidate;
  static constexpr float hit_distance = 26.0F * 0x1p-24F;  // 24, and room for roundings
  static constexpr double plane_margin = 0x1p-16;

  ZKD_HOST_DEVICE SinglePrecision(const PreparedRay& ray, const Ray&) : ray_(ray) {}

  ZKD_HOST_DEVICE bool operator()(const Corners& corners, std::uint32_t id, Candidate& best) const {
    Sheared<float> sheared;
    for (int i = 0; i < 3; ++i) {
      sheared.depth[i] = ray_.from_origin(corners.p[i], 2);
      sheared.x[i] = fma(-ray_.shear[0], sheared.depth[i], ray_.from_origin(corners.p[i], 0));
      sheared.y[i] = fma(-ray_.shear[1], sheared.depth[i], ray_.from_origin(corners.p[i], 1));
    }
    Real w[3];
    sheared.weights(w);
    if (opposite(w)) return false;
    const Real sum = w[0] + w[1] + w[2];
    Crossing crossing;
    if (magnitude(sum) > Real(smallest_sum))
      crossing = sheared.at(w, sum, ray_.shear[2]);
    else if (!decide_in_double(sheared, crossing))
      return false;
    return accept(ray_, crossing, id, best);
  }

 private:
  /// For the same points, which a neighbour has that is large enough: their products are exact in
  /// double.
  ZKD_HOST_DEVICE bool decide_in_double(const Sheared<float>& single, Crossing& crossing) const {
    Sheared<double> sheared;
    for (int i = 0; i < 3; ++i) {
      sheared.x[i] = static_cast<double>(single.x[i].value);
      sheared.y[i] = static_cast<double>(single.y[i].value);
      sheared.depth[i] = static_cast<double>(single.depth[i].value);
    }
    return sheared.decide(ray_.wide_shear[2], crossing);
  }

  const PreparedRay& ray_;
};

/// Intersector::fast: Moeller, Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, JGT 1997,
/// along the sheared ray. Where the point it finds on the ray is not the one it finds on the
/// triangle (seen edge-on, rounding puts t far outside), and where products underflow, double
/// precision is asked.
class Fast {
 public:
  using Candidate = core::Candidate;
  static constexpr float hit_distance = 34.0F * 0x1p-24F;  // 32, and room for roundings
  static constexpr double plane_margin = 0x1p-16;

  ZKD_HOST_DEVICE Fast(const PreparedRay& ray, const Ray&) : ray_(ray) {}

  ZKD_HOST_DEVICE bool operator()(const Corners& corners, std::uint32_t id, Candidate& best) const {
    Crossing crossing;
    if (!decide(corners, crossing)) return false;
    return accept(ray_, crossing, id, best);
  }

 private:
  ZKD_HOST_DEVICE bool decide(const Corners& corners, Crossing& crossing) const {
    // In the order kx, ky, kz, with a direction of (shear[0], shear[1], 1).
    Real to_a[3];
    Real ab[3];
    Real ac[3];
    for (int i = 0; i < 3; ++i) {
      to_a[i] = ray_.from_origin(corners.p[0], i);
      ab[i] = ray_.along_edge(corners.p[0], corners.p[1], i);
      ac[i] = ray_.along_edge(corners.p[0], corners.p[2], i);
    }
    // P = d x ac, Q = ab x (a - o): the determinant is ab . P.
    const Real p[3] = {ray_.shear[1] * ac[2] - ac[1], ac[0] - ray_.shear[0] * ac[2],
                       ray_.shear[0] * ac[1] - ray_.shear[1] * ac[0]};
    const Real determinant = ab[0] * p[0] + ab[1] * p[1] + ab[2] * p[2];
    if (!(magnitude(determinant) > Real(smallest_sum))) return crosses(ray_, corners, crossing);
    const Real zero = 0.0F;
    const Real one = 1.0F;
    const Real inverse = one / determinant;
    const Real u = -(to_a[0] * p[0] + to_a[1] * p[1] + to_a[2] * p[2]) * inverse;
    if (!(u >= zero && u <= one)) return false;
    const Real q[3] = {ab[1] * to_a[2] - ab[2] * to_a[1], ab[2] * to_a[0] - ab[0] * to_a[2],
                       ab[0] * to_a[1] - ab[1] * to_a[0]};
    const Real v = (ray_.shear[0] * q[0] + ray_.shear[1] * q[1] + q[2]) * inverse;
    if (!(v >= zero && u + v <= one)) return false;
    const Real depth = (ac[0] * q[0] + ac[1] * q[1] + ac[2] * q[2]) * inverse;

    constexpr float unit = 1.0F / 16777216.0F;
    const Real on_ray[3] = {ray_.shear[0] * depth, ray_.shear[1] * depth, depth};
    Real furthest = zero;
    Real apart = zero;
    for (int i = 0; i < 3; ++i) {
      furthest = larger(furthest, larger(magnitude(to_a[i]), larger(magnitude(to_a[i] + ab[i]),
                                                                    magnitude(to_a[i] + ac[i]))));
      apart = larger(apart, magnitude(to_a[i] + u * ab[i] + v * ac[i] - on_ray[i]));
    }
    if (!(apart <= Real(16.0F * unit) * furthest)) return crosses(ray_, corners, crossing);
    crossing = {static_cast<double>((depth * ray_.shear[2]).value), static_cast<double>(u.value),
                static_cast<double>(v.value)};
    return true;
  }

  const PreparedRay& ray_;
};

}  // namespace zkd::core
