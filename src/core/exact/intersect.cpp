// SPDX-License-Identifier: Apache-2.0
//
// Intersector::exact: see intersect.hpp. Out of line, so that a walk stays small: few
// triangles get here.
#include "core/exact/intersect.hpp"

namespace zkd::core {
namespace {

FloatPoint point(const float* p) { return {{p[0], p[1], p[2]}}; }

double difference(const FloatPoint& a, const FloatPoint& b, int axis) {
  return static_cast<double>(a.at[axis]) - static_cast<double>(b.at[axis]);
}

}  // namespace

ExactCandidate::ExactCandidate(const Ray& ray, const Corners& corners, std::uint32_t id)
    : triangle(id), origin_(point(&ray.origin.x)), direction_(point(&ray.direction.x)) {
  for (int i = 0; i < 3; ++i) corner_[i] = point(corners.p[i]);
  double ab[3];
  double ac[3];
  double oa[3];
  for (int a = 0; a < 3; ++a) {
    ab[a] = difference(corner_[1], corner_[0], a);
    ac[a] = difference(corner_[2], corner_[0], a);
    oa[a] = difference(corner_[0], origin_, a);
  }
  along_ = bounded_determinant(direction_, ab, ac);
  t_ = along_.certain() ? quotient(bounded_determinant(oa, ab, ac), along_) : t().bracket();
}

bool ExactCandidate::before(const ExactCandidate& other) const {
  if (!other.found() || t_.hi < other.t_.lo) return true;
  if (t_.lo > other.t_.hi) return false;
  const int order = t().compared_with(other.t());
  return order < 0 || (order == 0 && triangle < other.triangle);
}

bool ExactCandidate::within(float t_min, float t_max) const {
  constexpr double infinite = 0x1.ffffffp127;  // from here on t rounds to infinity
  const double first = larger(static_cast<double>(t_min), -infinite);
  const double last = smaller(static_cast<double>(t_max), infinite);
  if (t_.hi < first || t_.lo > last) return false;
  if (t_.lo > first && t_.hi < last) return true;
  const ExactQuotient exact = t();
  return exact.compared_with(first) >= (first == -infinite ? 1 : 0) &&
         exact.compared_with(last) <= (last == infinite ? -1 : 0);
}

Hit ExactCandidate::hit() const {
  if (!found()) return {};
  Hit hit;
  hit.triangle = triangle;
  if (!t_.is_one_float(hit.t)) hit.t = t().rounded();
  hit.u = weight(corner_[2], corner_[0]);
  hit.v = weight(corner_[0], corner_[1]);
  return hit;
}

Exact ExactCandidate::along() const {
  return exact_determinant(direction_, corner_[0], corner_[1], corner_[2]);
}

ExactQuotient ExactCandidate::t() const {
  return {exact_offset(origin_, corner_[0], corner_[1], corner_[2]), along()};
}

/// The weight of a corner where the line passes, from the two others:
/// det(d, p - o, q - o) / d . n.
float ExactCandidate::weight(const FloatPoint& p, const FloatPoint& q) const {
  double to_p[3];
  double to_q[3];
  for (int a = 0; a < 3; ++a) {
    to_p[a] = difference(p, origin_, a);
    to_q[a] = difference(q, origin_, a);
  }
  float rounded = 0.0F;
  if (along_.certain() &&
      quotient(bounded_determinant(direction_, to_p, to_q), along_).is_one_float(rounded))
    return rounded;
  return ExactQuotient(exact_determinant(direction_, origin_, p, q), along()).rounded();
}

bool ExactIntersect::decide(const Corners& corners, std::uint32_t id, Candidate& best) const {
  if (!all_finite(corners) || !crosses(corners)) return false;
  Candidate candidate(ray_, corners, id);
  if (!candidate.within(ray_.t_min, ray_.t_max) || !candidate.before(best)) return false;
  candidate.limit = limit_behind(in_tree_space(candidate.at_most(), 1.0));
  candidate.begin = limit_before(in_tree_space(candidate.at_least(), -1.0));
  best = candidate;
  return true;
}

/// Whether the line meets the closed triangle: no two of the three determinants of its edges have
/// opposite signs, and not all are zero.
bool ExactIntersect::crosses(const Corners& corners) const {
  const float* origin = &ray_.origin.x;
  const FloatPoint o{{origin[0], origin[1], origin[2]}};
  const FloatPoint d{{ray_.direction.x, ray_.direction.y, ray_.direction.z}};
  double p[3][3];
  for (int i = 0; i < 3; ++i)
    for (int a = 0; a < 3; ++a)
      p[i][a] = static_cast<double>(corners.p[i][a]) - static_cast<double>(origin[a]);
  bool positive = false;
  bool negative = false;
  bool open[3];
  for (int i = 0; i < 3; ++i) {
    const BoundedDeterminant edge = bounded_determinant(d, p[i], p[(i + 1) % 3]);
    open[i] = !edge.certain();
    positive = positive || edge.value > edge.error;
    negative = negative || -edge.value > edge.error;
  }
  for (int i = 0; i < 3 && !(positive && negative); ++i) {
    if (!open[i]) continue;
    const float* a = corners.p[i];
    const float* b = corners.p[(i + 1) % 3];
    const int sign = exact_determinant(d, o, {{a[0], a[1], a[2]}}, {{b[0], b[1], b[2]}}).sign();
    positive = positive || sign > 0;
    negative = negative || sign < 0;
  }
  return positive != negative;
}

/// The caller's t in tree space, moved outward by more than roundings take; t_shift was rounded.
Wide ExactIntersect::in_tree_space(double callers_t, double outward) const {
  const double end = callers_t / prepared_.t_scale.value;
  const double shift = prepared_.t_shift.value;
  return end - shift + outward * 1e-15 * (magnitude(end) + magnitude(shift));
}

}  // namespace zkd::core
