// SPDX-License-Identifier: Apache-2.0
//
// Stage 10, references: which triangles each leaf lists. `once` lists a triangle where the sort put
// it. `all` lists it in every leaf cell it touches; this file finds those cells.
#pragma once

#include <cstdint>

#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>
#include <zkd/tree.hpp>

#include "core/arena.hpp"
#include "core/compress.hpp"
#include "core/frame.hpp"
#include "core/key.hpp"
#include "core/morton.hpp"
#include "core/search.hpp"
#include "core/status.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// Relative slack of the overlap test: a triangle is taken to touch a cell that it misses by less
/// than about this times the largest coordinate (of a sliver: times as much more as the products
/// cancel that make its normal). Rounding moves a projection by less than 2^-50 of the products
/// that make it, so a triangle that touches is never lost.
inline constexpr double overlap_slack = 4.0e-14;

/// A triangle in tree space, ready for overlap tests with many cells (Akenine-Moller: Fast 3D
/// triangle-box overlap testing, 2001): its interval on each separating axis.
struct PlacedTriangle {
  Box box;
  double normal[3];
  double offset;  ///< normal . corner
  double normal_slack;
  // Axis a crossed with edge i, for a padded number of edges: vectors of 4 doubles.
  double edge[4][3];
  double lo[3][4];
  double hi[3][4];

  /// `largest` bounds the magnitude of all coordinates of scene and cells.
  ZKD_HOST_DEVICE PlacedTriangle(const Corners& corners, double scale, double largest) {
    double corner[3][3];
    for (int i = 0; i < 3; ++i)
      for (int a = 0; a < 3; ++a) {
        corner[i][a] = static_cast<double>(corners.p[i][a]) * scale;
        box.lo[a] = smaller(box.lo[a], static_cast<float>(corner[i][a]));
        box.hi[a] = larger(box.hi[a], static_cast<float>(corner[i][a]));
      }
    for (int i = 0; i < 4; ++i)
      for (int a = 0; a < 3; ++a) edge[i][a] = corner[(i + 1) % 3][a] - corner[i % 3][a];

    const double slack = overlap_slack * largest;
    offset = 0.0;
    normal_slack = 0.0;
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      const int c = (a + 2) % 3;
      const double left = edge[0][b] * edge[1][c];
      const double right = edge[0][c] * edge[1][b];
      normal[a] = left - right;
      offset += normal[a] * corner[0][a];
      normal_slack += slack * (magnitude(left) + magnitude(right));
      for (int i = 0; i < 4; ++i) {
        const double* e = edge[i];
        const double* on_edge = corner[i % 3];
        const double* opposite = corner[(i + 2) % 3];
        const double p = e[b] * on_edge[c] - e[c] * on_edge[b];
        const double q = e[b] * opposite[c] - e[c] * opposite[b];
        const double edge_slack = slack * (magnitude(e[b]) + magnitude(e[c]));
        lo[a][i] = smaller(p, q) - edge_slack;
        hi[a][i] = larger(p, q) + edge_slack;
      }
    }
  }

  /// Whether the triangle touches a closed cell that its box touches, with overlap_slack.
  [[nodiscard]] ZKD_HOST_DEVICE bool touches(const Box& cell) const {
    double middle[3];
    double half[3];
    double distance = -offset;
    double reach = normal_slack;
    for (int a = 0; a < 3; ++a) {
      const double low = static_cast<double>(cell.lo[a]);
      const double high = static_cast<double>(cell.hi[a]);
      middle[a] = 0.5 * (low + high);
      half[a] = 0.5 * (high - low);
      distance += normal[a] * middle[a];
      reach += half[a] * magnitude(normal[a]);
    }
    if (magnitude(distance) > reach) return false;
    bool apart = false;
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      const int c = (a + 2) % 3;
      for (int i = 0; i < 4; ++i) {
        const double at = edge[i][b] * middle[c] - edge[i][c] * middle[b];
        const double radius = half[b] * magnitude(edge[i][c]) + half[c] * magnitude(edge[i][b]);
        apart |= (lo[a][i] - at > radius) | (at - hi[a][i] > radius);
      }
    }
    return !apart;
  }
};

/// Notes for every triangle of a trunk, by position, which trunk that is.
struct LabelTrunk {
  const std::uint32_t* first;
  const std::uint32_t* trunk_count;
  const std::uint32_t* triangle_count;
  std::uint32_t* trunk_of;

  ZKD_HOST_DEVICE void operator()(std::uint32_t trunk) const {
    const std::uint32_t end = trunk + 1 < *trunk_count ? first[trunk + 1] : *triangle_count;
    for (std::uint32_t i = first[trunk]; i < end; ++i) trunk_of[i] = trunk;
  }
};

