// SPDX-License-Identifier: Apache-2.0
//
// Which wrong answers rounding excuses. An intersector's answer is the exact one for corners that
// are each moved a little (docs/accuracy.md), and that decides what may be excused:
//
// - The determinant of an edge (A, B) is d_z * (A_x B_y - A_y B_x) in sheared coordinates. Moving
//   the corners by what the intersector promises moves the determinant accordingly, which for a
//   small triangle far away is less by orders of magnitude than a unit of its terms. An edge whose
//   exact determinant is not larger may be taken for its opposite side.
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

#include <gmpxx.h>

#include "verify/exact.hpp"

namespace zkd::verify {
namespace {

// Distances are compared with bounds near the last bit of a double, so they are taken of numbers
// that have more bits where the machine has them.
using Long = long double;
using LongPoint = std::array<Long, 3>;

// What a t next to zero is rounded by when it is answered as a float.
constexpr double smallest_float = 0x1p-149;

// What a product loses to underflow in single precision, with all that an edge function is summed
// from: a few times half the smallest float.
constexpr double lost_product = 0x1p-146;

// An origin this many times the largest coordinate away is brought near the scene first.
constexpr double far_origin = 8.0;

Long dot(const LongPoint& a, const LongPoint& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Long length(const LongPoint& a) { return std::sqrt(dot(a, a)); }
LongPoint difference(const LongPoint& a, const LongPoint& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

Point point(const glm::vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

// Whether a ray from there is moved first.
bool is_far(const Oracle& oracle, const Point& o) {
  double away = 0.0;
  for (std::size_t a = 0; a < 3; ++a)
    away = std::max({away, oracle.box().lo[a] - o[a], o[a] - oracle.box().hi[a]});
  return away > far_origin * oracle.largest_coordinate();
}

// TreeView::scale of a scene whose largest coordinate that is.
double tree_scale(double largest) {
  if (largest == 0.0 || (largest >= 0x1p-16 && largest < 0x1p32)) return 1.0;
  return std::ldexp(1.0, std::clamp(-std::ilogb(largest), -126, 127));
}

// The float ulp at x.
double float_ulp(double x) {
  int exponent = 0;
  std::frexp(x, &exponent);
  return std::ldexp(1.0, x == 0.0 ? -149 : std::max(exponent - 24, -149));
}

// Enough digits that an origin at the largest float, moved next to a scene of denormal size, is
// exact to a double and more.
mpf_class many_digits(double x) { return mpf_class(x, 768); }

// To the digits of a Long: two doubles.
Long rounded(const mpf_class& x) {
  const double most = x.get_d();
  const mpf_class rest = x - most;
  return Long{most} + Long{rest.get_d()};
}

// A number and the magnitude below which its sign is excused.
struct Banded {
  double value;
  double band;

  [[nodiscard]] bool excused() const { return std::abs(value) < band; }
};

// A ray and what is known of the scene it is shot at.
struct Judged {
  Judged(const Oracle& oracle, const Ray& caller, Intersector intersector)
      : ray(caller),
        bounds(bounds_of(intersector)),
        least(1.0 / tree_scale(oracle.largest_coordinate())),
        o(point(caller.origin)),
        d(point(caller.direction)),
        lost(bounds.unit == 0.0 ? 0.0 : 4.0 * oracle.lost_by_scaling()) {
    for (std::size_t a = 0; a < 3; ++a)
      if (std::abs(d[a]) > std::abs(d[z])) z = a;
    if (is_far(oracle, o)) {
      mpf_class projected = many_digits(0.0);
      mpf_class squared = many_digits(0.0);
      for (std::size_t a = 0; a < 3; ++a) {
        const double centre = 0.5 * oracle.box().lo[a] + 0.5 * oracle.box().hi[a];
        projected += (many_digits(centre) - o[a]) * d[a];
        squared += many_digits(d[a]) * d[a];
      }
      shift = projected / squared;
      // The moved origin is rounded to a double, at most 16 times the largest coordinate out.
      if (bounds.unit != 0.0) lost += 2.0 * 16.0 * 0x1p-53 * oracle.largest_coordinate();
    }
  }

  // Coordinate `axis` of a point from the moved origin, to the last digit of a Long.
  [[nodiscard]] Long from_origin(double x, std::size_t axis) const {
    if (!shift) return Long{x} - Long{o[axis]};
    return rounded(many_digits(x) - o[axis] - *shift * d[axis]);
  }

  // What t gained where the origin was moved: roundings of the shift, and of its sum with t.
  [[nodiscard]] double lost_by_shift(double t) const { return shift ? 0x1p-51 * std::abs(t) : 0.0; }

  // How far s lies from the moved origin along the ray.
  [[nodiscard]] Long from_origin_along(double s) const {
    return shift ? rounded(many_digits(s) - *shift) : Long{s};
  }

  // What single precision loses of an edge function to underflow: a product of coordinates each
  // of which is off by `least` times the smallest float, and a shear by that as well.
  [[nodiscard]] double underflow(double a, double b) const {
    if (bounds.unit < 0x1p-50) return 0.0;
    return lost_product * (a * b + (a + b) * least + least * least);
  }

  // How far from its triangle a hit may lie: a bound along each axis is one of sqrt(3) times as
  // much on the distance.
  [[nodiscard]] double distance(double reach) const {
    return 1.7320508075688773 * (bounds.unit * bounds.hit * reach + lost);
  }

  const Ray& ray;
  Bounds bounds;
  double least;  // 1 of tree space in the caller's units
  Point o;
  Point d;
  std::size_t z = 0;               // the axis along which d is longest
  std::optional<mpf_class> shift;  // how far along the ray its origin is brought, if it is
  double lost;                     // how far scaling and moving may have moved a sheared coordinate
};

// What decides about one ray and one triangle.
struct Facts {
  Banded edge[3];      // determinants of the edges: all of one sign inside
  Banded along;        // d . n: zero for a ray in the plane
  double t;            // where the ray meets the plane; NaN for a ray in the plane
  double t_allowance;  // how well the intersector knows t; infinite for a ray in the plane
  double reach;        // largest |corner - o| along an axis
};

Facts examine(const Judged& judged, const Corners& corners) {
  const Bounds& bounds = judged.bounds;
  // What moves the corners whose signs are exact: of `fast`, the double test that it may ask.
  const Bounds moving = bounds.product == 0.0 ? bounds : bounds_of(Intersector::double_precision);
  const Point& d = judged.d;
  const std::size_t z = judged.z;
  const std::size_t across[2] = {(z + 1) % 3, (z + 2) % 3};
  const double depth = std::abs(d[z]);
  Facts facts{};

  struct Corner {
    double at[2];     // sheared coordinates
    double moved[2];  // how far they may be moved for the signs
    double size[3];   // magnitudes from the origin, in the order x, y, z
  };
  Corner corner[3];
  double furthest = 0.0;         // along z
  double moved[2] = {0.0, 0.0};  // of any corner, for t
  for (std::size_t i = 0; i < 3; ++i) {
    Long p[3];
    for (std::size_t a = 0; a < 3; ++a) {
      p[a] = judged.from_origin(corners[i][a], a);
      facts.reach = std::max(facts.reach, static_cast<double>(std::abs(p[a])));
    }
    furthest = std::max(furthest, static_cast<double>(std::abs(p[z])));
    corner[i].size[2] = static_cast<double>(std::abs(p[z]));
    for (std::size_t k = 0; k < 2; ++k) {
      const Long sheared = Long{d[across[k]]} / Long{d[z]} * p[z];
      corner[i].at[k] = static_cast<double>(p[across[k]] - sheared);
      corner[i].size[k] = static_cast<double>(std::abs(p[across[k]]));
      const auto by = [&](const Bounds& test) {
        return test.unit * (test.corner * corner[i].size[k] +
                            test.sheared * static_cast<double>(std::abs(sheared))) +
               judged.lost;
      };
      corner[i].moved[k] = by(moving);
      moved[k] = std::max(moved[k], by(bounds));
    }
  }
  // The terms that a product of `fast` is summed from, along the sheared ray.
  const double slope[2] = {std::abs(d[across[0]]) / depth, std::abs(d[across[1]]) / depth};
  const auto terms = [&slope](const double(&p)[3], const double(&q)[3]) {
    return p[0] * q[1] + p[1] * q[0] + slope[1] * (p[2] * q[0] + p[0] * q[2]) +
           slope[0] * (p[1] * q[2] + p[2] * q[1]);
  };
  double side[2][3];  // magnitudes of the edges from corner 0
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t axis = k < 2 ? across[k] : z;
      side[i][k] = std::abs(corners[i + 1][axis] - corners[0][axis]);
    }
  }
  const double product = bounds.product * bounds.unit;
  const auto side_error = [&](std::size_t i) {
    const double moved_corner = judged.lost * 2.0 * (side[i][0] + side[i][1] + side[i][2]);
    return product * terms(corner[0].size, side[i]) + moved_corner;
  };
  const double product_error[3] = {
      side_error(0), side_error(0) + side_error(1) + product * terms(side[0], side[1]),
      side_error(1)};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const Corner& a = corner[i];
    const Corner& b = corner[j];
    double band = a.moved[0] * std::abs(b.at[1]) + std::abs(a.at[0]) * b.moved[1] +
                  a.moved[1] * std::abs(b.at[0]) + std::abs(a.at[1]) * b.moved[0] +
                  a.moved[0] * b.moved[1] + a.moved[1] * b.moved[0];
    // `fast` decides in either precision, and neither bound is always the larger: that of double
    // is, where a triangle lies nearly along an axis and so has small terms.
    if (bounds.product != 0.0) band = std::max(band, product_error[i]);
    band += judged.underflow(a.size[0] + a.size[1] + a.size[2], b.size[0] + b.size[1] + b.size[2]);
    // Where no coordinate is rounded there is no excuse.
    const bool flat = bounds.product == 0.0 && a.at[0] == 0.0 && b.at[0] == 0.0 &&
                      a.moved[0] == 0.0 && b.moved[0] == 0.0;
    facts.edge[i] = {determinant_value(d, judged.o, corners[i], corners[j]),
                     flat ? 0.0 : depth * band};
  }

  const PlaneHit plane = plane_hit(judged.o, d, corners);
  facts.along = {plane.denominator, depth * product * terms(side[0], side[1])};
  facts.t = plane.t;
  // In the moved triangle's plane, and how far t may be from that; of `fast`, within the distance
  // to the triangle that is allowed.
  facts.t_allowance =
      (bounds.product == 0.0
           ? std::hypot(moved[0], moved[1]) * plane.normal / std::abs(plane.denominator) +
                 bounds.unit * bounds.t * furthest / depth
           : judged.distance(facts.reach) * plane.normal / std::abs(plane.denominator)) +
      (bounds.unit == 0.0
           ? 0.0
           : 0x1p-52 * std::abs(plane.t) + judged.lost_by_shift(plane.t) + smallest_float);
  return facts;
}

// Whether an intersector that errs within the band may overlook a triangle that is exactly hit.
bool may_be_missed(const Facts& facts, const Ray& ray) {
  for (const Banded& edge : facts.edge) {
    if (edge.excused()) return true;
  }
  if (facts.along.excused()) return true;
  const auto near = [&](float end) {
    return std::abs(facts.t - static_cast<double>(end)) < facts.t_allowance;
  };
  return near(ray.t_min) || near(ray.t_max);
}

// Distance from q to a closed triangle: to its plane where the foot is inside, else to the nearest
// edge. Corners that were rounded to a Long may coincide: they are then nearer to each other than
// any bound can tell.
Long distance(const LongPoint& q, const LongPoint (&corners)[3]) {
  const LongPoint ab = difference(corners[1], corners[0]);
  const LongPoint ac = difference(corners[2], corners[0]);
  const LongPoint n = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2],
                       ab[0] * ac[1] - ab[1] * ac[0]};
  Long nearest = std::numeric_limits<Long>::infinity();
  bool inside = dot(n, n) > 0.0L;
  for (std::size_t i = 0; i < 3; ++i) {
    const LongPoint edge = difference(corners[(i + 1) % 3], corners[i]);
    const LongPoint to_q = difference(q, corners[i]);
    const LongPoint outward = {edge[1] * n[2] - edge[2] * n[1], edge[2] * n[0] - edge[0] * n[2],
                               edge[0] * n[1] - edge[1] * n[0]};
    inside = inside && dot(outward, to_q) <= 0.0L;
    const Long squared = dot(edge, edge);
    const Long along = squared > 0.0L ? std::clamp(dot(to_q, edge) / squared, 0.0L, 1.0L) : 0.0L;
    nearest = std::min(nearest, length({to_q[0] - along * edge[0], to_q[1] - along * edge[1],
                                        to_q[2] - along * edge[2]}));
  }
  if (inside) {
    nearest = std::min(nearest, std::abs(dot(difference(q, corners[0]), n)) / length(n));
  }
  return nearest;
}

