// SPDX-License-Identifier: Apache-2.0
//
// Stage 10, references: which triangles each leaf lists. `once` lists a triangle where the sort put
// it. `all` lists it in every leaf cell it touches; this file finds those cells.
#pragma once

#include <cstdint>

#include <zkd/tree.hpp>

#include "core/arithmetic.hpp"
#include "core/key.hpp"
#include "core/lattice.hpp"
#include "core/search.hpp"
#include "core/validate.hpp"

namespace zkd::core {

/// A triangle in tree space, ready for overlap tests.
struct PlacedTriangle {
  double corner[3][3];
  double edge[3][3];
  double normal[3];
  double normal_size;  ///< sum of the magnitudes of the products that make the normal
  Box box;

  PlacedTriangle() = default;
  ZKD_HOST_DEVICE PlacedTriangle(const Corners& corners, double scale) {
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < 3; ++a) corner[i][a] = static_cast<double>(corners.p[i][a]) * scale;
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < 3; ++a) edge[i][a] = corner[(i + 1) % 3][a] - corner[i][a];
    normal_size = 0.0;
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      const int c = (a + 2) % 3;
      const double left = edge[0][b] * edge[1][c];
      const double right = edge[0][c] * edge[1][b];
      normal[a] = left - right;
      normal_size += magnitude(left) + magnitude(right);
      for (int i = 0; i < 3; ++i) {
        box.lo[a] = smaller(box.lo[a], static_cast<float>(corner[i][a]));
        box.hi[a] = larger(box.hi[a], static_cast<float>(corner[i][a]));
      }
    }
  }
};

/// Relative slack of the overlap test: a triangle is taken to touch a cell it misses by less than
/// this times the largest coordinate. Rounding moves a projection by less than 2^-49 of the
/// products that make it, so a triangle that touches is never lost.
inline constexpr double overlap_slack = 1.0e-14;

/// Whether a triangle touches a closed cell that its box touches (Akenine-Moller: Fast 3D
/// triangle-box overlap testing, 2001: separating axes), with overlap_slack. `largest` bounds the
/// magnitude of all coordinates.
ZKD_HOST_DEVICE inline bool touches(const PlacedTriangle& triangle, const Box& cell,
                                    double largest) {
  double half[3];
  double corner[3][3];
  for (int a = 0; a < 3; ++a) {
    const double lo = static_cast<double>(cell.lo[a]);
    const double hi = static_cast<double>(cell.hi[a]);
    const double middle = 0.5 * (lo + hi);
    half[a] = 0.5 * (hi - lo);
    for (int i = 0; i < 3; ++i) corner[i][a] = triangle.corner[i][a] - middle;
  }
  const double slack = overlap_slack * largest;

  double distance = 0.0;
  double reach = 4.0 * slack * triangle.normal_size;
  for (int a = 0; a < 3; ++a) {
    distance += triangle.normal[a] * corner[0][a];
    reach += half[a] * magnitude(triangle.normal[a]);
  }
  if (magnitude(distance) > reach) return false;

  for (int i = 0; i < 3; ++i) {
    const double* edge = triangle.edge[i];
    const double* on_edge = corner[i];
    const double* opposite = corner[(i + 2) % 3];
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      const int c = (a + 2) % 3;
      const double p = edge[b] * on_edge[c] - edge[c] * on_edge[b];
      const double q = edge[b] * opposite[c] - edge[c] * opposite[b];
      const double edge_reach = half[b] * magnitude(edge[c]) + half[c] * magnitude(edge[b]) +
                                4.0 * slack * (magnitude(edge[b]) + magnitude(edge[c]));
      if (smaller(p, q) > edge_reach || larger(p, q) < -edge_reach) return false;
    }
  }
  return true;
}

/// Whether a box stays within a cell along the two axes other than `axis`.
ZKD_HOST_DEVICE inline bool crosses_within(const Box& box, const Box& cell, std::uint32_t axis) {
  bool within = true;
  for (std::uint32_t a = 0; a < 3; ++a)
    within = within && (a == axis || (cell.lo[a] <= box.lo[a] && box.hi[a] <= cell.hi[a]));
  return within;
}

/// Walks the cells of a tree whose planes and links are finished, and calls visit(leaf) for every
/// leaf cell a triangle touches, in the order of the leaves.
struct CellWalk {
  TriangleView triangles;
  const Node* nodes;
  const Link* root;
  const SceneFrame* frame;

  struct Entry {
    Link link;
    Box cell;
  };

  template <class Visit>
  ZKD_HOST_DEVICE void operator()(std::uint32_t triangle, Visit& visit) const {
    const PlacedTriangle placed(corners_of(triangles, triangle), frame->scale);
    Entry stack[max_depth];
    std::uint32_t waiting = 0;
    const double largest = frame->largest;
    Entry at{*root, frame->bounds};
    for (;;) {
      bool dead_end = false;
      while (!at.link.is_leaf() && !dead_end) {
        const Node& node = nodes[at.link.index()];
        const std::uint32_t axis = node.axis;
        const bool below = placed.box.lo[axis] <= node.plane;
        const bool above = placed.box.hi[axis] >= node.plane;
        Entry upper = at;
        upper.link = node.child[1];
        upper.cell.lo[axis] = node.plane;
        at.link = node.child[0];
        at.cell.hi[axis] = node.plane;
        if (below && above) {
          // A triangle that crosses the plane where its box lies within the cell is on both sides.
          const bool within = crosses_within(placed.box, upper.cell, axis);
          const bool in_lower = within || touches(placed, at.cell, largest);
          if (within || touches(placed, upper.cell, largest)) {
            if (in_lower)
              stack[waiting++] = upper;
            else
              at = upper;
          } else {
            dead_end = !in_lower;
          }
        } else if (above) {
          at = upper;
        }
      }
      if (!dead_end) visit(at.link.index());
      if (waiting == 0) return;
      at = stack[--waiting];
    }
  }
};

/// How many leaves list the i-th sorted triangle.
struct CountReferences {
  CellWalk walk;
  const std::uint32_t* ids;

  struct Counter {
    std::uint32_t count = 0;
    ZKD_HOST_DEVICE void operator()(std::uint32_t) { ++count; }
  };
  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t i) const {
    Counter counter;
    walk(ids[i], counter);
    return counter.count;
  }
};

/// Writes the (leaf, triangle) pairs of the i-th sorted triangle.
struct WriteReferences {
  CellWalk walk;
  const std::uint32_t* ids;
  const std::uint32_t* offsets;
  std::uint32_t* leaves;
  std::uint32_t* references;

  struct Writer {
    std::uint32_t* leaves;
    std::uint32_t* references;
    std::uint32_t id;
    ZKD_HOST_DEVICE void operator()(std::uint32_t leaf) {
      *leaves++ = leaf;
      *references++ = id;
    }
  };
  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    Writer writer{leaves + offsets[i], references + offsets[i], ids[i]};
    walk(ids[i], writer);
  }
};

/// offset of leaf `leaf` among references sorted by leaf; a leaf may be empty.
struct LeafOffset {
  const std::uint32_t* leaves;
  const std::uint32_t* reference_count;
  std::uint32_t* offsets;

  ZKD_HOST_DEVICE void operator()(std::uint32_t leaf) const {
    offsets[leaf] = first_not_below(leaves, *reference_count, leaf);
  }
};

}  // namespace zkd::core
