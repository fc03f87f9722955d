// SPDX-License-Identifier: Apache-2.0
//
// Exact predicates: a filter in double, then GMP.
#include "verify/exact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "verify/integers.hpp"

namespace zkd::verify {
namespace {

Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Point corner(const ExactBox& box, unsigned which) {
  Point result{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    result[axis] = (which >> axis & 1U) != 0 ? box.hi[axis] : box.lo[axis];
  }
  return result;
}

bool empty(const ExactBox& box) {
  return !(box.lo[0] <= box.hi[0] && box.lo[1] <= box.hi[1] && box.lo[2] <= box.hi[2]);
}

// The sign of (p - q) . w in the plane of axes i and j, w being (b - a) turned by a quarter:
// (p - q)_i * (b - a)_j - (p - q)_j * (b - a)_i.
int turned_sign(const Point& p, const Point& q, const Point& a, const Point& b, std::size_t i,
                std::size_t j) {
  const double left = (p[i] - q[i]) * (b[j] - a[j]);
  const double right = (p[j] - q[j]) * (b[i] - a[i]);
  const double value = left - right;
  const double permanent = std::abs(left) + std::abs(right);
  // Two differences, a product and a sum: four roundings, less than the seven of a determinant.
  if (std::abs(value) > Determinant::bound * permanent) return value > 0.0 ? 1 : -1;
  if (permanent == 0.0) return 0;
  const int exponent = common_exponent({p, q, a, b});
  const auto z = [exponent](double x) { return integer(x, exponent); };
  const mpz_class exact =
      (z(p[i]) - z(q[i])) * (z(b[j]) - z(a[j])) - (z(p[j]) - z(q[j])) * (z(b[i]) - z(a[i]));
  return sgn(exact);
}

// Whether the plane of the triangle has the whole box on one side, strictly or (`touching`) not.
bool separated_by_plane(const Corners& corners, const ExactBox& box, bool touching) {
  const Point& a = corners[0];
  int side = 0;
  for (unsigned which = 0; which < 8; ++which) {
    // det(corner - a, b - a, c - a), with the roles of determinant_sign: all three are differences.
    const Point at = corner(box, which);
    const Determinant filter =
        determinant(difference(at, a), difference(corners[1], a), difference(corners[2], a));
    int sign = 0;
    // One rounding more than the seven that Determinant::bound covers: the first argument.
    if (std::abs(filter.value) > 1.2 * Determinant::bound * filter.permanent) {
      sign = filter.value > 0.0 ? 1 : -1;
    } else if (filter.permanent != 0.0) {
      const int exponent = common_exponent({at, a, corners[1], corners[2]});
      const IntegerPoint origin(a, exponent);
      const IntegerPoint n = cross(IntegerPoint(corners[1], exponent) - origin,
                                   IntegerPoint(corners[2], exponent) - origin);
      sign = sgn(dot(IntegerPoint(at, exponent) - origin, n));
    }
    if (sign == 0 && touching) continue;
    if (sign == 0 || (side != 0 && sign != side)) return false;
    side = sign;
  }
  return true;
}

// Whether the axis perpendicular to edge (a, b) and to box axis k separates, strictly or
// (`touching`) not.
bool separated_across_edge(const Corners& corners, const ExactBox& box, const Point& a,
                           const Point& b, std::size_t k, bool touching) {
  const std::size_t i = (k + 1) % 3;
  const std::size_t j = (k + 2) % 3;
  if (a[i] == b[i] && a[j] == b[j]) return false;
  // Along w with w_i = (b - a)_j and w_j = -(b - a)_i, the corner of the box that is farthest:
  Point high = box.lo;
  Point low = box.lo;
  (b[j] > a[j] ? high : low)[i] = box.hi[i];
  (b[i] < a[i] ? high : low)[j] = box.hi[j];
  // The third axis does not enter; any value does, one of a keeps the common exponent small.
  high[k] = low[k] = a[k];
  const int least = touching ? 0 : 1;
  bool above = true;
  bool below = true;
  for (const Point& p : corners) {
    above = above && turned_sign(p, high, a, b, i, j) >= least;
    below = below && turned_sign(p, low, a, b, i, j) <= -least;
    if (!above && !below) return false;
  }
  return true;
}

}  // namespace

std::optional<Corners> finite_corners(const TriangleView& triangles, std::size_t triangle) {
  Corners corners{};
  for (int corner_index = 0; corner_index < 3; ++corner_index) {
    const std::uint32_t vertex = triangles.index(triangle, corner_index);
    if (vertex >= triangles.position_count) return std::nullopt;
    const float* position = triangles.position(vertex);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(position[axis])) return std::nullopt;
      corners[static_cast<std::size_t>(corner_index)][axis] = static_cast<double>(position[axis]);
    }
  }
  return corners;
}

