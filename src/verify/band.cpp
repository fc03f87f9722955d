// SPDX-License-Identifier: Apache-2.0
//
// Which wrong answers rounding excuses.
//
// The intersector judged is the watertight one (Woop, Benthin, Wald 2013): it moves the origin into
// the ray's, shears the ray onto its longest axis z, takes the signs of the three edge functions of
// the sheared corners exactly, and t from the sheared corners weighted by the edge functions. Its
// answer is thus the exact one for corners that are each moved a little, and that decides what may
// be excused:
//
// - The determinant of an edge (A, B) is d_z * (A_x B_y - A_y B_x) in sheared coordinates
//   A_x = p_x - (d_x / d_z) * p_z, p = a - o. A_x is off by at most 4 * 2^-24 * (|p_x| +
//   |d_x / d_z * p_z|): one rounding of p, three of the product, one of the sum. The determinant
//   moves accordingly, which for a small triangle far away is less by orders of magnitude than
//   2^-24 times the permanent. The band is the smaller of both, with a factor of 16 in each. A
//   scene is brought to coordinates of 2^-16 to 2^32; each of its edge functions is then off by
//   2 * 2^-149 at most where products underflow, 2^-116 of the square of its extent.
// - A triangle that the ray hits by more than the band, at a t certainly between the ray's ends,
//   must have been found: an answer beyond it (or none) is an error.
// - A triangle that the ray misses may be answered only where the point answered, o + t * d, is on
//   the triangle but for those movements: beside the signs, which cannot tell where in its plane a
//   nearly coplanar ray passes, that distance is measured.
#include "verify/band.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "verify/exact.hpp"

namespace zkd::verify {
namespace {

// What a t next to zero is rounded by when it is answered as a float.
constexpr double smallest_float = 0x1p-149;

double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Point& a) { return std::sqrt(dot(a, a)); }

Point point(const glm::vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

// A number and the magnitude below which its sign is excused.
struct Banded {
  double value;
  double band;

  [[nodiscard]] bool excused() const { return std::abs(value) < band; }
};

// What decides about one ray and one triangle.
struct Facts {
  Banded edge[3];      // determinants of the edges: all of one sign inside
  Banded along;        // d . n: zero for a ray in the plane
  double t;            // where the ray meets the plane; NaN for a ray in the plane
  double t_allowance;  // how well a float intersector knows t; infinite for a ray in the plane
  double reach;        // largest |corner - o|
  double lost;         // how far scaling may have moved a sheared coordinate
};

// `lost`: how far scaling may have moved a coordinate, at most.
Facts examine(const Point& o, const Point& d, const Corners& corners, double lost) {
  Facts facts{};
  facts.lost = 4.0 * lost;
  Corners p{};
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = difference(corners[i], o);
    facts.reach = std::max(facts.reach, length(p[i]));
  }

  std::size_t z = 0;
  for (std::size_t axis = 1; axis < 3; ++axis) {
    if (std::abs(d[axis]) > std::abs(d[z])) z = axis;
  }
  const std::size_t x = (z + 1) % 3;
  const std::size_t y = (z + 2) % 3;
  struct Sheared {
    double at[2];     // sheared coordinates
    double moved[2];  // how far the band lets each move
  };
  Sheared sheared[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t across[2] = {x, y};
    for (std::size_t k = 0; k < 2; ++k) {
      const double shift = d[across[k]] / d[z] * p[i][z];
      sheared[i].at[k] = p[i][across[k]] - shift;
      sheared[i].moved[k] = determinant_band * (std::abs(p[i][across[k]]) + std::abs(shift));
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const Sheared& a = sheared[i];
    const Sheared& b = sheared[j];
    const double moved = a.moved[0] * std::abs(b.at[1]) + std::abs(a.at[0]) * b.moved[1] +
                         a.moved[1] * std::abs(b.at[0]) + std::abs(a.at[1]) * b.moved[0] +
                         a.moved[0] * b.moved[1] + a.moved[1] * b.moved[0];
    const Determinant exact = determinant(d, p[i], p[j]);
    const double underflow = underflow_band * std::abs(d[z]) * facts.reach * facts.reach;
    double collapse = facts.lost * facts.lost;
    for (int k = 0; k < 2; ++k) collapse += facts.lost * (std::abs(a.at[k]) + std::abs(b.at[k]));
    const double rounding = std::min(determinant_band * exact.permanent, std::abs(d[z]) * moved);
    // The sign is exact; where the filter cannot tell, the value is far below any band but 0.
    const int sign = determinant_sign(d, o, corners[i], corners[j]);
    facts.edge[i] = {
        sign * std::abs(exact.value),
        exact.permanent == 0.0 ? 0.0 : rounding + underflow + std::abs(d[z]) * collapse};
  }

  const PlaneHit plane = plane_hit(o, d, corners);
  const Determinant along =
      determinant(d, difference(corners[1], corners[0]), difference(corners[2], corners[0]));
  facts.along = {plane.denominator, determinant_band * along.permanent};
  facts.t = plane.t;
  facts.t_allowance =
      (t_band * facts.reach + facts.lost) * plane.normal / std::abs(plane.denominator) +
      smallest_float;
  return facts;
}

// Whether an intersector that errs within the band may overlook a triangle that is exactly hit.
bool may_be_missed(const Facts& facts, const Ray& ray) {
  for (const Banded& edge : facts.edge) {
    if (edge.excused()) return true;
  }
  const auto near = [&](float end) {
    return std::abs(facts.t - static_cast<double>(end)) < facts.t_allowance;
  };
  return facts.along.excused() || near(ray.t_min) || near(ray.t_max);
}

// Distance from q to a closed triangle of non-zero area: to its plane where the foot is inside,
// else to the nearest edge.
double distance(const Point& q, const Corners& corners) {
  const Point ab = difference(corners[1], corners[0]);
  const Point ac = difference(corners[2], corners[0]);
  const Point n = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2],
                   ab[0] * ac[1] - ab[1] * ac[0]};
  double nearest = std::numeric_limits<double>::infinity();
  bool inside = dot(n, n) > 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Point edge = difference(corners[(i + 1) % 3], corners[i]);
    const Point to_q = difference(q, corners[i]);
    inside = inside && determinant(n, edge, to_q).value >= 0.0;
    const double along = std::clamp(dot(to_q, edge) / dot(edge, edge), 0.0, 1.0);
    nearest = std::min(nearest, length({to_q[0] - along * edge[0], to_q[1] - along * edge[1],
                                        to_q[2] - along * edge[2]}));
  }
  if (inside) {
    nearest = std::min(nearest, std::abs(dot(difference(q, corners[0]), n)) / length(n));
  }
  return nearest;
}

