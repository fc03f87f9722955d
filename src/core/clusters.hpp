// SPDX-License-Identifier: Apache-2.0
//
// Between sorting and trunks, for Quality::balanced: the upper part of the tree by the surface-area
// heuristic (as in Pantaleoni, Luebke: HLBVH, HPG 2010, and Garanzha et al., HPG 2011, there for
// bounding volumes).
//
// A cluster is what lies in one cell of the lattice at a level some way down the conceptual tree.
// Any plane of that coarser lattice divides clusters without cutting one, so a kd-tree over them
// may take the plane that the heuristic likes best instead of the middle. Then each cluster gets
// the path to it in that tree as the upper part of its triangles' keys, in place of the bits of the
// code that its cell had: with that all later stages work as they are, on paths above and codes
// below.
//
// The tree over the clusters grows level by level, a fixed number of rounds (a loop on the host
// that waits for nothing: where it can see that no node is left it ends earlier). One thread
// divides one node.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>

#include "core/area.hpp"
#include "core/arena.hpp"
#include "core/morton.hpp"
#include "core/planes.hpp"
#include "core/search.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// Bits of a path, and rounds: no cluster lies deeper in the tree over them.
inline constexpr std::uint32_t path_bits = 31;

/// Levels of the lattice above the clusters, at most.
inline constexpr std::uint32_t most_cluster_levels = 18;

/// Levels above the clusters of so many triangles: a surface then has some 16 in each.
ZKD_HOST_DEVICE inline std::uint32_t cluster_levels(std::uint32_t triangles) {
  const std::uint32_t log2 = triangles > 1 ? 64 - leading_zeros(triangles - 1) : 0;
  const std::uint32_t levels = log2 > 4 ? 3 * (log2 - 4) / 2 : 0;
  return smaller(levels, most_cluster_levels);
}

/// Bits of the lattice that leave room for a path.
ZKD_HOST_DEVICE inline std::uint32_t code_bits_below_path(std::uint32_t bits,
                                                          std::uint32_t triangles) {
  return smaller(bits, 64 - path_bits + cluster_levels(triangles));
}

inline std::uint32_t most_clusters(std::uint32_t elements) {
  return smaller(elements, 1u << most_cluster_levels);
}

/// How keys are made of paths and codes, in the backend's memory.
struct ClusterState {
  std::uint32_t levels = 0;      ///< of the lattice, above clusters
  std::uint32_t bits_below = 0;  ///< of a code, below them
  std::uint32_t key_bits = 0;    ///< of a path and what follows it
  std::uint32_t count = 0;       ///< clusters
  std::uint32_t axis_bits_below[3] = {};
  std::uint32_t nodes = 0;  ///< to be divided in this round
};

/// Room for one.
struct ClusterRecord {
  ClusterState* state;
  void lay_out(Arena& arena, std::size_t) { state = arena.take<ClusterState>(1); }
};

struct BeginClusters {
  ClusterState* state;
  const Lattice* lattice;
  const std::uint32_t* valid;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    ClusterState begun;
    begun.levels = smaller(cluster_levels(*valid), lattice->code_bits);
    begun.bits_below = lattice->code_bits - begun.levels;
    begun.key_bits = path_bits + begun.bits_below;
    for (std::uint32_t level = begun.levels; level < lattice->code_bits; ++level)
      ++begun.axis_bits_below[lattice->axis[level]];
    *state = begun;
  }
};

/// Whether the i-th sorted code begins a cluster.
struct BeginsCluster {
  const std::uint64_t* codes;
  const ClusterState* state;
  std::uint32_t shift = 0;

  ZKD_HOST_DEVICE void load() { shift = state->bits_below; }

  ZKD_HOST_DEVICE bool operator()(std::uint32_t i) const {
    return i == 0 || (codes[i - 1] ^ codes[i]) >> shift != 0;
  }
};

/// A box that segmented_reduce can unite.
struct ClusterBox : Box {
  ZKD_HOST_DEVICE void combine(const ClusterBox& other) { include(*this, other); }
};

struct IncludeElement {
  const Box* boxes;
  const std::uint32_t* ids;

  ZKD_HOST_DEVICE void operator()(std::uint32_t, std::uint32_t i, ClusterBox& box) const {
    include(box, boxes[ids[i]]);
  }
};

