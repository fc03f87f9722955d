// SPDX-License-Identifier: Apache-2.0
//
// The exact oracle: triangles in a box tree or a row, tests that never round an answer.
#include "verify/oracle.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "verify/exact.hpp"
#include "verify/integers.hpp"

namespace zkd::verify {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

constexpr std::size_t brute_force_limit = 10'000;
constexpr std::uint32_t leaf_size = 4;

struct FloatBox {
  float lo[3] = {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
                 std::numeric_limits<float>::infinity()};
  float hi[3] = {-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                 -std::numeric_limits<float>::infinity()};
};

struct Triangle {
  float corner[3][3];
  std::uint32_t id;

  [[nodiscard]] Corners corners() const {
    Corners result{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        result[i][axis] = static_cast<double>(corner[i][axis]);
      }
    }
    return result;
  }

  [[nodiscard]] float centre(int axis) const {
    const auto [lo, hi] = std::minmax({corner[0][axis], corner[1][axis], corner[2][axis]});
    return 0.5F * lo + 0.5F * hi;
  }
};

// Boxes and links of both children. A child with count 0 is node `first`, any other is a leaf of
// triangles [first, first + count).
struct BoxNode {
  FloatBox box[2];
  std::uint32_t first[2];
  std::uint32_t count[2];
};

// A ray as the tests want it.
struct ExactRay {
  explicit ExactRay(const Ray& ray)
      : t_min(static_cast<double>(ray.t_min)), t_max(static_cast<double>(ray.t_max)) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto along = static_cast<glm::vec3::length_type>(axis);
      o[axis] = static_cast<double>(ray.origin[along]);
      d[axis] = static_cast<double>(ray.direction[along]);
      inverse[axis] = d[axis] != 0.0 ? 1.0 / d[axis] : 0.0;
    }
  }

  Point o;
  Point d;
  Point inverse;
  double t_min;
  double t_max;
};

// Where in a triangle the line of a ray passes.
enum class Place { outside, interior, edge, vertex };

// Closed triangle, both sides. The line meets the triangle where the determinants of its three
// edges have no two opposite signs; U + V + W = d . n, so that all of them zero (and only then) is
// a ray in the plane, or a triangle without area.
Place place(const ExactRay& ray, const Triangle& triangle) {
  const Corners corners = triangle.corners();
  const Corners from_origin = {difference(corners[0], ray.o), difference(corners[1], ray.o),
                               difference(corners[2], ray.o)};
  bool positive = false;
  bool negative = false;
  int zeros = 0;
  bool open[3] = {false, false, false};
  for (std::size_t edge = 0; edge < 3; ++edge) {
    const Determinant filter = determinant(ray.d, from_origin[edge], from_origin[(edge + 1) % 3]);
    if (!filter.certain()) {
      open[edge] = true;
      continue;
    }
    positive = positive || filter.value > 0.0;
    negative = negative || filter.value < 0.0;
    zeros += filter.value == 0.0;
    if (positive && negative) return Place::outside;
  }
  for (std::size_t edge = 0; edge < 3; ++edge) {
    if (!open[edge]) continue;
    const int sign = determinant_sign(ray.d, ray.o, corners[edge], corners[(edge + 1) % 3]);
    positive = positive || sign > 0;
    negative = negative || sign < 0;
    zeros += sign == 0;
    if (positive && negative) return Place::outside;
  }
  switch (zeros) {
    case 0:
      return Place::interior;
    case 1:
      return Place::edge;
    case 2:
      return Place::vertex;
    default:
      return Place::outside;
  }
}

// The t of a hit: certain bounds in double, and the exact ratio once it was needed.
class HitDistance {
 public:
  HitDistance() = default;