// Whether an intersector that errs within the band may answer `hit` on a triangle that the ray
// exactly misses.
bool may_be_invented(const Facts& facts, const Ray& ray, const Hit& hit, const Corners& corners) {
  if (!(hit.t >= ray.t_min && hit.t <= ray.t_max) || !std::isfinite(hit.t)) return false;
  bool left = true;
  bool right = true;
  bool rounded = false;
  for (const Banded& edge : facts.edge) {
    left = left && (edge.value >= 0.0 || edge.excused());
    right = right && (edge.value <= 0.0 || edge.excused());
    rounded = rounded || edge.band > 0.0;
  }
  if (!left && !right) return false;
  // All three exactly zero without a rounding: every intersector sees the coplanar ray.
  if (facts.along.value == 0.0 && !rounded) return false;
  // The point answered, seen from the origin: each corner moved by t_band * reach at most, and t
  // rounded by as much.
  const Point o = point(ray.origin);
  const Point d = point(ray.direction);
  const auto t = static_cast<double>(hit.t);
  const Corners seen = {difference(corners[0], o), difference(corners[1], o),
                        difference(corners[2], o)};
  return distance({t * d[0], t * d[1], t * d[2]}, seen) <=
         2.0 * t_band * facts.reach + facts.lost + smallest_float * length(d);
}

// The float ulp at x.
double float_ulp(double x) {
  int exponent = 0;
  std::frexp(x, &exponent);
  return std::ldexp(1.0, x == 0.0 ? -149 : std::max(exponent - 24, -149));
}

}  // namespace

const char* to_string(Verdict::Kind kind) noexcept {
  switch (kind) {
    case Verdict::correct:
      return "correct";
    case Verdict::missed:
      return "missed";
    case Verdict::phantom:
      return "phantom";
    case Verdict::wrong_triangle:
      return "wrong triangle";
  }
  return "?";
}

Verdict judge(const Oracle& oracle, const TriangleView& triangles, const Ray& ray, const Hit& hit) {
  const ExactHit exact = oracle.closest_hit(ray);
  const bool answered = hit.triangle != no_triangle;
  Verdict verdict;
  if (!exact.hit && !answered) return verdict;
  if (exact.hit && answered &&
      std::binary_search(exact.ties.begin(), exact.ties.end(), hit.triangle)) {
    verdict.t_ulp = std::abs(static_cast<double>(hit.t) - exact.t) / float_ulp(exact.t);
    if (std::isnan(verdict.t_ulp)) verdict.t_ulp = std::numeric_limits<double>::infinity();
    return verdict;
  }
  verdict.kind = !exact.hit  ? Verdict::phantom
                 : !answered ? Verdict::missed
                             : Verdict::wrong_triangle;

  const std::vector<std::uint32_t> hits = oracle.all_hits(ray);
  const Point o = point(ray.origin);
  const Point d = point(ray.direction);
  const auto examined = [&](std::size_t triangle) {
    return examine(o, d, *finite_corners(triangles, triangle), oracle.lost_by_scaling());
  };

  // The triangle answered must be a hit, or an excused one, and not in front of what an exact t
  // allows: `chosen` is its t, `allowance` how well it is known.
  double chosen = std::numeric_limits<double>::infinity();
  double allowance = 0.0;
  if (answered) {
    if (degenerate(ray) || hit.triangle >= triangles.triangle_count ||
        !valid_triangle(triangles, hit.triangle)) {
      return verdict;
    }
    const Facts facts = examined(hit.triangle);
    if (std::binary_search(hits.begin(), hits.end(), hit.triangle)) {
      chosen = facts.t;
      allowance = facts.t_allowance;
    } else {
      const Corners corners = *finite_corners(triangles, hit.triangle);
      if (!may_be_invented(facts, ray, hit, corners)) return verdict;
      // Its plane may be nearly along the ray and say nothing of t: the t answered counts.
      chosen = static_cast<double>(hit.t);
      allowance = smallest_float;
    }
  }

  // Nothing that had to be found may be nearer.
  for (const std::uint32_t other : hits) {
    if (other == hit.triangle) continue;
    const Facts facts = examined(other);
    if (chosen - facts.t <= std::max(allowance, facts.t_allowance)) continue;
    if (!may_be_missed(facts, ray)) return verdict;
  }
  verdict.in_band = true;
  return verdict;
}

}  // namespace zkd::verify
