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
#include "core/listed_parts.hpp"

namespace zkd::core {

/// What `climb` does at a leaf and at each node it is the last to reach. Both write the box they
/// made into the parent, and return the way up to it.
struct TightBoxes {
  const Box* boxes;  ///< of triangles, in the caller's units
  const std::uint32_t* leaf_offsets;
  const std::uint32_t* references;
  const Parent* parents_of_nodes;
  const Parent* parents_of_leaves;
  const SceneFrame* frame;
  ListedParts listed;            ///< `all`: what lies in the cells; else nothing
  const std::uint32_t* numbers;  ///< of references among those; null: 0, 1, 2, ...
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
    if (listed.inside != nullptr) {
      if (numbers == nullptr) return;  // they lie in the order of the leaves
      for (std::uint32_t r = leaf_offsets[leaf]; r < leaf_offsets[leaf + 1]; ++r)
        __builtin_prefetch(&listed.box(numbers[r]));
      return;
    }
    for (std::uint32_t r = leaf_offsets[leaf]; r < leaf_offsets[leaf + 1]; ++r)
      __builtin_prefetch(boxes + references[r]);
  }

  ZKD_HOST_DEVICE Parent begin(std::uint32_t leaf) const {
    const Parent parent = parents_of_leaves[leaf];
    Box box;
    if (listed.inside != nullptr) {
      for (std::uint32_t r = leaf_offsets[leaf]; r < leaf_offsets[leaf + 1]; ++r)
        include(box, listed.box(numbers != nullptr ? numbers[r] : r));
      return leave(parent, box);
    }
    const float scale = static_cast<float>(frame->scale);
    for (std::uint32_t r = leaf_offsets[leaf]; r < leaf_offsets[leaf + 1]; ++r) {
      const Box& triangle = boxes[references[r]];
      Box placed;
      for (int a = 0; a < 3; ++a) {
        // Adding +0 turns a -0 from underflow into +0: boxes do not depend on what came first.
        placed.lo[a] = triangle.lo[a] * scale + 0.0F;
        placed.hi[a] = triangle.hi[a] * scale + 0.0F;
      }
      include(box, placed);
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