  HitDistance(const ExactRay& ray, const Triangle& triangle) : ray_(&ray), triangle_(&triangle) {
    const Corners corners = triangle.corners();
    const Point ab = difference(corners[1], corners[0]);
    const Point ac = difference(corners[2], corners[0]);
    Determinant along = determinant(ray.d, ab, ac);
    Determinant offset = determinant(difference(corners[0], ray.o), ab, ac);
    if (along.value < 0.0) {
      along.value = -along.value;
      offset.value = -offset.value;
    }
    // Eight roundings where all three arguments are differences (offset), seven else.
    constexpr double bound = 1.2 * Determinant::bound;
    const double error = bound * offset.permanent;
    const double along_lo = along.value - bound * along.permanent;
    const double along_hi = along.value + bound * along.permanent;
    if (!(along_lo > 0.0)) {
      make_exact();
      return;
    }
    const double offset_lo = offset.value - error;
    const double offset_hi = offset.value + error;
    lo_ = offset_lo / (offset_lo >= 0.0 ? along_hi : along_lo);
    hi_ = offset_hi / (offset_hi >= 0.0 ? along_lo : along_hi);
    widen();
  }

  [[nodiscard]] double lo() const { return lo_; }
  [[nodiscard]] double hi() const { return hi_; }

  // -1, 0, 1 as this t is nearer than, equal to, beyond the other.
  int compare(HitDistance& other) {
    if (hi_ < other.lo_) return -1;
    if (lo_ > other.hi_) return 1;
    return verify::compare(exact(), other.exact());
  }

  // t_min <= t <= t_max, and t rounds to a finite float.
  bool within(double t_min, double t_max) {
    constexpr double infinite = 0x1.ffffffp127;  // the middle of the largest float and 2^128
    if (lo_ >= t_min && hi_ <= t_max && lo_ > -infinite && hi_ < infinite) return true;
    if (hi_ < t_min || lo_ > t_max) return false;
    if (t_min == infinity || t_max == -infinity) return false;
    return (t_min == -infinity || verify::compare(exact(), ratio(t_min)) >= 0) &&
           (t_max == infinity || verify::compare(exact(), ratio(t_max)) <= 0) &&
           verify::compare(exact(), ratio(-infinite)) > 0 &&
           verify::compare(exact(), ratio(infinite)) < 0;
  }

  double nearest() { return nearest_double(exact()); }

 private:
  const Ratio& exact() {
    if (!exact_) make_exact();
    return *exact_;
  }

  void make_exact() {
    exact_ = ExactPlaneHit(ray_->o, ray_->d, triangle_->corners()).t();
    lo_ = hi_ = nearest_double(*exact_);
    widen();
  }

  // A few roundings of the bounds themselves; t is far from underflow unless it is 0.
  void widen() {
    lo_ -= 1e-15 * std::abs(lo_);
    hi_ += 1e-15 * std::abs(hi_);
  }

  const ExactRay* ray_ = nullptr;
  const Triangle* triangle_ = nullptr;
  double lo_ = infinity;
  double hi_ = infinity;
  std::optional<Ratio> exact_;
};

// The part of the ray in a box, never too short. A coordinate of the box less one of the origin,
// times the inverse, is one slab's t with three roundings, a relative error below 4e-16 and no
// underflow; the padding is far above it at any distance.
constexpr double relative_padding = 1e-12;

struct Interval {
  double lo;
  double hi;
};

Interval clip(const ExactRay& ray, const FloatBox& box) {
  Interval part{-infinity, infinity};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double below = static_cast<double>(box.lo[axis]) - ray.o[axis];
    const double above = static_cast<double>(box.hi[axis]) - ray.o[axis];
    if (ray.d[axis] == 0.0) {
      if (below > 0.0 || above < 0.0) return {infinity, -infinity};
      continue;
    }
    const double t0 = below * ray.inverse[axis];
    const double t1 = above * ray.inverse[axis];
    part.lo = std::max(part.lo, std::min(t0, t1));
    part.hi = std::min(part.hi, std::max(t0, t1));
  }
  part.lo -= relative_padding * std::abs(part.lo);
  part.hi += relative_padding * std::abs(part.hi);
  return part;
}

class TreeMaker {
 public:
  TreeMaker(std::span<Triangle> triangles, std::vector<BoxNode>& nodes)
      : triangles_(triangles), nodes_(nodes) {}

