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
#include "core/listed_parts.hpp"
#include "core/morton.hpp"
#include "core/polygon.hpp"
#include "core/rounding.hpp"
#include "core/status.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

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

/// Walks the cells of a tree whose planes and links are finished, and calls visit(leaf, box) for
/// every leaf cell that the i-th sorted triangle touches, in the order of the leaves, with the box
/// of what of it lies there. Where fragments of triangles were sorted, the first of a triangle's
/// walks for the whole of it.
///
/// The walk begins at the lowest node whose cell holds the triangle's whole box: up from its own
/// trunk to the first level that has a plane across the box. Of cells only the part inside that box
/// matters, so none has to be known from above.
struct CellWalk {
  TriangleView triangles;
  const std::uint32_t* ids;     ///< of triangles or fragments
  const std::uint32_t* owners;  ///< triangle of each fragment; null: ids are those of triangles
  const std::uint32_t* trunk_of;
  const Box* boxes;  ///< of triangles
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
      across = coder->first_level_across(boxes[id(i)]);
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

  /// The triangle's box in tree space, which holds it where scaling underflows too.
  [[nodiscard]] ZKD_HOST_DEVICE Box place(std::uint32_t id) const {
    return in_tree_space(boxes[id], frame->scale);
  }

  /// A node or leaf still to be visited. Without initialisers: a stack of them costs nothing.
  struct Waiting {
    std::uint32_t link;
    float lo[3];
    float hi[3];
  };

  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t id(std::uint32_t i) const {
    return owners != nullptr ? owners[ids[i]] : ids[i];
  }

  /// Fragments of a triangle follow one another.
  [[nodiscard]] ZKD_HOST_DEVICE bool is_first(std::uint32_t i) const {
    return owners == nullptr || ids[i] == 0 || owners[ids[i] - 1] != owners[ids[i]];
  }

  /// Announces walks that will follow that for i: triangles lie in the order of the input.
  [[gnu::always_inline]] void prefetch(std::uint32_t i, std::uint32_t end) const {
    constexpr std::uint32_t boxes_ahead = 16;
    constexpr std::uint32_t corners_ahead = 8;
    if (i + boxes_ahead < end) {
      const std::uint32_t triangle = id(i + boxes_ahead);
      __builtin_prefetch(boxes + triangle);
      if (triangles.indices != nullptr)
        __builtin_prefetch(triangles.indices + std::size_t{3} * triangle);
    }
    if (i + corners_ahead < end) {
      const std::uint32_t triangle = id(i + corners_ahead);
      for (int corner = 0; corner < 3; ++corner)
        __builtin_prefetch(triangles.position(triangles.index(triangle, corner)));
    }
  }

  template <class Visit>
  ZKD_HOST_DEVICE void operator()(std::uint32_t i, Visit& visit) const {
    if (!is_first(i)) return;
    const std::uint32_t triangle = id(i);
    const Link from = start(i);
    const Box box = place(triangle);
    if (from.is_leaf())
      visit(from.index(), box);
    else
      below(triangle, from, box, box, visit);
  }

