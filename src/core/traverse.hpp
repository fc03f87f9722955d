// SPDX-License-Identifier: Apache-2.0
//
// A ray's walk through the finished tree: near child first, boxes padded, a hit accepted wherever
// it lies in the ray's interval.
//
// Nothing here decides an answer: a box only says what may be left out. Closest hit is the nearest
// of all candidates in the leaves visited, in whatever order; so the walk may use fast arithmetic.
#pragma once

#include <cstdint>

#include <zkd/query.hpp>
#include <zkd/tree.hpp>

#include "core/intersect.hpp"
#include "core/key.hpp"
#include "core/ray.hpp"

namespace zkd::core {

/// Where a ray enters a child's box, and whether it does.
struct Entry {
  float t;
  bool hit;
};

ZKD_HOST_DEVICE inline Entry enter(const PreparedRay& ray, const Node& node, std::uint32_t child,
                                   Real last) {
  Real near = ray.first;
  Real far = last;
  for (int a = 0; a < 3; ++a) {
    const float* bounds = node.bounds[a];
    const Real at_near = bounds[child + 2 * ray.negative[a]];
    const Real at_far = bounds[child + 2 * (1 - ray.negative[a])];
    near = larger(near, (at_near - ray.origin[a]) * ray.inverse[a] - ray.padding[a]);
    far = smaller(far, (at_far - ray.origin[a]) * ray.inverse[a] + ray.padding[a]);
  }
  return {near.value, near <= far};
}

/// Walks the tree. With `any`, stops at the first hit.
template <bool any>
ZKD_HOST_DEVICE inline Candidate traverse(const TreeView& tree, const TriangleView& triangles,
                                          const PreparedRay& ray, TraversalCost* cost) {
  struct Waiting {  // without initialisers: a stack of them costs nothing
    std::uint32_t link;
    float t;
  };
  Waiting stack[max_depth];
  std::uint32_t waiting = 0;
  Candidate best;
  Link link = tree.root;
  std::uint32_t node_visits = 0;
  std::uint32_t triangle_tests = 0;

  for (;;) {
    bool reached = true;
    while (!link.is_leaf()) {
      ++node_visits;
      const Node& node = tree.nodes[link.index()];
      const Real last = smaller(ray.last, best.t);
      const Entry lower = enter(ray, node, 0, last);
      const Entry upper = enter(ray, node, 1, last);
      if (lower.hit && upper.hit) {
        const bool upper_first =
            upper.t < lower.t || (upper.t == lower.t && ray.negative[node.axis] != 0);
        const std::uint32_t near = upper_first ? 1 : 0;
        stack[waiting++] = {node.child[1 - near].bits, upper_first ? lower.t : upper.t};
        link = node.child[near];
      } else if (lower.hit) {
        link = node.child[0];
      } else if (upper.hit) {
        link = node.child[1];
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
        if (intersect(ray, corners_of(triangles, id), id, best) && any) {
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
    } while (stack[waiting].t > best.t.value);
  }
}

template <bool any>
ZKD_HOST_DEVICE inline Candidate trace(const TreeView& tree, const TriangleView& triangles,
                                       const Ray& ray, TraversalCost* cost) {
  const PreparedRay prepared(tree, ray);
  if (prepared.valid) return traverse<any>(tree, triangles, prepared, cost);
  if (cost != nullptr) *cost = {};
  return {};
}

ZKD_HOST_DEVICE inline Hit to_hit(const Candidate& candidate) {
  if (!candidate.found()) return {};
  return {candidate.callers_t, candidate.u, candidate.v, candidate.triangle};
}

}  // namespace zkd::core