  // Splits the range at the median along the longest side of its centres' box; the depth is the
  // logarithm of the count.
  std::uint32_t split(std::uint32_t begin, std::uint32_t end) {
    int axis = 0;
    float longest = -1.0F;
    for (int candidate = 0; candidate < 3; ++candidate) {
      float lo = std::numeric_limits<float>::infinity();
      float hi = -lo;
      for (std::uint32_t i = begin; i < end; ++i) {
        lo = std::min(lo, triangles_[i].centre(candidate));
        hi = std::max(hi, triangles_[i].centre(candidate));
      }
      if (hi - lo > longest) {
        longest = hi - lo;
        axis = candidate;
      }
    }
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(
        triangles_.begin() + begin, triangles_.begin() + middle, triangles_.begin() + end,
        [axis](const Triangle& a, const Triangle& b) { return a.centre(axis) < b.centre(axis); });
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    nodes_.emplace_back();
    child(index, 0, begin, middle);
    child(index, 1, middle, end);
    return index;
  }

 private:
  void child(std::uint32_t parent, std::size_t which, std::uint32_t begin, std::uint32_t end) {
    BoxNode node = nodes_[parent];
    if (end - begin <= leaf_size) {
      for (std::uint32_t i = begin; i < end; ++i) {
        for (const auto& corner : triangles_[i].corner) grow(node.box[which], corner, corner);
      }
      node.first[which] = begin;
      node.count[which] = end - begin;
    } else {
      const std::uint32_t below = split(begin, end);
      for (const FloatBox& box : nodes_[below].box) grow(node.box[which], box.lo, box.hi);
      node.first[which] = below;
      node.count[which] = 0;
    }
    nodes_[parent] = node;
  }

  static void grow(FloatBox& box, const float (&lo)[3], const float (&hi)[3]) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.lo[axis] = std::min(box.lo[axis], lo[axis]);
      box.hi[axis] = std::max(box.hi[axis], hi[axis]);
    }
  }

  std::span<Triangle> triangles_;
  std::vector<BoxNode>& nodes_;
};

}  // namespace

const char* to_string(HitClass value) noexcept {
  switch (value) {
    case HitClass::interior:
      return "interior";
    case HitClass::edge:
      return "edge";
    case HitClass::vertex:
      return "vertex";
    case HitClass::duplicate:
      return "duplicate";
  }
  return "?";
}

bool degenerate(const Ray& ray) noexcept {
  bool zero = true;
  for (glm::vec3::length_type axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(ray.origin[axis]) || !std::isfinite(ray.direction[axis])) return true;
    zero = zero && ray.direction[axis] == 0.0F;
  }
  return zero || !(ray.t_min <= ray.t_max);
}

struct Oracle::Scene {
  std::vector<Triangle> triangles;
  std::vector<BoxNode> nodes;  // empty: every query is a loop over all triangles
  double largest = 0.0;        // magnitude of a coordinate
  ExactBox box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};

  // Calls visit(triangle) for every triangle that the ray may meet at t <= t_far, near boxes first;
  // visit may lower t_far, and ends the walk by returning true.
  template <class Visit>
  void walk(const ExactRay& ray, const double& t_far, Visit&& visit) const {
    if (nodes.empty()) {
      for (const Triangle& triangle : triangles) {
        if (visit(triangle)) return;
      }
      return;
    }
    struct Entry {
      std::uint32_t first;
      std::uint32_t count;
      double t;
    };
    Entry stack[64];
    int depth = 0;
    stack[depth++] = {0, 0, -infinity};
    while (depth > 0) {
      const Entry entry = stack[--depth];
      if (entry.t > t_far) continue;
      if (entry.count > 0) {
        for (std::uint32_t i = 0; i < entry.count; ++i) {
          if (visit(triangles[entry.first + i])) return;
        }
        continue;
      }
      const BoxNode& node = nodes[entry.first];
      const Interval part[2] = {clip(ray, node.box[0]), clip(ray, node.box[1])};
      const std::size_t near = part[1].lo < part[0].lo ? 1 : 0;
      for (const std::size_t which : {1 - near, near}) {
        if (part[which].lo <= part[which].hi && part[which].lo <= t_far &&
            part[which].hi >= ray.t_min) {
          stack[depth++] = {node.first[which], node.count[which], part[which].lo};
        }
      }
    }
  }
};