bool exact_zero_area(const Corners& corners) {
  // Zero area is a zero cross product: three signs in the coordinate planes.
  for (std::size_t i = 0; i < 3; ++i) {
    if (turned_sign(corners[2], corners[0], corners[0], corners[1], i, (i + 1) % 3) != 0) {
      return false;
    }
  }
  return true;
}

bool valid_triangle(const TriangleView& triangles, std::size_t triangle) {
  const std::optional<Corners> corners = finite_corners(triangles, triangle);
  return corners && !exact_zero_area(*corners);
}

// Separating axes. Two convex polytopes without a common point are strictly separated along a
// normal of a face of one of them or a cross product of an edge of each; the axes of a box keep
// their role where its extent along one is zero (a point, a segment, a rectangle), because an axis
// of the box perpendicular to the lost extent, crossed with the edges of the triangle, takes the
// place of the in-plane normals.
bool exact_overlap(const Corners& corners, const ExactBox& box) {
  if (empty(box)) return false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [lo, hi] = std::minmax({corners[0][axis], corners[1][axis], corners[2][axis]});
    if (lo > box.hi[axis] || hi < box.lo[axis]) return false;
  }
  if (separated_by_plane(corners, box, false)) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (separated_across_edge(corners, box, corners[i], corners[(i + 1) % 3], axis, false)) {
        return false;
      }
    }
  }
  return true;
}

// Separating axes again. A triangle that lies in no side shares an area with a box exactly if it
// reaches the inside, an open set: what separates the two may touch both. A triangle across an axis
// is taken to the plane of the others, where the same holds of triangle and rectangle.
bool exact_shares_area(const Corners& corners, const ExactBox& box) {
  if (empty(box)) return false;
  bool across[3];  // all corners have the same coordinate
  bool any_across = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [lo, hi] = std::minmax({corners[0][axis], corners[1][axis], corners[2][axis]});
    across[axis] = lo == hi;
    any_across = any_across || across[axis];
    if (across[axis] ? lo > box.hi[axis] || hi < box.lo[axis]
                     : lo >= box.hi[axis] || hi <= box.lo[axis]) {
      return false;
    }
    if (!across[axis] && box.lo[axis] == box.hi[axis]) return false;
  }
  if (!any_across && separated_by_plane(corners, box, true)) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (any_across && !across[axis]) continue;
      if (separated_across_edge(corners, box, corners[i], corners[(i + 1) % 3], axis, true)) {
        return false;
      }
    }
  }
  return true;
}

bool exact_overlap(const Corners& corners, const Box& box) {
  ExactBox exact{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    exact.lo[axis] = static_cast<double>(box.lo[axis]);
    exact.hi[axis] = static_cast<double>(box.hi[axis]);
  }
  return exact_overlap(corners, exact);
}

double separation(const Corners& corners, const ExactBox& box) {
  double widest = -std::numeric_limits<double>::infinity();
  const auto along = [&](const Point& axis) {
    const double length = std::sqrt(dot(axis, axis));
    if (!(length > 0.0)) return;
    // Relative to a corner of the triangle, so that a far scene costs no digits.
    double triangle_lo = std::numeric_limits<double>::infinity();
    double triangle_hi = -triangle_lo;
    for (const Point& p : corners) {
      const double at = dot(difference(p, corners[0]), axis);
      triangle_lo = std::min(triangle_lo, at);
      triangle_hi = std::max(triangle_hi, at);
    }
    double box_lo = std::numeric_limits<double>::infinity();
    double box_hi = -box_lo;
    for (unsigned which = 0; which < 8; ++which) {
      const double at = dot(difference(corner(box, which), corners[0]), axis);
      box_lo = std::min(box_lo, at);
      box_hi = std::max(box_hi, at);
    }
    widest = std::max(widest, std::max(triangle_lo - box_hi, box_lo - triangle_hi) / length);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Point unit{};
    unit[axis] = 1.0;
    along(unit);
    for (std::size_t i = 0; i < 3; ++i) {
      along(cross(unit, difference(corners[(i + 1) % 3], corners[i])));
    }
  }
  along(cross(difference(corners[1], corners[0]), difference(corners[2], corners[0])));
  return widest;
}

