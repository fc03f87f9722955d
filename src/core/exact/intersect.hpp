// SPDX-License-Identifier: Apache-2.0
//
// Intersector::exact: what a ray hits when nothing is rounded. Signs and distances are decided in
// double where an error bound allows, and in long integers elsewhere. For the host.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/candidate.hpp>
#include <zkd/traversal/intersect.hpp>
#include <zkd/traversal/ray.hpp>
#include <zkd/traversal/triangle.hpp>

#include "core/exact/determinant.hpp"

namespace zkd::core {

/// A hit on one triangle: t = offset / along, a quotient of two determinants.
class ExactCandidate {
 public:
  Real limit = 3.4028234663852886e38F;   ///< not less than t in tree space
  Real begin = -3.4028234663852886e38F;  ///< nor more
  std::uint32_t triangle = no_triangle;

  ExactCandidate() = default;

  /// A triangle that the ray's line crosses.
  ExactCandidate(const Ray& ray, const Corners& corners, std::uint32_t id);

  [[nodiscard]] bool found() const { return triangle != no_triangle; }

  /// Not more and not less than t, in the caller's units.
  [[nodiscard]] double at_least() const { return t_.lo; }
  [[nodiscard]] double at_most() const { return t_.hi; }

  /// Nearer, or as near and of a lower id.
  [[nodiscard]] bool before(const ExactCandidate& other) const;

  /// t_min <= t <= t_max, and t rounds to a float.
  [[nodiscard]] bool within(float t_min, float t_max) const;

  [[nodiscard]] Hit hit() const;

 private:
  [[nodiscard]] Exact along() const;
  [[nodiscard]] ExactQuotient t() const;
  [[nodiscard]] float weight(const FloatPoint& p, const FloatPoint& q) const;

  FloatPoint origin_{};
  FloatPoint direction_{};
  FloatPoint corner_[3]{};
  BoundedDeterminant along_{};
  Bracket t_{};
};

inline Hit to_hit(const ExactCandidate& candidate) { return candidate.hit(); }

inline Real limit_before(const ExactCandidate& candidate) { return candidate.begin; }

class ExactIntersect {
 public:
  using Candidate = ExactCandidate;
  static constexpr float hit_distance = Watertight::hit_distance;
  static constexpr double plane_margin = Watertight::plane_margin;

  ExactIntersect(const PreparedRay& prepared, const Ray& ray) : prepared_(prepared), ray_(ray) {}

  bool operator()(const Corners& corners, std::uint32_t id, Candidate& best) const {
    // The filter is of the ray as it was prepared: from a moved origin that is another one, by a
    // rounding.
    return (prepared_.moved || !surely_misses(prepared_, corners)) && decide(corners, id, best);
  }

 private:
  bool decide(const Corners& corners, std::uint32_t id, Candidate& best) const;
  [[nodiscard]] bool crosses(const Corners& corners) const;
  [[nodiscard]] Wide in_tree_space(double callers_t, double outward) const;

  const PreparedRay& prepared_;
  const Ray& ray_;
};

}  // namespace zkd::core
