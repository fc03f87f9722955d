// SPDX-License-Identifier: Apache-2.0
//
// A ray's walk through a wide tree: nearest child first, as in zkd/traversal/traverse.hpp.
//
// What may be left out is decided here by vectors: boxes by their padding ("Boxes" in
// docs/accuracy.md), triangles by the filter ("The filter"). What is left is put to the library's
// intersector one by one, so answers are those of the tree.
#pragma once

#include <bit>
#include <cstdint>

#include <zkd/cpu/wide_tree.hpp>
#include <zkd/traversal/candidate.hpp>
#include <zkd/traversal/ray.hpp>
#include <zkd/traversal/triangle.hpp>

namespace zkd::cpu {

/// Where a ray enters the boxes of a node, and bit i: it meets box i.
struct WideEntries {
  alignas(32) float t[wide];
  std::uint32_t hit;
};

/// Walks the tree. With `any`, stops at the first hit.
///
/// Boxes(ray)(node, last, entries) tests the boxes of a node, as core::BoxTest does;
/// Lanes(ray)(block) says which triangles of a block the ray may hit.
template <bool any, class Boxes, class Lanes, class Intersect>
inline typename Intersect::Candidate walk(const WideTreeView& tree, const core::PreparedRay& ray,
                                          const Intersect& intersect, TraversalCost* cost) {
  const Boxes boxes(ray);
  const Lanes lanes(ray);
  struct Waiting {  // without initialisers: a stack of them costs nothing
    std::uint32_t link;
    float t;
  };
  Waiting stack[std::size_t{max_depth} * (wide - 1) + wide];
  std::uint32_t waiting = 0;
  typename Intersect::Candidate best;
  Link link = tree.root();
  std::uint32_t node_visits = 0;
  std::uint32_t triangle_tests = 0;
  core::Real last = core::smaller(ray.last, best.limit);

  for (;;) {
    bool reached = true;
    while (!link.is_leaf()) {
      ++node_visits;
      const WideNode& node = tree.nodes[link.index()];
      WideEntries entries;
      boxes(node, last, entries);
      std::uint32_t hit = entries.hit;
      if (hit == 0) {
        reached = false;
        break;
      }
      auto near = static_cast<std::uint32_t>(std::countr_zero(hit));
      hit &= hit - 1;
      if (hit != 0) {
        // The nearest is kept in hand; the others are sorted in, the furthest first.
        Waiting* const begin = stack + waiting;
        Waiting* end = begin;
        Waiting nearest{node.child[near].bits, entries.t[near]};
        do {
          const auto i = static_cast<std::uint32_t>(std::countr_zero(hit));
          hit &= hit - 1;
          Waiting next{node.child[i].bits, entries.t[i]};
          if (next.t < nearest.t) std::swap(next, nearest);
          Waiting* place = end++;
          for (; place > begin && place[-1].t < next.t; --place) *place = place[-1];
          *place = next;
        } while (hit != 0);
        waiting = static_cast<std::uint32_t>(end - stack);
        link = Link{nearest.link};
      } else {
        link = node.child[near];
      }
    }
    if (reached) {
      const TriangleBlock* block = tree.blocks + link.index();
      for (;; ++block) {
        std::uint32_t left = lanes(*block);
        if (cost != nullptr)
          for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(wide); ++i)
            triangle_tests += block->id(i) != TriangleBlock::unused ? 1 : 0;
        bool done = false;
        for (; left != 0; left &= left - 1) {
          const auto lane = static_cast<std::uint32_t>(std::countr_zero(left));
          float corner[3][3];
          for (int c = 0; c < 3; ++c)
            for (int a = 0; a < 3; ++a) corner[c][a] = block->positions[c][a][lane];
          const core::Corners corners{{corner[0], corner[1], corner[2]}};
          if (intersect(corners, block->id(lane), best) && any) {
            done = true;
            break;
          }
        }
        if (done) {
          waiting = 0;
          break;
        }
        if (block->is_last()) break;
      }
      last = core::smaller(ray.last, best.limit);
    }
    // As in traverse(): what waits behind the best hit is passed over.
    do {
      if (waiting == 0) {
        if (cost != nullptr) *cost = {node_visits, triangle_tests};
        return best;
      }
      link = Link{stack[--waiting].link};
    } while (stack[waiting].t > best.limit.value);
  }
}

}  // namespace zkd::cpu