// The least distance from the triangle of a point o + s * d, s being what rounds to the float t.
// Distance is convex along a line: by ternary search, a thousand thirds being more than the digits
// of any two floats span.
Long distance_of_answer(const Judged& judged, double t, const Corners& corners) {
  LongPoint seen[3];
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      seen[i][a] = judged.from_origin(corners[i][a], a);
    }
  }
  // From the moved origin, so that no digit is lost.
  const auto at = [&](Long along) {
    return distance({along * judged.d[0], along * judged.d[1], along * judged.d[2]}, seen);
  };
  const Long answered = judged.from_origin_along(t);
  const Long rounded_by = Long{0.5 * float_ulp(t) + judged.lost_by_shift(t)};
  Long lo = answered - rounded_by;
  Long hi = answered + rounded_by;
  for (int i = 0; i < 1000 && lo < hi; ++i) {
    const Long third = (hi - lo) / 3.0L;
    if (at(lo + third) <= at(hi - third))
      hi -= third;
    else
      lo += third;
  }
  return std::min({at(lo), at(hi), at(answered)});
}

// Whether an intersector that errs within the band may answer `hit` on a triangle that the ray
// exactly misses.
bool may_be_invented(const Judged& judged, const Facts& facts, const Hit& hit,
                     const Corners& corners) {
  if (!(hit.t >= judged.ray.t_min && hit.t <= judged.ray.t_max) || !std::isfinite(hit.t))
    return false;
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
  return distance_of_answer(judged, static_cast<double>(hit.t), corners) <=
         Long{judged.distance(facts.reach)};
}

