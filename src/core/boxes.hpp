// SPDX-License-Identifier: Apache-2.0
//
// Stage 11, tight boxes: what is really inside each child, from the leaves up. The last child to
// arrive at a node goes on (Karras 2012; Apetrei 2014).
#pragma once

#include <cstdint>

#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>
#include <zkd/tree.hpp>

#include "core/compress.hpp"
#include "core/frame.hpp"

namespace zkd::core {

/// Cuts the cell of a leaf out of the scene box: each of its six sides is the first plane met on
/// the way up that bounds that side, since planes met later lie farther out.
ZKD_HOST_DEVICE inline Box leaf_cell(const Node* nodes, const Parent* parents_of_nodes,
                                     Parent parent, const Box& bounds) {
  Box cell = bounds;
  std::uint32_t open_sides = 0x3F;
  while (!parent.is_none() && open_sides != 0) {
    const Node& node = nodes[parent.node()];
    const std::uint32_t lower = parent.side();
    const std::uint32_t bit = 1u << (2 * node.axis + lower);
    if ((open_sides & bit) != 0) {
      open_sides &= ~bit;
      if (lower != 0)
        cell.lo[node.axis] = node.plane;
      else
        cell.hi[node.axis] = node.plane;
    }
    parent = parents_of_nodes[parent.node()];
  }
  return cell;
}

/// What `climb` does at a leaf and at each node it is the last to reach. Both write the box they
/// made into the parent, and return the way up to it.
struct TightBoxes {
  const Box* boxes;  ///< of triangles, in the caller's units
  const std::uint32_t* leaf_offsets;
  const std::uint32_t* references;
  const Parent* parents_of_nodes;
  const Parent* parents_of_leaves;
  const SceneFrame* frame;
  bool clip;  ///< `all`: a leaf's box is what lies in its cell
  Node* nodes;

  ZKD_HOST_DEVICE Parent leave(Parent parent, const Box& box) const {
    if (!parent.is_none()) {
      Node& node = nodes[parent.node()];
      for (int a = 0; a < 3; ++a) {
        node.bounds[a][parent.side()] = box.lo[a];
        node.bounds[a][2 + parent.side()] = box.hi[a];
      }
    }
    return parent;
  }

  /// Announces that begin(leaf) will follow: boxes lie in the order of the input, not of leaves.
  [[gnu::always_inline]] void prefetch(std::uint32_t leaf) const {
    for (std::uint32_t r = leaf_offsets[leaf]; r < leaf_offsets[leaf + 1]; ++r)
      __builtin_prefetch(boxes + references[r]);
  }

  ZKD_HOST_DEVICE Parent begin(std::uint32_t leaf) const {
    const Parent parent = parents_of_leaves[leaf];
    Box cell;
    if (clip) cell = leaf_cell(nodes, parents_of_nodes, parent, frame->bounds);
    const float scale = static_cast<float>(frame->scale);
    Box box;
    for (std::uint32_t r = leaf_offsets[leaf]; r < leaf_offsets[leaf + 1]; ++r) {
      const Box& triangle = boxes[references[r]];
      Box inside;
      for (int a = 0; a < 3; ++a) {
        // Adding +0 turns a -0 from underflow into +0: boxes do not depend on what came first.
        inside.lo[a] = triangle.lo[a] * scale + 0.0F;
        inside.hi[a] = triangle.hi[a] * scale + 0.0F;
        if (clip) {
          inside.lo[a] = larger(inside.lo[a], cell.lo[a]);
          inside.hi[a] = smaller(inside.hi[a], cell.hi[a]);
        }
      }
      include(box, inside);
    }
    return leave(parent, box);
  }

  ZKD_HOST_DEVICE Parent rise(std::uint32_t index) const {
    const Node& node = nodes[index];
    Box box;
    for (int a = 0; a < 3; ++a) {
      box.lo[a] = smaller(node.bounds[a][0], node.bounds[a][1]);
      box.hi[a] = larger(node.bounds[a][2], node.bounds[a][3]);
    }
    return leave(parents_of_nodes[index], box);
  }
};

}  // namespace zkd::core
