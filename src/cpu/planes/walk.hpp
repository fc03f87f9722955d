// SPDX-License-Identifier: Apache-2.0
//
// A ray's walk over the planes of a strict tree (Kaplan 1985; Havran 2000, section 4.4): of a
// node's two cells first the one that the ray comes from, each with the interval in which the ray
// may have a hit there.
//
// Planes are padded as boxes are (docs/accuracy.md, "Plane trees"): an interval is what
// core::BoxTest would find of the cell. So a triangle that lies in two cells may be hit in either,
// or in both; which hit is nearest is decided as everywhere.
#pragma once

#include <bit>
#include <cstdint>

#include <zkd/cpu/plane_tree.hpp>
#include <zkd/traversal/candidate.hpp>
#include <zkd/traversal/ray.hpp>
#include <zkd/traversal/triangle.hpp>

namespace zkd::cpu {

/// Where a ray meets planes, moved outwards.
class PlaneTest {
 public:
  explicit PlaneTest(const core::PreparedRay& ray) : ray_(ray) {}

  /// Nothing that lies behind the plane along the ray is hit before this.
  [[nodiscard]] core::Real enters(float plane, std::uint32_t axis) const {
    return distance(plane, axis) - core::element(ray_.padding, axis);
  }
  /// Nothing that lies before it is hit after this.
  [[nodiscard]] core::Real leaves(float plane, std::uint32_t axis) const {
    return (distance(plane, axis) + core::element(ray_.padding, axis)) * ray_.far_slack;
  }

 private:
  [[nodiscard]] core::Real distance(float plane, std::uint32_t axis) const {
    return (core::Real(plane) - core::element(ray_.origin, axis)) *
           core::element(ray_.inverse, axis);
  }

  const core::PreparedRay& ray_;
};

/// Walks the tree. With `any`, stops at the first hit.
template <bool any, class Intersect>
inline typename Intersect::Candidate walk(const PlaneTreeView& tree, const TriangleView& triangles,
                                          const core::PreparedRay& ray, const Intersect& intersect,
                                          TraversalCost* cost) {
  using core::larger;
  using core::Real;
  using core::smaller;
  const PlaneTest test(ray);
  struct Waiting {  // without initialisers: a stack of them costs nothing
    std::uint32_t node;
    float enter;
    float leave;
  };
  Waiting stack[max_depth];
  std::uint32_t waiting = 0;
  typename Intersect::Candidate best;
  std::uint32_t node_visits = 0;
  std::uint32_t triangle_tests = 0;

  Real enter = ray.first;
  Real leave = ray.last;
  for (std::uint32_t a = 0; a < 3; ++a) {
    const bool negative = ray.is_negative(a);
    enter = larger(enter, test.enters(negative ? tree.bounds.hi[a] : tree.bounds.lo[a], a));
    leave = smaller(leave, test.leaves(negative ? tree.bounds.lo[a] : tree.bounds.hi[a], a));
  }
  std::uint32_t index = 0;
  bool reached = enter <= leave;
  for (;;) {
    while (reached && !tree.nodes[index].is_leaf()) {
      ++node_visits;
      const PlaneNode& node = tree.nodes[index];
      const std::uint32_t axis = node.axis();
      const auto plane = std::bit_cast<float>(node.value);
      const bool negative = ray.is_negative(axis);
      const std::uint32_t near = negative ? node.above_or_count() : index + 1;
      const std::uint32_t far = negative ? index + 1 : node.above_or_count();
      const Real near_leave = smaller(leave, test.leaves(plane, axis));
      const Real far_enter = larger(enter, test.enters(plane, axis));
      const bool into_far = far_enter <= leave;
      if (enter <= near_leave) {
        if (into_far) stack[waiting++] = {far, far_enter.value, leave.value};
        index = near;
        leave = near_leave;
      } else {
        reached = into_far;
        index = far;
        enter = far_enter;
      }
    }
    if (reached) {
      const PlaneNode& leaf = tree.nodes[index];
      const std::uint32_t end = leaf.value + leaf.above_or_count();
      for (std::uint32_t r = leaf.value; r < end; ++r) {
        const std::uint32_t id = tree.references[r];
        ++triangle_tests;
        if (intersect(core::corners_of(triangles, id), id, best) && any) {
          waiting = 0;
          break;
        }
      }
    }
    // What waits begins in order, but for the padding: none behind the best hit ends the walk.
    do {
      if (waiting == 0) {
        if (cost != nullptr) *cost = {node_visits, triangle_tests};
        return best;
      }
      const Waiting& next = stack[--waiting];
      index = next.node;
      enter = next.enter;
      leave = smaller(Real(next.leave), best.limit);
    } while (!(enter <= leave));
    reached = true;
  }
}

}  // namespace zkd::cpu
