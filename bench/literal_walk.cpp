// SPDX-License-Identifier: Apache-2.0
//
// The walk and the cost. Compiled without contraction, as the library is; tree and ray are the
// library's too.
#include "literal_walk.hpp"

#include <cstddef>
#include <vector>

#include <zkd/traversal/traverse.hpp>

#include "cpu/threads.hpp"

namespace zkd::bench {
namespace {

using core::PreparedRay;
using core::Real;
using Intersect = core::Watertight;
using Candidate = Intersect::Candidate;

constexpr std::uint32_t rays_at_once = 64;

struct Waiting {
  Link link;
  Real near;
  Real far;
};

// The part of the ray inside the scene box; nothing where it passes beside.
bool clip_to_scene(const TreeView& tree, const PreparedRay& ray, Real& near, Real& far) {
  const Box bounds = tree.bounds();
  const Real scale = tree.scale();
  for (int a = 0; a < 3; ++a) {
    const bool negative = ray.is_negative(static_cast<std::uint32_t>(a));
    const Real low = Real(bounds.lo[a]) * scale;
    const Real high = Real(bounds.hi[a]) * scale;
    near = core::larger(near, ((negative ? high : low) - ray.origin[a]) * ray.inverse[a]);
    far = core::smaller(far, ((negative ? low : high) - ray.origin[a]) * ray.inverse[a]);
  }
  return near <= far;
}

// Kaplan's walk over the planes of a kd-tree: cells front to back, each an interval of t.
Candidate walk(const TreeView& tree, const TriangleView& triangles, const PreparedRay& ray,
               const Intersect& intersect, TraversalCost& cost) {
  Candidate best;
  Real near = ray.first;
  Real far = ray.last;
  if (!clip_to_scene(tree, ray, near, far)) return best;
  Waiting stack[max_depth + 1];
  std::size_t waiting = 0;
  Link link = tree.root();
  for (;;) {
    while (!link.is_leaf()) {
      const Node& node = tree.nodes[link.index()];
      ++cost.node_visits;
      const Real at = (Real(node.plane) - core::element(ray.origin, node.axis)) *
                      core::element(ray.inverse, node.axis);
      const bool negative = ray.is_negative(node.axis);
      const Link first = node.child[negative ? 1 : 0];
      const Link second = node.child[negative ? 0 : 1];
      if (at > far) {
        link = first;
      } else if (at < near) {
        link = second;
      } else {
        stack[waiting++] = {second, at, far};
        link = first;
        far = at;
      }
    }
    const std::uint32_t leaf = link.index();
    cost.triangle_tests += tree.leaf_offsets[leaf + 1] - tree.leaf_offsets[leaf];
    if (intersect_within(tree, triangles, intersect, leaf, near, far, best)) return best;
    if (waiting == 0) return best;
    const Waiting& next = stack[--waiting];
    link = next.link;
    near = next.near;
    far = next.far;
  }
}

double area_of(const Box& box) {
  double side[3];
  for (int a = 0; a < 3; ++a)
    side[a] = static_cast<double>(box.hi[a]) - static_cast<double>(box.lo[a]);
  return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

}  // namespace

bool intersect_within(const TreeView& tree, const TriangleView& triangles,
                      const Intersect& intersect, std::uint32_t leaf, Real near, Real far,
                      Candidate& best) {
  bool found = false;
  for (std::uint32_t r = tree.leaf_offsets[leaf]; r < tree.leaf_offsets[leaf + 1]; ++r) {
    const std::uint32_t id = tree.references[r];
    Candidate candidate = best;
    if (!intersect(core::corners_of(triangles, id), id, candidate)) continue;
    const Real t = static_cast<float>(candidate.t.value);
    if (!(near <= t && t <= far)) continue;
    best = candidate;
    found = true;
  }
  return found;
}

void closest_hit_literally(const cpu::Executor& executor, const TreeView& tree,
                           const TriangleView& triangles, std::span<const Ray> rays,
                           std::span<Hit> hits, std::span<TraversalCost> costs) {
  const auto count = static_cast<std::uint32_t>(rays.size());
  cpu::Threads(executor).share(count, rays_at_once, [=](cpu::Range range) {
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const PreparedRay prepared(tree, rays[i], Intersect::hit_distance);
      TraversalCost cost;
      hits[i] =
          prepared.valid
              ? core::to_hit(walk(tree, triangles, prepared, Intersect(prepared, rays[i]), cost))
              : Hit{};
      if (!costs.empty()) costs[i] = cost;
    }
  });
}

double sah_cost_of_cells(const TreeView& tree) {
  if (tree.empty()) return 0.0;
  struct Cell {
    Link link;
    Box box;
  };
  Cell root{tree.root(), tree.bounds()};
  for (int a = 0; a < 3; ++a) {
    root.box.lo[a] *= tree.scale();
    root.box.hi[a] *= tree.scale();
  }
  const double whole = area_of(root.box);
  double sum = 0.0;
  std::vector<Cell> stack{root};
  while (!stack.empty()) {
    const Cell cell = stack.back();
    stack.pop_back();
    if (cell.link.is_leaf()) {
      const std::uint32_t leaf = cell.link.index();
      sum += area_of(cell.box) * (tree.leaf_offsets[leaf + 1] - tree.leaf_offsets[leaf]);
      continue;
    }
    sum += area_of(cell.box);
    const Node& node = tree.nodes[cell.link.index()];
    Cell below{node.child[0], cell.box};
    Cell above{node.child[1], cell.box};
    below.box.hi[node.axis] = node.plane;
    above.box.lo[node.axis] = node.plane;
    stack.push_back(below);
    stack.push_back(above);
  }
  return whole > 0.0 ? sum / whole : 0.0;
}

}  // namespace zkd::bench