/// What a walk needs of a node: a quarter of it, so that more of them stay in cache.
struct SplitNode {
  float plane;
  std::uint32_t axis;
  Link child[2];
};

struct CopySplitNode {
  const Node* nodes;
  SplitNode* split_nodes;

  ZKD_HOST_DEVICE void operator()(std::uint32_t index) const {
    const Node& node = nodes[index];
    split_nodes[index] = {node.plane, node.axis, {node.child[0], node.child[1]}};
  }
};

/// Walks the cells of a tree whose planes and links are finished, and calls visit(leaf) for every
/// leaf cell that the i-th sorted triangle touches, in the order of the leaves.
///
/// The walk begins at the lowest node whose cell holds the triangle's whole box: up from its own
/// trunk to the first level that has a plane across the box. Of cells only the part inside that box
/// matters, so none has to be known from above.
struct CellWalk {
  TriangleView triangles;
  const std::uint32_t* ids;
  const std::uint32_t* trunk_of;
  const Box* boxes;
  const SplitNode* nodes;
  const std::uint8_t* levels;
  const Parent* parents_of_nodes;
  const Parent* parents_of_leaves;
  const MortonCoder*
      coder;  ///< null: levels are not those of the lattice, and walks begin at the root
  const SceneFrame* frame;

  [[nodiscard]] ZKD_HOST_DEVICE Link start(std::uint32_t i) const {
    std::uint32_t across = 0;
    if (coder != nullptr) {
      across = coder->first_level_across(boxes[ids[i]]);
      if (across == coder->code_bits) across = first_fine_level;
    }
    Link link = Link::leaf(trunk_of[i]);
    Parent parent = parents_of_leaves[trunk_of[i]];
    while (!parent.is_none() && levels[parent.node()] >= across) {
      link = Link::node(parent.node());
      parent = parents_of_nodes[parent.node()];
    }
    return link;
  }

  /// A node or leaf still to be visited. Without initialisers: a stack of them costs nothing.
  struct Waiting {
    std::uint32_t link;
    float lo[3];
    float hi[3];
  };

  template <class Visit>
  ZKD_HOST_DEVICE void operator()(std::uint32_t i, Visit& visit) const {
    const PlacedTriangle placed(corners_of(triangles, ids[i]), frame->scale, frame->largest);
    Waiting stack[max_depth];
    std::uint32_t waiting = 0;
    Link link = start(i);
    Box cell = placed.box;  // of the node, cut to the box
    for (;;) {
      bool dead_end = false;
      while (!link.is_leaf() && !dead_end) {
        const SplitNode& node = nodes[link.index()];
        const bool below = placed.box.lo[node.axis] <= node.plane;
        const bool above = placed.box.hi[node.axis] >= node.plane;
        if (!(below && above)) {
          link = node.child[above ? 1 : 0];
          continue;
        }
        Box lower = cell;
        Box upper = cell;
        bool within = true;
        for (std::uint32_t a = 0; a < 3;
             ++a) {  // no indexing by a variable: boxes stay in registers
          const bool split = a == node.axis;
          lower.hi[a] = split ? node.plane : cell.hi[a];
          upper.lo[a] = split ? node.plane : cell.lo[a];
          within = within &&
                   (split || (cell.lo[a] == placed.box.lo[a] && cell.hi[a] == placed.box.hi[a]));
        }
        // Where the cell cut nothing off the triangle along the two other axes, the triangle spans
        // it along this one, and is on both sides of the plane.
        const bool in_lower = within || placed.touches(lower);
        const bool in_upper = within || placed.touches(upper);
        if (in_lower && in_upper) {
          Waiting& later = stack[waiting++];
          later.link = node.child[1].bits;
          for (int a = 0; a < 3; ++a) {
            later.lo[a] = upper.lo[a];
            later.hi[a] = upper.hi[a];
          }
        }
        link = node.child[in_lower ? 0 : 1];
        cell = in_lower ? lower : upper;
        dead_end = !in_lower && !in_upper;
      }
      if (!dead_end) visit(link.index());
      if (waiting == 0) return;
      const Waiting& next = stack[--waiting];
      link = Link{next.link};
      for (int a = 0; a < 3; ++a) {
        cell.lo[a] = next.lo[a];
        cell.hi[a] = next.hi[a];
      }
    }
  }
};

/// Leaves of a triangle that are remembered while counting, so that most triangles need one walk.
inline constexpr std::uint32_t remembered = 8;