double normal_condition(const Corners& corners) {
  const int exponent = common_exponent({corners[0], corners[1], corners[2]});
  const IntegerPoint a(corners[0], exponent);
  const IntegerPoint ab = IntegerPoint(corners[1], exponent) - a;
  const IntegerPoint bc = IntegerPoint(corners[2], exponent) - IntegerPoint(corners[1], exponent);
  const IntegerPoint normal = cross(ab, bc);
  const mpz_class products = abs(ab.y * bc.z) + abs(ab.z * bc.y) + abs(ab.z * bc.x) +
                             abs(ab.x * bc.z) + abs(ab.x * bc.y) + abs(ab.y * bc.x);
  const mpz_class length = sqrt(dot(normal, normal));
  if (length == 0) return std::numeric_limits<double>::infinity();
  return mpq_class(products, length).get_d();
}

namespace {

// In units of a power of two.
struct IntegerDeterminant {
  mpz_class value;
  int exponent;

  IntegerDeterminant(const Point& d, const Point& o, const Point& a, const Point& b) {
    const int points = common_exponent({o, a, b});
    const int direction = common_exponent({d});
    const IntegerPoint origin(o, points);
    value = dot(IntegerPoint(d, direction),
                cross(IntegerPoint(a, points) - origin, IntegerPoint(b, points) - origin));
    exponent = 2 * points + direction;
  }
};

}  // namespace

int determinant_sign(const Point& d, const Point& o, const Point& a, const Point& b) {
  const Determinant filter = determinant(d, difference(a, o), difference(b, o));
  if (filter.certain()) return (filter.value > 0.0) - (filter.value < 0.0);
  return sgn(IntegerDeterminant(d, o, a, b).value);
}

double determinant_value(const Point& d, const Point& o, const Point& a, const Point& b) {
  const Determinant filter = determinant(d, difference(a, o), difference(b, o));
  if (std::abs(filter.value) > 1e6 * Determinant::bound * filter.permanent) return filter.value;
  const IntegerDeterminant exact(d, o, a, b);
  return nearest_double({exact.value, 1, exact.exponent});
}

PlaneHit plane_hit(const Point& o, const Point& d, const Corners& corners) {
  const ExactPlaneHit exact(o, d, corners);
  PlaneHit result{};
  const int scale = 2 * exact.point_exponent;
  const auto rounded = [](const mpz_class& value, int exponent) {
    return nearest_double({value, 1, exponent});
  };
  result.normal = std::hypot(rounded(exact.normal.x, scale), rounded(exact.normal.y, scale),
                             rounded(exact.normal.z, scale));
  result.denominator = rounded(exact.along, scale + exact.direction_exponent);
  result.t =
      sgn(exact.along) == 0 ? std::numeric_limits<double>::quiet_NaN() : nearest_double(exact.t());
  return result;
}

Barycentrics barycentrics(const Point& o, const Point& d, const Corners& corners) {
  const int exponent = common_exponent({o, corners[0], corners[1], corners[2]});
  const IntegerPoint origin(o, exponent);
  const IntegerPoint direction(d, common_exponent({d}));
  const IntegerPoint a = IntegerPoint(corners[0], exponent) - origin;
  const IntegerPoint b = IntegerPoint(corners[1], exponent) - origin;
  const IntegerPoint c = IntegerPoint(corners[2], exponent) - origin;
  // The edge opposite a corner has that corner's weight; the three weights add up to d . n.
  const mpz_class of_a = dot(direction, cross(b, c));
  const mpz_class of_b = dot(direction, cross(c, a));
  const mpz_class of_c = dot(direction, cross(a, b));
  const mpz_class sum = of_a + of_b + of_c;
  if (sgn(sum) == 0) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan};
  }
  const auto share = [&](const mpz_class& weight) {
    return sgn(sum) < 0 ? nearest_double({-weight, -sum, 0}) : nearest_double({weight, sum, 0});
  };
  return {share(of_b), share(of_c)};
}

}  // namespace zkd::verify