// Whether the point that u and v name is as near to the ray's at t as promised, axis by axis.
bool is_point_in_bound(const Judged& judged, const Hit& hit, const Corners& corners) {
  const auto t = static_cast<double>(hit.t);
  const auto u = static_cast<double>(hit.u);
  const auto v = static_cast<double>(hit.v);
  LongPoint seen[3];
  double reach = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      seen[i][a] = judged.from_origin(corners[i][a], a);
      reach = std::max(reach, static_cast<double>(std::abs(seen[i][a])));
    }
  }
  const Long along = judged.from_origin_along(t);
  const LongPoint ab = difference(seen[1], seen[0]);
  const LongPoint ac = difference(seen[2], seen[0]);
  const double computed = 8.0 * static_cast<double>(std::numeric_limits<Long>::epsilon()) * reach;
  const double promised = judged.bounds.unit * judged.bounds.point * reach + judged.lost + computed;
  for (std::size_t a = 0; a < 3; ++a) {
    const double off = static_cast<double>(
        std::abs(seen[0][a] + Long{u} * ab[a] + Long{v} * ac[a] - along * Long{judged.d[a]}));
    // Half a unit of each.
    const double rounded = (0.5 * float_ulp(t) + judged.lost_by_shift(t)) * std::abs(judged.d[a]) +
                           0.5 * (float_ulp(u) * static_cast<double>(std::abs(ab[a])) +
                                  float_ulp(v) * static_cast<double>(std::abs(ac[a])));
    if (!(off <= promised + rounded)) return false;
  }
  return true;
}

}  // namespace