  /// The leaves below `link` that what lies in `cell` of triangle `id` touches; `whole` is the
  /// triangle's box, and the cell in it.
  template <class Visit>
  ZKD_HOST_DEVICE void below(std::uint32_t id, Link link, const Box& whole, Box cell,
                             Visit& visit) const {
    const double slack = cell_slack * frame->largest;
    const Corners corners = corners_of(triangles, id);
    Waiting stack[max_depth];
    std::uint32_t waiting = 0;
    // That of the cell, one to cut it into, and those of the cells that have waited longest. Slots
    // change hands: polygons are too large to be moved.
    Polygon room[kept_polygons + 2];
    std::uint32_t slots[kept_polygons];
    for (std::uint32_t i = 0; i < kept_polygons; ++i) slots[i] = i;
    std::uint32_t current = kept_polygons;
    std::uint32_t spare = kept_polygons + 1;
    const auto cut = [&](std::uint32_t a, double h, double sign) {
      room[spare].cut(room[current], a, h, sign);
      exchange(current, spare);
    };
    // The polygon of `cell`, from the triangle. By rounding nothing may be left: then nothing was.
    const auto take_up = [&] {
      room[current].place(corners, frame->scale);
      for (std::uint32_t a = 0; a < 3; ++a) {
        const double low = static_cast<double>(cell.lo[a]) - slack;
        const double high = static_cast<double>(cell.hi[a]) + slack;
        if (room[current].hi[a] < low || room[current].lo[a] > high) return false;
        if (cell.lo[a] > whole.lo[a] && room[current].lo[a] < low) cut(a, low, -1.0);
        if (room[current].lo[a] > high) return false;
        if (cell.hi[a] < whole.hi[a] && room[current].hi[a] > high) cut(a, high, 1.0);
      }
      return true;
    };
    if (!take_up()) return;
    for (;;) {
      while (!link.is_leaf()) {
        const SplitNode& node = nodes[link.index()];
        const std::uint32_t axis = node.axis;
        const double plane = static_cast<double>(node.plane);
        // The box is exact, so that the slack takes nothing in where it says no.
        const bool in_lower =
            element(cell.lo, axis) <= node.plane && room[current].lo[axis] <= plane + slack;
        const bool in_upper = !in_lower || (element(cell.hi, axis) >= node.plane &&
                                            room[current].hi[axis] >= plane - slack);
        link = node.child[in_lower ? 0 : 1];
        if (!(in_lower && in_upper)) {
          for (std::uint32_t a = 0; a < 3; ++a) {
            if (a != axis) continue;
            cell.lo[a] = in_lower ? cell.lo[a] : larger(cell.lo[a], node.plane);
            cell.hi[a] = in_lower ? smaller(cell.hi[a], node.plane) : cell.hi[a];
          }
          continue;
        }
        Waiting& later = stack[waiting];
        later.link = node.child[1].bits;
        for (std::uint32_t a = 0; a < 3; ++a) {  // no indexing by a variable: it stays in registers
          later.lo[a] = a == axis ? node.plane : cell.lo[a];
          later.hi[a] = cell.hi[a];
          cell.hi[a] = a == axis ? node.plane : cell.hi[a];
        }
        if (waiting < kept_polygons)
          room[slots[waiting]].cut(room[current], axis, plane - slack, -1.0);
        ++waiting;
        cut(axis, plane + slack, 1.0);
      }
      visit(link.index(), box_inside(room[current], cell, slack));
      bool found = false;
      while (!found) {
        if (waiting == 0) return;
        const Waiting& next = stack[--waiting];
        link = Link{next.link};
        for (int a = 0; a < 3; ++a) {
          cell.lo[a] = next.lo[a];
          cell.hi[a] = next.hi[a];
        }
        if (waiting < kept_polygons) {
          exchange(current, slots[waiting]);
          found = true;
        } else {
          found = take_up();
        }
      }
    }
  }

  /// Polygons that wait with their cells; that of a cell above those is made again.
  static constexpr std::uint32_t kept_polygons = 4;

  ZKD_HOST_DEVICE static void exchange(std::uint32_t& a, std::uint32_t& b) {
    const std::uint32_t was = a;
    a = b;
    b = was;
  }
};

inline constexpr std::uint32_t not_noted = 0xFFFFFFFFu;

/// A leaf that lists a triangle, and the box of what of it lies there.
struct NotedReference {
  std::uint32_t leaf;
  Box inside;
};

/// How many leaves list the i-th of what `walk` walks for; notes them, so that most need one walk.
/// There is room for `remembered` each, and what those before have left: notes of neighbours follow
/// one another.
template <class Walk>
struct CountReferences {
  Walk walk;
  NotedReference* notes;
  std::uint32_t* noted_at;  ///< where those of the i-th begin; not_noted: there was no room
  std::uint32_t remembered;
  std::uint64_t next = 0;
  std::uint64_t last = ~std::uint64_t{0} - 1;