/// Memory of the stage, for so many clusters.
struct ClusterWorkspace {
  std::uint32_t* first;     ///< position of each cluster's first triangle
  std::uint64_t* prefixes;  ///< the part of the codes that its triangles share
  ClusterBox* boxes;
  std::uint32_t* cells[3];  ///< its cell's coordinate along each axis
  std::uint32_t* paths;     ///< left-aligned in path_bits
  SortBuffers<std::uint32_t>
      order[3];               ///< clusters in the order of these coordinates, node by node
  std::uint32_t* node_begin;  ///< a node: positions in `order`
  std::uint32_t* node_end;
  std::uint32_t* child_begin;  ///< two for each node
  std::uint32_t* child_end;
  std::uint32_t* divisible;     ///< children that are nodes of the next round
  double* costs;                ///< of the upper side, at each position
  std::uint32_t* moved;         ///< of the upper side, while a node is divided
  std::uint8_t* upper;          ///< whether a cluster goes to the upper side
  std::uint8_t* plane_axes;     ///< between two ranks
  std::uint32_t* plane_cells;   ///< the first above it
  std::uint32_t* ranked_first;  ///< where the cluster of a rank begins from now on
  std::uint32_t* ranked_paths;
  std::uint64_t* ranked_prefixes;

  void lay_out(Arena& arena, std::size_t clusters) {
    first = arena.take<std::uint32_t>(clusters);
    prefixes = arena.take<std::uint64_t>(clusters);
    boxes = arena.take<ClusterBox>(clusters);
    for (int a = 0; a < 3; ++a) {
      cells[a] = arena.take<std::uint32_t>(clusters);
      order[a] = {arena.take<std::uint32_t>(clusters), arena.take<std::uint32_t>(clusters),
                  arena.take<std::uint32_t>(clusters), arena.take<std::uint32_t>(clusters)};
    }
    paths = arena.take<std::uint32_t>(clusters);
    node_begin = arena.take<std::uint32_t>(clusters);
    node_end = arena.take<std::uint32_t>(clusters);
    child_begin = arena.take<std::uint32_t>(2 * clusters);
    child_end = arena.take<std::uint32_t>(2 * clusters);
    divisible = arena.take<std::uint32_t>(2 * clusters);
    costs = arena.take<double>(clusters);
    moved = arena.take<std::uint32_t>(clusters);
    upper = arena.take<std::uint8_t>(clusters);
    plane_axes = arena.take<std::uint8_t>(clusters);
    plane_cells = arena.take<std::uint32_t>(clusters);
    ranked_first = arena.take<std::uint32_t>(clusters);
    ranked_paths = arena.take<std::uint32_t>(clusters);
    ranked_prefixes = arena.take<std::uint64_t>(clusters);
  }
};

/// The c-th cluster: its cell, and its place in the three orders before they are sorted.
struct PlaceCluster {
  const std::uint64_t* codes;
  const MortonCoder* coder;
  const ClusterState* state_found;
  ClusterWorkspace work;

  ZKD_HOST_DEVICE void operator()(std::uint32_t c) const {
    const ClusterState& state = *state_found;
    const std::uint64_t prefix = codes[work.first[c]] >> state.bits_below;
    work.prefixes[c] = prefix;
    work.paths[c] = 0;
    for (int a = 0; a < 3; ++a) {
      const std::uint32_t cell =
          coder->cell(prefix << state.bits_below, a) >> state.axis_bits_below[a];
      work.cells[a][c] = cell;
      work.order[a].keys[c] = cell;
      work.order[a].values[c] = c;
    }
  }
};

/// All clusters are one node.
struct BeginTree {
  ClusterState* state;
  ClusterWorkspace work;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    state->nodes = state->count > 1 ? 1 : 0;
    if (state->count == 0) return;
    work.node_begin[0] = 0;
    work.node_end[0] = state->count;
  }
};

/// Divides one node in the round of its depth.
struct DivideClusters {
  static constexpr bool is_long = true;
  ClusterWorkspace work;
  std::uint32_t depth;

  ZKD_HOST_DEVICE void operator()(std::uint32_t node) const {
    const std::uint32_t begin = work.node_begin[node];
    const std::uint32_t end = work.node_end[node];
    Division division;
    // Halving the cells takes `halvings` rounds more: where there would be none left, that is done.
    std::uint32_t halvings = 0;
    std::uint32_t widest = 0;
    for (int a = 0; a < 3; ++a) {
      const std::uint32_t width = highest(a, end) - lowest(a, begin) + 1;
      halvings += ceil_log2(width);
      if (width <= widest) continue;
      widest = width;
      division.axis = a;
      division.cell = lowest(a, begin) + (width + 1) / 2;
    }
    if (depth + halvings < path_bits) division = cheapest(begin, end);
    divide(node, begin, end, division);
  }

 private:
  struct Division {
    int axis = 0;
    std::uint32_t cell = 0;  ///< the first on the upper side
  };