/// How many leaves list the i-th sorted triangle; notes the first of them.
struct CountReferences {
  CellWalk walk;
  std::uint32_t* notes;  ///< `remembered` leaves per triangle

  struct Counter {
    std::uint32_t* notes;
    std::uint32_t count = 0;
    ZKD_HOST_DEVICE void operator()(std::uint32_t leaf) {
      if (count < remembered) notes[count] = leaf;
      ++count;
    }
  };
  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t i) const {
    Counter counter{notes + std::size_t{i} * remembered};
    walk(i, counter);
    return counter.count;
  }
};

/// Writes the (leaf, triangle) pairs of the i-th sorted triangle.
struct WriteReferences {
  CellWalk walk;
  const std::uint32_t* notes;
  const std::uint32_t* offsets;
  const std::uint32_t* triangle_count;
  const std::uint32_t* reference_count;
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
    Writer writer{leaves + offsets[i], references + offsets[i], walk.ids[i]};
    const std::uint32_t end = i + 1 < *triangle_count ? offsets[i + 1] : *reference_count;
    const std::uint32_t count = end - offsets[i];
    if (count <= remembered)
      for (std::uint32_t r = 0; r < count; ++r) writer(notes[std::size_t{i} * remembered + r]);
    else
      walk(i, writer);
  }
};

/// The offset of leaf `leaf` among references sorted by leaf; a leaf may be empty.
struct LeafOffset {
  const std::uint32_t* leaves;
  const std::uint32_t* reference_count;
  std::uint32_t* offsets;

  ZKD_HOST_DEVICE void operator()(std::uint32_t leaf) const {
    offsets[leaf] = first_not_below(leaves, *reference_count, leaf);
  }
};

/// Puts the end behind the offsets of all leaves.
struct CloseOffsets {
  const BuildCounts* counts;
  std::uint32_t* leaf_offsets;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    leaf_offsets[counts->trunks] = counts->references;
  }
};

/// `once`: as many references as valid triangles.
struct ReferenceEachOnce {
  BuildCounts* counts;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const { counts->references = counts->listed; }
};

/// For References::all.
struct ReferenceWorkspace {
  SortBuffers<std::uint32_t> sort;  ///< keys: leaves; values: triangles

  void lay_out(Arena& arena, std::size_t references) {
    sort = {arena.take<std::uint32_t>(references), arena.take<std::uint32_t>(references),
            arena.take<std::uint32_t>(references), arena.take<std::uint32_t>(references)};
  }
};

/// Leaves noted while counting: `remembered` for each triangle.
struct NotesWorkspace {
  std::uint32_t* notes;

  void lay_out(Arena& arena, std::size_t triangles) {
    notes = arena.take<std::uint32_t>(triangles * remembered);
  }
};

/// `all`, start to end: count, write (leaf, triangle) pairs, sort them by leaf.
template <class Backend>
struct ReferenceAll {
  CellWalk walk;
  const std::uint32_t* trunk_first;
  Count triangles;
  Count trunks;
  Count node_count;
  BuildCounts* counts;  ///< what those three count; `references_needed` and `references` are made
  const Node* nodes;
  SplitNode* split_nodes;   ///< room for one per node; what `walk` reads
  std::uint32_t* trunk_of;  ///< room for one number per triangle; likewise
  std::uint32_t* offsets;   ///< likewise

  void run(Backend& backend, const TriangleView& view) {
    backend.for_each(node_count, CopySplitNode{nodes, split_nodes});
    backend.for_each(trunks, LabelTrunk{trunk_first, trunks.actual, triangles.actual, trunk_of});
    NotesWorkspace noted{};
    backend.take(noted, triangles.bound);
    backend.exclusive_scan(triangles, CountReferences{walk, noted.notes}, offsets,
                           &counts->references_needed);
    const std::uint64_t capacity = backend.reference_capacity();
    backend.for_each(one, AdmitReferences{counts, capacity});
    backend.raise(&counts->status, view);
    const std::uint32_t* count = &counts->references;
    const Count references{count, static_cast<std::uint32_t>(capacity)};
    ReferenceWorkspace pairs{};
    backend.take(pairs, backend.size(references));
    backend.for_each(triangles, WriteReferences{walk, noted.notes, offsets, triangles.actual, count,
                                                pairs.sort.keys, pairs.sort.values});
    pairs.sort = backend.radix_sort(pairs.sort, references, bits_to_count(backend.size(trunks)));
    backend.allocate_references(references);
    backend.for_each(references, CopyTo<std::uint32_t>{pairs.sort.values, backend.references()});
    backend.for_each(trunks, LeafOffset{pairs.sort.keys, count, backend.leaf_offsets()});
  }
};

}  // namespace zkd::core
