// SPDX-License-Identifier: Apache-2.0
//
// What an intersector finds, and which of two finds is kept. For device code and the library: see
// arithmetic.hpp.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/ray.hpp>

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

  /// Nearer, or as near and of a lower id. Any hit comes before none.
  [[nodiscard]] ZKD_HOST_DEVICE bool before(const Candidate& other) const {
    return t < other.t || (t == other.t && triangle < other.triangle);
  }
};

/// Where a ray's line meets a triangle: t in tree space, and u, v as in Hit.
struct Crossing {
  Wide t;
  Wide u;
  Wide v;
};

/// What lies behind a hit at t for certain: t moved by more than rounding it to float took, and
/// rounding where the ray enters a box.
ZKD_HOST_DEVICE inline Real limit_behind(Wide t) {
  constexpr float slack = 1.0F / 2097152.0F;  // 2^-21
  const Real rounded = static_cast<float>(t.value);
  return rounded + Real(slack) * magnitude(rounded) + Real(1.0e-37F);
}

/// What lies before a hit for certain, likewise: a box that ends there holds no hit behind it.
ZKD_HOST_DEVICE inline Real limit_before(Wide t) { return -limit_behind(-t); }
ZKD_HOST_DEVICE inline Real limit_before(const Candidate& hit) { return limit_before(hit.t); }

/// A barycentric coordinate as it is answered: never -0.
ZKD_HOST_DEVICE inline float as_coordinate(Wide x) {
  return (Real(static_cast<float>(x.value)) + Real(0.0F)).value;
}

/// Replaces `best` by this crossing if it lies in the ray's interval and is nearer. Returns whether
/// it did.
ZKD_HOST_DEVICE inline bool accept(const PreparedRay& ray, const Crossing& crossing,
                                   std::uint32_t id, Candidate& best) {
  // Written so that NaN, from coordinates that are not finite, is never accepted.
  if (!(crossing.t <= best.t)) return false;
  if (crossing.t == best.t && !(id < best.triangle)) return false;
  const Wide unrounded = ray.callers_t(crossing.t);
  const auto callers_t = static_cast<float>(unrounded.value);
  if (!(ray.t_min <= callers_t && callers_t <= ray.t_max) || !is_finite(callers_t)) return false;
  // Behind the origin, though by less than a float can say.
  if (unrounded < Wide(0.0) && !(ray.t_min < 0.0F)) return false;
  best = {crossing.t,
          limit_behind(crossing.t),
          callers_t,
          as_coordinate(crossing.u),
          as_coordinate(crossing.v),
          id};
  return true;
}

ZKD_HOST_DEVICE inline Hit to_hit(const Candidate& candidate) {
  if (!candidate.found()) return {};
  return {candidate.callers_t, candidate.u, candidate.v, candidate.triangle};
}

}  // namespace zkd::core