  [[nodiscard]] static ZKD_HOST_DEVICE std::uint32_t ceil_log2(std::uint32_t x) {
    return x > 1 ? 64 - static_cast<std::uint32_t>(leading_zeros(x - 1)) : 0;
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t cell_at(int a, std::uint32_t position) const {
    return work.cells[a][work.order[a].values[position]];
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t lowest(int a, std::uint32_t begin) const {
    return cell_at(a, begin);
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t highest(int a, std::uint32_t end) const {
    return cell_at(a, end - 1);
  }

  /// Surface of each side times the clusters in it, over all planes; of several, the first.
  /// Clusters count, not triangles: what lies in one is a tree of some depth, whatever it holds.
  [[nodiscard]] ZKD_HOST_DEVICE Division cheapest(std::uint32_t begin, std::uint32_t end) const {
    Division best;
    double least = 1.0e300;
    for (int a = 0; a < 3; ++a) {
      if (lowest(a, begin) == highest(a, end)) continue;
      const std::uint32_t* order = work.order[a].values;
      Box above;
      for (std::uint32_t i = end - 1; i > begin; --i) {
        include(above, work.boxes[order[i]]);
        work.costs[i] = half_area(above) * static_cast<double>(end - i);
      }
      Box below;
      for (std::uint32_t i = begin; i + 1 < end; ++i) {
        include(below, work.boxes[order[i]]);
        const std::uint32_t next = cell_at(a, i + 1);
        if (cell_at(a, i) == next) continue;
        const double cost =
            half_area(below) * static_cast<double>(i + 1 - begin) + work.costs[i + 1];
        if (!(cost < least)) continue;
        least = cost;
        best = {a, next};
      }
    }
    return best;
  }

  ZKD_HOST_DEVICE void divide(std::uint32_t node, std::uint32_t begin, std::uint32_t end,
                              const Division& division) const {
    const std::uint32_t* cells = work.cells[division.axis];
    const std::uint32_t bit = 1u << (path_bits - 1 - depth);
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint32_t c = work.order[0].values[i];
      const bool upper = cells[c] >= division.cell;
      work.upper[c] = upper ? 1 : 0;
      if (upper) work.paths[c] |= bit;
    }
    std::uint32_t middle = begin;
    for (int a = 0; a < 3; ++a) {
      std::uint32_t* order = work.order[a].values;
      std::uint32_t kept = begin;
      std::uint32_t moved = begin;
      for (std::uint32_t i = begin; i < end; ++i) {
        const std::uint32_t c = order[i];
        if (work.upper[c] != 0)
          work.moved[moved++] = c;
        else
          order[kept++] = c;
      }
      for (std::uint32_t i = begin; i < moved; ++i) order[kept + (i - begin)] = work.moved[i];
      middle = kept;
    }
    work.plane_axes[middle - 1] = static_cast<std::uint8_t>(division.axis);
    work.plane_cells[middle - 1] = division.cell;
    work.child_begin[2 * node] = begin;
    work.child_end[2 * node] = middle;
    work.child_begin[2 * node + 1] = middle;
    work.child_end[2 * node + 1] = end;
  }
};

/// Whether a child holds several clusters.
struct IsDivisible {
  const std::uint32_t* begin;
  const std::uint32_t* end;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t child) const {
    return end[child] - begin[child] > 1;
  }
};

struct TakeChild {
  ClusterWorkspace work;
  ZKD_HOST_DEVICE void operator()(std::uint32_t node) const {
    work.node_begin[node] = work.child_begin[work.divisible[node]];
    work.node_end[node] = work.child_end[work.divisible[node]];
  }
};

/// How many children the nodes of a round have.
struct CountChildren {
  const ClusterState* state;
  std::uint32_t* children;
  ZKD_HOST_DEVICE void operator()(std::uint32_t) const { *children = 2 * state->nodes; }
};

/// Triangles in the cluster of a rank.
struct RankedLength {
  const ClusterState* state;
  const std::uint32_t* listed;
  ClusterWorkspace work;

  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t rank) const {
    const std::uint32_t c = work.order[0].values[rank];
    const std::uint32_t end = c + 1 < state->count ? work.first[c + 1] : *listed;
    work.ranked_paths[rank] = work.paths[c];
    work.ranked_prefixes[rank] = work.prefixes[c];
    return end - work.first[c];
  }
};

/// The key and triangle that come to position i.
struct ArrangeElement {
  const ClusterState* state;
  ClusterWorkspace work;
  SortBuffers<std::uint64_t> sort;
  std::uint32_t clusters = 0;
  std::uint32_t bits_below = 0;
  std::uint32_t last_rank = 0;  // of the element before: most follow in the same