  struct Counter {
    NotedReference* notes;
    std::uint64_t room;
    std::uint32_t count = 0;
    ZKD_HOST_DEVICE void operator()(std::uint32_t leaf, const Box& inside) {
      if (count < room) notes[count] = {leaf, inside};
      ++count;
    }
  };
  [[gnu::always_inline]] void prefetch(std::uint32_t i, std::uint32_t end) const requires requires {
    walk.prefetch(i, end);
  }
  { walk.prefetch(i, end); }
  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t i) {
    if (i != last + 1) next = std::uint64_t{i} * remembered;
    last = i;
    Counter counter{notes + next, (std::uint64_t{i} + 1) * remembered - next};
    walk(i, counter);
    const bool noted = counter.count <= counter.room && next < not_noted;
    noted_at[i] = noted ? static_cast<std::uint32_t>(next) : not_noted;
    if (noted) next += counter.count;
    return counter.count;
  }
};

/// What is known of each reference, in the order in which walks find them.
struct FoundReferences {
  std::uint32_t* leaves;
  std::uint32_t* ids;
  Box* inside;
};

/// Writes down the references of the i-th of them.
template <class Walk>
struct WriteReferences {
  Walk walk;
  const NotedReference* notes;
  const std::uint32_t* noted_at;
  const std::uint32_t* offsets;
  const std::uint32_t* count;
  const std::uint32_t* reference_count;
  FoundReferences to;

  struct Writer {
    FoundReferences to;
    std::uint32_t id;
    std::uint32_t next;
    ZKD_HOST_DEVICE void operator()(std::uint32_t leaf, const Box& inside) {
      to.leaves[next] = leaf;
      to.ids[next] = id;
      to.inside[next] = inside;
      ++next;
    }
  };
  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    Writer writer{to, walk.id(i), offsets[i]};
    const std::uint32_t end = i + 1 < *count ? offsets[i + 1] : *reference_count;
    const std::uint32_t at = noted_at[i];
    if (at != not_noted)
      for (std::uint32_t r = 0; r < end - offsets[i]; ++r)
        writer(notes[at + r].leaf, notes[at + r].inside);
    else
      walk(i, writer);
  }
};

/// The offsets of the leaves from that of the reference before, sorted by leaf, to that of the
/// r-th: most begin where their first reference is, and empty ones with them.
struct LeafOffsets {
  const std::uint32_t* leaves;
  std::uint32_t* offsets;

  ZKD_HOST_DEVICE void operator()(std::uint32_t r) const {
    for (std::uint32_t leaf = r == 0 ? 0 : leaves[r - 1] + 1; leaf <= leaves[r]; ++leaf)
      offsets[leaf] = r;
  }
};

/// Puts the end behind the offsets of all leaves.
struct CloseOffsets {
  const std::uint32_t* leaves;
  const std::uint32_t* references;
  std::uint32_t* leaf_offsets;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const { leaf_offsets[*leaves] = *references; }
};

/// The same where the last leaves may be empty.
struct CloseLeaves {
  const std::uint32_t* leaves;  ///< of references, sorted
  const std::uint32_t* leaf_count;
  const std::uint32_t* reference_count;
  std::uint32_t* offsets;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    const std::uint32_t count = *reference_count;
    for (std::uint32_t leaf = count == 0 ? 0 : leaves[count - 1] + 1; leaf <= *leaf_count; ++leaf)
      offsets[leaf] = count;
  }
};

/// `once`: as many references as valid triangles.
struct ReferenceEachOnce {
  BuildCounts* counts;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const { counts->references = counts->listed; }
};

/// A strict tree while it is being made.
struct StrictTree {
  Count leaves;
  Count inner;
  const SplitNode* nodes;
  const Parent* parents_of_nodes;
  const Parent* parents_of_leaves;
  std::uint32_t* arrivals;

  // In the order of the leaves:
  Count references;
  const std::uint32_t* offsets;  ///< of leaves, and the end
  const std::uint32_t* leaf_of;
  std::uint32_t* numbers;
  ListedParts listed;  ///< by number
};

/// References noted while counting.
struct NotesWorkspace {
  NotedReference* notes;
  std::uint32_t* noted_at;

  void lay_out(Arena& arena, std::size_t walks, std::size_t remembered) {
    notes = arena.take<NotedReference>(walks * remembered);
    noted_at = arena.take<std::uint32_t>(walks);
  }
};

/// Which leaves list what is walked for: first how often, then, once there is room, which ones.
template <class Walk, class Backend>
struct FindReferences {
  Walk walk;
  Count walks;
  std::uint32_t remembered;  ///< leaves of one walk
  std::uint32_t* offsets;    ///< made: of each walk's references
  NotesWorkspace noted{};

