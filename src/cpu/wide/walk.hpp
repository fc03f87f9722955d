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

/// A float as an integer of the same order. (Of the two zeros -0 is the lesser.)
inline std::int32_t ordered(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  return bits ^ ((bits >> 31) & 0x7FFFFFFF);
}

/// Where a ray enters the boxes of a node, as ordered(), and bit i: it meets box i.
struct WideEntries {
  alignas(32) std::int32_t t[wide];
  std::uint32_t hit;
};

/// A child that waits: where it is entered, then its link, in one number to be sorted by.
using Waiting = std::int64_t;
inline Waiting waiting_for(std::int32_t t, Link link) {
  return static_cast<Waiting>(static_cast<std::uint64_t>(static_cast<std::uint32_t>(t)) << 32 |
                              link.bits);
}
inline std::int32_t entry_of(Waiting child) { return static_cast<std::int32_t>(child >> 32); }
inline Link link_of(Waiting child) { return Link{static_cast<std::uint32_t>(child)}; }

/// Puts the nearer one behind: without a branch, since nobody could foretell it.
inline void order(Waiting& further, Waiting& nearer) {
  const Waiting a = further;
  const Waiting b = nearer;
  further = a < b ? b : a;
  nearer = a < b ? a : b;
}

/// Takes the next of the children that are hit.
inline Waiting take(const WideNode& node, const WideEntries& entries, std::uint32_t& hit) {
  const auto i = static_cast<std::uint32_t>(std::countr_zero(hit));
  hit &= hit - 1;
  return waiting_for(entries.t[i], node.child[i]);
}

/// Puts the children that are hit, two at least, on the stack, and returns the nearest instead.
inline Link put(const WideNode& node, const WideEntries& entries, Waiting*& top) {
  std::uint32_t hit = entries.hit;
  Waiting a = take(node, entries, hit);
  Waiting b = take(node, entries, hit);
  order(a, b);
  if (hit == 0) {
    *top++ = a;
    return link_of(b);
  }
  Waiting c = take(node, entries, hit);
  order(a, c);
  order(b, c);
  if (hit == 0) {
    *top++ = a;
    *top++ = b;
    return link_of(c);
  }
  Waiting* const begin = top;
  *top++ = a;
  *top++ = b;
  do {  // c is the nearest so far
    Waiting d = take(node, entries, hit);
    order(d, c);
    Waiting* place = top++;
    for (; place > begin && place[-1] < d; --place) *place = place[-1];
    *place = d;
  } while (hit != 0);
  return link_of(c);
}

/// Walks the tree. With `any`, stops at the first hit.
///
/// Boxes(ray)(node, last, entries) tests the boxes of a node, as core::BoxTest does;
/// Lanes(ray)(block) says which triangles of a block the ray may hit.
template <bool any, class Boxes, class Lanes, class Intersect>
inline typename Intersect::Candidate walk(const WideTreeView& tree, const core::PreparedRay& ray,
                                          const Intersect& intersect, TraversalCost* cost) {
  const Boxes boxes(ray);
  const Lanes lanes(ray);
  Waiting stack[std::size_t{max_depth} * (wide - 1) + wide];
  Waiting* top = stack;
  typename Intersect::Candidate best;
  Link link = tree.root();
  std::uint32_t node_visits = 0;
  std::uint32_t triangle_tests = 0;
  core::Real last = core::smaller(ray.last, best.limit);
  std::int32_t limit = ordered(best.limit.value);

  for (;;) {
    bool reached = true;
    while (!link.is_leaf()) {
      ++node_visits;
      const WideNode& node = tree.nodes[link.index()];
      WideEntries entries;
      boxes(node, last, entries);
      if (entries.hit == 0) {
        reached = false;
        break;
      }
      if ((entries.hit & (entries.hit - 1)) == 0)
        link = node.child[std::countr_zero(entries.hit)];
      else
        link = put(node, entries, top);
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
          top = stack;
          break;
        }
        if (block->is_last()) break;
      }
      last = core::smaller(ray.last, best.limit);
      limit = ordered(best.limit.value);
    }
    // As in traverse(): what waits behind the best hit is passed over.
    do {
      if (top == stack) {
        if (cost != nullptr) *cost = {node_visits, triangle_tests};
        return best;
      }
      link = link_of(*--top);
    } while (entry_of(*top) > limit);
  }
}

}  // namespace zkd::cpu
