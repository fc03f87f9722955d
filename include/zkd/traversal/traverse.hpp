// SPDX-License-Identifier: Apache-2.0
//
// A ray's walk through the finished tree: near child first, boxes padded, a hit accepted wherever
// it lies in the ray's interval.
//
// Nothing here decides an answer: a box only says what may be left out. Closest hit is the nearest
// of all candidates in the leaves visited, in whatever order; so a backend may test boxes with its
// own arithmetic, within their padding. For device code and the library: see arithmetic.hpp.
#pragma once

#include <cstdint>

#include <zkd/query.hpp>
#include <zkd/traversal/candidate.hpp>
#include <zkd/traversal/intersect.hpp>
#include <zkd/traversal/ray.hpp>
#include <zkd/traversal/triangle.hpp>
#include <zkd/tree.hpp>

namespace zkd::core {

/// Where a ray enters the boxes of a node's two children, and which of them it meets.
struct Entries {
  float t[2];
  std::uint32_t hit;  ///< bit 0: child 0, bit 1: child 1

  /// Of two children that are met, the one that is entered first.
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t near(const Node& node, const PreparedRay& ray) const {
    return t[1] < t[0] || (t[1] == t[0] && ray.is_negative(node.axis)) ? 1 : 0;
  }
};

/// A ray against the two boxes of a node. A backend may bring its own, and its own way to read a
/// node.
class BoxTest {
 public:
  ZKD_HOST_DEVICE explicit BoxTest(const PreparedRay& ray) : ray_(ray) {}

  [[nodiscard]] static ZKD_HOST_DEVICE const Node& read(const Node& node) { return node; }

  /// `last`: nothing behind it is of interest any more.
  ZKD_HOST_DEVICE Entries operator()(const Node& node, Real last) const {
    Real near[2] = {ray_.first, ray_.first};
    constexpr float largest = 3.4028234663852886e38F;
    Real far[2] = {largest, largest};
    for (std::uint32_t a = 0; a < 3; ++a) {
      const float* at_near = node.bounds[a] + (ray_.is_negative(a) ? 2 : 0);
      const float* at_far = node.bounds[a] + (ray_.is_negative(a) ? 0 : 2);
      for (int child = 0; child < 2; ++child) {
        near[child] =
            larger(near[child],
                   (Real(at_near[child]) - ray_.origin[a]) * ray_.inverse[a] - ray_.padding[a]);
        far[child] = smaller(
            far[child], (Real(at_far[child]) - ray_.origin[a]) * ray_.inverse[a] + ray_.padding[a]);
      }
    }
    for (Real& leaving : far) leaving = smaller(leaving * ray_.far_slack, last);
    return {{near[0].value, near[1].value},
            (near[0] <= far[0] ? 1u : 0u) | (near[1] <= far[1] ? 2u : 0u)};
  }

 private:
  const PreparedRay& ray_;
};

/// Walks the tree. With `any`, stops at the first hit.
template <bool any, class Boxes, class Intersect>
ZKD_HOST_DEVICE inline typename Intersect::Candidate traverse(const TreeView& tree,
                                                              const TriangleView& triangles,
                                                              const PreparedRay& ray,
                                                              const Intersect& intersect,
                                                              TraversalCost* cost) {
  const Boxes boxes(ray);
  struct alignas(8) Waiting {  // without initialisers: a stack of them costs nothing
    std::uint32_t link;
    float t;
  };
  Waiting stack[max_depth];
  std::uint32_t waiting = 0;
  typename Intersect::Candidate best;
  Link link = tree.root();
  std::uint32_t node_visits = 0;
  std::uint32_t triangle_tests = 0;

  for (;;) {
    bool reached = true;
    while (!link.is_leaf()) {
      ++node_visits;
      const auto& node = Boxes::read(tree.nodes[link.index()]);
      const Real last = smaller(ray.last, best.limit);
      const Entries entries = boxes(node, last);
      if (entries.hit == 3) {
        const std::uint32_t near = entries.near(node, ray);
        stack[waiting++] = {element(node.child, 1 - near).bits, element(entries.t, 1 - near)};
        link = element(node.child, near);
      } else if (entries.hit != 0) {
        link = element(node.child, entries.hit - 1);
      } else {
        reached = false;
        break;
      }
    }
    if (reached) {
      const std::uint32_t end = tree.leaf_offsets[link.index() + 1];
      for (std::uint32_t r = tree.leaf_offsets[link.index()]; r < end; ++r) {
        const std::uint32_t id = tree.references[r];
        ++triangle_tests;
        if (intersect(corners_of(triangles, id), id, best) && any) {
          waiting = 0;
          break;
        }
      }
    }
    // A waiting entry behind the best hit is passed over, not taken as the end: entries do not wait
    // in order of t.
    do {
      if (waiting == 0) {
        if (cost != nullptr) *cost = {node_visits, triangle_tests};
        return best;
      }
      link = Link{stack[--waiting].link};
    } while (stack[waiting].t > best.limit.value);
  }
}

template <bool any, class Boxes, class Intersect>
ZKD_HOST_DEVICE inline typename Intersect::Candidate trace(const TreeView& tree,
                                                           const TriangleView& triangles,
                                                           const Ray& ray, TraversalCost* cost) {
  const PreparedRay prepared(tree, ray, Intersect::hit_distance);
  if (prepared.valid) {
    const Intersect intersect(prepared, ray);
    return traverse<any, Boxes>(tree, triangles, prepared, intersect, cost);
  }
  if (cost != nullptr) *cost = {};
  return {};
}

/// A step of a loop over all triangles: `best` becomes the hit on this one, if that comes before.
template <class Intersect>
ZKD_HOST_DEVICE inline void test_in_loop(const Intersect& intersect, const Corners& corners,
                                         std::uint32_t id, typename Intersect::Candidate& best) {
  typename Intersect::Candidate candidate = best;
  // What a build leaves out may still seem to be hit, by rounding: it is looked at only then.
  if (intersect(corners, id, candidate) && is_valid(corners)) best = candidate;
}

/// The nearest hit by a loop over all triangles. A ray is prepared by the tree's bounds and scale,
/// as for a walk.
template <class Intersect>
ZKD_HOST_DEVICE inline typename Intersect::Candidate trace_brute_force(
    const TreeView& tree, const TriangleView& triangles, const Ray& ray) {
  const PreparedRay prepared(tree, ray, Intersect::hit_distance);
  const Intersect intersect(prepared, ray);
  typename Intersect::Candidate best;
  for (std::uint32_t id = 0; prepared.valid && id < triangles.triangle_count; ++id)
    test_in_loop(intersect, corners_of(triangles, id), id, best);
  return best;
}

}  // namespace zkd::core