  /// Makes `total`.
  void count(Backend& backend, std::uint64_t* total) {
    backend.take(noted, backend.size(walks), std::size_t{remembered});
    backend.exclusive_scan(walks,
                           CountReferences<Walk>{walk, noted.notes, noted.noted_at, remembered},
                           offsets, total);
  }

  /// `found`: that total, in the backend's memory.
  void write(Backend& backend, const std::uint32_t* found, const FoundReferences& to) const {
    backend.for_each(walks, WriteReferences<Walk>{walk, noted.notes, noted.noted_at, offsets,
                                                  walks.actual, found, to});
  }
};

/// Looks whether there is room for `counts->references_needed`, makes `references`, and returns it.
template <class Backend>
Count admit_references(Backend& backend, BuildCounts* counts, std::uint32_t* references,
                       const TriangleView& triangles) {
  const std::uint64_t capacity = backend.reference_capacity();
  backend.for_each(one, AdmitReferences{counts, references, capacity});
  backend.raise(&counts->status, triangles);
  Count admitted{references, static_cast<std::uint32_t>(capacity)};
  admitted.bound = backend.size(admitted);
  return admitted;
}

/// References of triangles, and room to sort them by leaf.
struct ReferenceWorkspace {
  SortBuffers<std::uint32_t> sort;  ///< keys: leaves; values: numbers
  std::uint32_t* ids;
  Box* inside;
  std::uint32_t* offsets;

  void lay_out(Arena& arena, std::size_t references, std::size_t leaves) {
    sort = {arena.take<std::uint32_t>(references), arena.take<std::uint32_t>(references),
            arena.take<std::uint32_t>(references), arena.take<std::uint32_t>(references)};
    ids = arena.take<std::uint32_t>(references);
    inside = arena.take<Box>(references);
    offsets = arena.take<std::uint32_t>(leaves + 1);
  }
};

/// Leaves of a triangle that are remembered.
inline constexpr std::uint32_t remembered_of_triangle = 6;

/// `all`, but for crowded leaves: every triangle in every leaf cell it touches.
template <class Backend>
struct ReferenceAll {
  CellWalk walk;
  const std::uint32_t* trunk_first;
  Count triangles;
  BuildCounts* counts;
  std::uint32_t* trunk_of;  ///< room for one number per triangle; what `walk` reads
  std::uint32_t* offsets;   ///< likewise

  void run(Backend& backend, const TriangleView& view, StrictTree& tree) {
    backend.for_each(tree.leaves,
                     LabelTrunk{trunk_first, tree.leaves.actual, triangles.actual, trunk_of});
    FindReferences<CellWalk, Backend> find{walk, triangles, remembered_of_triangle, offsets};
    find.count(backend, &counts->references_needed);
    tree.references = admit_references(backend, counts, &counts->first_references, view);
    ReferenceWorkspace work{};
    backend.take(work, tree.references.bound, backend.size(tree.leaves));
    find.write(backend, tree.references.actual, {work.sort.keys, work.ids, work.inside});
    backend.for_each(tree.references, Number{work.sort.values});
    work.sort =
        backend.radix_sort(work.sort, tree.references, bits_to_count(backend.size(tree.leaves)));
    const std::uint32_t* count = tree.references.actual;
    backend.for_each(tree.references, LeafOffsets{work.sort.keys, work.offsets});
    backend.for_each(one, CloseLeaves{work.sort.keys, tree.leaves.actual, count, work.offsets});
    tree.offsets = work.offsets;
    tree.leaf_of = work.sort.keys;
    tree.numbers = work.sort.values;
    tree.listed = {work.ids, work.inside, nullptr, nullptr};
  }
};

/// The tree's node from what was made of it before its boxes.
struct FinishNode {
  const SplitNode* split_nodes;
  Node* nodes;

  ZKD_HOST_DEVICE void operator()(std::uint32_t index) const {
    const SplitNode& from = split_nodes[index];
    Node& node = nodes[index];
    node.child[0] = from.child[0];
    node.child[1] = from.child[1];
    node.plane = from.plane;
    node.axis = from.axis;
  }
};

}  // namespace zkd::core