  ZKD_HOST_DEVICE void load() {
    clusters = state->count;
    bits_below = state->bits_below;
  }

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) {
    const std::uint32_t* first = work.ranked_first;
    if (!(first[last_rank] <= i && (last_rank + 1 == clusters || i < first[last_rank + 1])))
      last_rank = last_at_or_before(first, clusters, i);
    const std::uint32_t from = work.first[work.order[0].values[last_rank]] + (i - first[last_rank]);
    const std::uint64_t below = (std::uint64_t{1} << bits_below) - 1;
    sort.other_keys[i] = static_cast<std::uint64_t>(work.ranked_paths[last_rank]) << bits_below |
                         (sort.keys[from] & below);
    sort.other_values[i] = sort.values[from];
  }
};

/// Planes that clusters were divided at and, below those, of the scene's lattice.
struct ClusterPlanes {
  const Lattice* lattice;
  const MortonCoder* coder;
  const ClusterState* state;
  const std::uint32_t* paths;
  const std::uint64_t* prefixes;
  const std::uint8_t* axes;
  const std::uint32_t* cells;

  /// As LatticePlanes; `above` is a path and what follows it.
  [[nodiscard]] ZKD_HOST_DEVICE SplitPlane plane(std::uint64_t above, std::uint32_t level) const {
    const auto path = static_cast<std::uint32_t>(above >> (64 - path_bits));
    const std::uint32_t rank = last_at_or_before(paths, state->count, path);
    if (level < path_bits) {
      // The trunk begins a cluster, and the node parts it from the one before.
      const std::uint32_t axis = axes[rank - 1];
      const std::uint32_t k = cells[rank - 1] << state->axis_bits_below[axis];
      return {axis, plane_position(*lattice, static_cast<int>(axis), k)};
    }
    std::uint64_t code = above << path_bits >> state->levels;
    if (state->levels > 0) code |= prefixes[rank] << (64 - state->levels);
    return split_plane(*lattice, *coder, code, level - path_bits + state->levels);
  }
};

/// The stage, start to end. Codes come in sorted; keys go out sorted.
template <class Backend>
struct ArrangeClusters {
  const Box* boxes;
  const Lattice* lattice;
  const MortonCoder* coder;
  const std::uint32_t* valid;  ///< triangles, before any was split
  Count listed;
  ClusterState* state;
  ClusterWorkspace work{};

  SortBuffers<std::uint64_t> run(Backend& backend, SortBuffers<std::uint64_t> sort) {
    backend.for_each(one, BeginClusters{state, lattice, valid});
    backend.select(listed, BeginsCluster{sort.keys, state}, sort.other_values, &state->count);
    const Count clusters{&state->count, most_clusters(listed.bound)};
    backend.take(work, backend.size(clusters));
    backend.for_each(clusters, CopyTo<std::uint32_t>{sort.other_values, work.first});
    backend.segmented_reduce(clusters, work.first, listed, work.boxes,
                             IncludeElement{boxes, sort.values});
    backend.for_each(clusters, PlaceCluster{sort.keys, coder, state, work});
    for (auto& order : work.order) order = backend.radix_sort(order, clusters, most_cluster_levels);
    grow(backend, clusters);
    backend.exclusive_scan(clusters, RankedLength{state, listed.actual, work}, work.ranked_first,
                           &state->nodes);
    backend.for_each(listed, ArrangeElement{state, work, sort});
    return {sort.other_keys, sort.other_values, sort.keys, sort.values};
  }

  [[nodiscard]] ClusterPlanes planes() const {
    return {lattice,         coder,           state, work.ranked_paths, work.ranked_prefixes,
            work.plane_axes, work.plane_cells};
  }

 private:
  void grow(Backend& backend, Count clusters) {
    backend.for_each(one, BeginTree{state, work});
    const Count nodes{&state->nodes, clusters.bound / 2};  // each holds two clusters or more
    std::uint32_t* child_count = work.ranked_first;        // not yet in use
    for (std::uint32_t depth = 0; depth < path_bits && backend.may_exist(nodes); ++depth) {
      backend.for_each(nodes, DivideClusters{work, depth});
      backend.for_each(one, CountChildren{state, child_count});
      backend.select(Count{child_count, 2 * nodes.bound},
                     IsDivisible{work.child_begin, work.child_end}, work.divisible, &state->nodes);
      backend.for_each(nodes, TakeChild{work});
    }
  }
};

}  // namespace zkd::core