Bounds bounds_of(Intersector intersector) noexcept {
  switch (intersector) {
    case Intersector::watertight:
    case Intersector::double_precision:
      return {
          .unit = 0x1p-53, .corner = 2.0, .sheared = 4.0, .hit = 20.0, .t = 14.0, .point = 34.0};
    case Intersector::single_precision:
      return {
          .unit = 0x1p-24, .corner = 4.0, .sheared = 5.0, .hit = 24.0, .t = 15.0, .point = 38.0};
    case Intersector::fast:
      return {.unit = 0x1p-24, .hit = 32.0, .point = 32.0, .product = 12.0};
    case Intersector::exact:
      break;
  }
  return {};
}

double stated_t_bound(Intersector intersector, double condition, double reach) noexcept {
  switch (intersector) {
    case Intersector::watertight:
    case Intersector::double_precision:
      return (9.0 * condition + 25.0) * 0x1p-53 * reach;
    case Intersector::single_precision:
      return (13.0 * condition + 26.0) * 0x1p-24 * reach;
    case Intersector::fast:
      return 56.0 * condition * 0x1p-24 * reach;
    case Intersector::exact:
      break;
  }
  return 0.0;
}

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

double stated_reach(const Oracle& oracle, const Ray& ray, const Corners& corners) {
  const Point o = point(ray.origin);
  if (is_far(oracle, o)) return 32.0 * oracle.largest_coordinate();
  double reach = 0.0;
  for (const Point& corner : corners)
    for (std::size_t a = 0; a < 3; ++a) reach = std::max(reach, std::abs(corner[a] - o[a]));
  return reach;
}