Oracle::Oracle(const TriangleView& triangles, Search search) {
  auto scene = std::make_unique<Scene>();
  scene->triangles.reserve(triangles.triangle_count);
  for (std::size_t i = 0; i < triangles.triangle_count; ++i) {
    const std::optional<Corners> corners = finite_corners(triangles, i);
    if (!corners || exact_zero_area(*corners)) continue;
    Triangle triangle{};
    for (int corner = 0; corner < 3; ++corner) {
      const float* position = triangles.position(triangles.index(i, corner));
      std::copy_n(position, 3, triangle.corner[corner]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto x = static_cast<double>(position[axis]);
        scene->largest = std::max(scene->largest, std::abs(x));
        scene->box.lo[axis] = std::min(scene->box.lo[axis], x);
        scene->box.hi[axis] = std::max(scene->box.hi[axis], x);
      }
    }
    triangle.id = static_cast<std::uint32_t>(i);
    scene->triangles.push_back(triangle);
  }
  const std::size_t count = scene->triangles.size();
  if (search == Search::automatic) {
    search = count > brute_force_limit ? Search::box_tree : Search::brute_force;
  }
  if (search == Search::box_tree && count > 1) {
    TreeMaker(scene->triangles, scene->nodes).split(0, static_cast<std::uint32_t>(count));
  }
  scene_ = std::move(scene);
}

Oracle::Oracle(Oracle&&) noexcept = default;
Oracle& Oracle::operator=(Oracle&&) noexcept = default;
Oracle::~Oracle() = default;

ExactHit Oracle::closest_hit(const Ray& ray) const {
  ExactHit hit;
  hit.t = infinity;
  if (degenerate(ray)) return hit;
  const ExactRay exact_ray(ray);
  HitDistance nearest;
  double t_far = exact_ray.t_max;
  bool any_interior = false;
  bool any_vertex = false;
  scene_->walk(exact_ray, t_far, [&](const Triangle& triangle) {
    const Place where = place(exact_ray, triangle);
    if (where == Place::outside) return false;
    HitDistance distance(exact_ray, triangle);
    if (!distance.within(exact_ray.t_min, exact_ray.t_max)) return false;
    const int order = hit.hit ? distance.compare(nearest) : -1;
    if (order > 0) return false;
    if (order < 0) {
      hit.hit = true;
      hit.ties.clear();
      any_interior = any_vertex = false;
      nearest = std::move(distance);
      t_far = std::min(t_far, nearest.hi());
    }
    hit.ties.push_back(triangle.id);
    any_interior = any_interior || where == Place::interior;
    any_vertex = any_vertex || where == Place::vertex;
    return false;
  });
  if (!hit.hit) return hit;
  hit.t = nearest.nearest();
  std::sort(hit.ties.begin(), hit.ties.end());
  if (any_interior) {
    hit.hit_class = hit.ties.size() > 1 ? HitClass::duplicate : HitClass::interior;
  } else {
    hit.hit_class = any_vertex ? HitClass::vertex : HitClass::edge;
  }
  return hit;
}

double Oracle::lost_by_scaling() const {
  return scene_->largest > 0x1p32 ? 0x1p-149 * scene_->largest : 0.0;
}

const ExactBox& Oracle::box() const { return scene_->box; }

double Oracle::largest_coordinate() const { return scene_->largest; }

bool Oracle::any_hit(const Ray& ray) const {
  if (degenerate(ray)) return false;
  const ExactRay exact_ray(ray);
  bool found = false;
  scene_->walk(exact_ray, exact_ray.t_max, [&](const Triangle& triangle) {
    found = place(exact_ray, triangle) != Place::outside &&
            HitDistance(exact_ray, triangle).within(exact_ray.t_min, exact_ray.t_max);
    return found;
  });
  return found;
}

std::vector<std::uint32_t> Oracle::all_hits(const Ray& ray) const {
  std::vector<std::uint32_t> ids;
  if (degenerate(ray)) return ids;
  const ExactRay exact_ray(ray);
  scene_->walk(exact_ray, exact_ray.t_max, [&](const Triangle& triangle) {
    if (place(exact_ray, triangle) != Place::outside &&
        HitDistance(exact_ray, triangle).within(exact_ray.t_min, exact_ray.t_max)) {
      ids.push_back(triangle.id);
    }
    return false;
  });
  std::sort(ids.begin(), ids.end());
  return ids;
}

}  // namespace zkd::verify