bool point_in_bound(const Oracle& oracle, const TriangleView& triangles, const Ray& ray,
                    const Hit& hit, Intersector intersector) {
  return is_point_in_bound(Judged(oracle, ray, intersector), hit,
                           *finite_corners(triangles, hit.triangle));
}

Verdict judge(const Oracle& oracle, const TriangleView& triangles, const Ray& ray, const Hit& hit,
              Intersector intersector) {
  const ExactHit exact = oracle.closest_hit(ray);
  const bool answered = hit.triangle != no_triangle;
  Verdict verdict;
  if (!exact.hit && !answered) return verdict;
  const auto examined = [&](const Judged& judged, std::size_t triangle) {
    return examine(judged, *finite_corners(triangles, triangle));
  };
  if (exact.hit && answered &&
      std::binary_search(exact.ties.begin(), exact.ties.end(), hit.triangle)) {
    const double off = std::abs(static_cast<double>(hit.t) - exact.t);
    verdict.t_ulp =
        std::isnan(off) ? std::numeric_limits<double>::infinity() : off / float_ulp(exact.t);
    const Judged judged(oracle, ray, intersector);
    verdict.point_in_bound =
        is_point_in_bound(judged, hit, *finite_corners(triangles, hit.triangle));
    if (verdict.t_ulp > 0.5) {
      const Facts facts = examined(judged, hit.triangle);
      // exact.t was rounded to a double.
      verdict.t_in_bound =
          off <= facts.t_allowance + 0.5 * float_ulp(exact.t) + 0x1p-52 * std::abs(exact.t);
    }
    return verdict;
  }
  verdict.kind = !exact.hit  ? Verdict::phantom
                 : !answered ? Verdict::missed
                             : Verdict::wrong_triangle;
  if (answered && (degenerate(ray) || hit.triangle >= triangles.triangle_count ||
                   !valid_triangle(triangles, hit.triangle))) {
    return verdict;
  }

  const std::vector<std::uint32_t> hits = oracle.all_hits(ray);
  const Judged judged(oracle, ray, intersector);

  // The triangle answered must be a hit, or an excused one, and not in front of what an exact t
  // allows: `chosen` is its t, `allowance` how well it is known.
  double chosen = std::numeric_limits<double>::infinity();
  double allowance = 0.0;
  if (answered) {
    const Facts facts = examined(judged, hit.triangle);
    const Corners corners = *finite_corners(triangles, hit.triangle);
    if (!is_point_in_bound(judged, hit, corners)) return verdict;
    if (std::binary_search(hits.begin(), hits.end(), hit.triangle)) {
      chosen = facts.t;
      allowance = facts.t_allowance;
      const double off = std::abs(static_cast<double>(hit.t) - chosen);
      if (!(off <= allowance + 0.5 * float_ulp(chosen))) return verdict;
    } else {
      if (!may_be_invented(judged, facts, hit, corners)) return verdict;
      // Its plane may be nearly along the ray and say nothing of t: the t answered counts.
      chosen = static_cast<double>(hit.t);
      allowance = 0.5 * float_ulp(chosen);
    }
  }

  // Nothing that had to be found may be nearer.
  std::optional<Corners> last;
  for (const std::uint32_t other : hits) {
    if (other == hit.triangle) continue;
    const Corners corners = *finite_corners(triangles, other);
    if (corners == last) continue;  // a million copies of one are judged as one
    last = corners;
    const Facts facts = examine(judged, corners);
    if (chosen - facts.t <= allowance + facts.t_allowance) continue;
    if (!may_be_missed(facts, ray)) return verdict;
  }
  verdict.in_band = true;
  return verdict;
}

}  // namespace zkd::verify
