// SPDX-License-Identifier: Apache-2.0
//
// All nodes of a level become leaves or two children each: references go to the sides they are on,
// those on both are clipped ("perfect splits"), and places come from scans.
#pragma once

#include <cstdint>

#include <zkd/options.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>
#include <zkd/tree.hpp>

#include "core/arena.hpp"
#include "core/sah/clip.hpp"
#include "core/wu2011/level.hpp"

namespace zkd::core::wu2011 {

/// How many references a child gets, and their box.
struct ChildSize {
  Box box;
  std::uint32_t count = 0;
};

/// Where a child begins: among the references of the next level, or among those of this level's
/// leaves.
struct ChildPlace {
  std::uint32_t begin;
  std::uint32_t node;  ///< of the next level; none: the child is a leaf
};

/// What a level comes to.
struct LevelTotals {
  std::uint32_t divided = 0;          ///< nodes
  std::uint32_t nodes = 0;            ///< of the next level
  std::uint32_t references = 0;       ///< likewise
  std::uint32_t leaf_references = 0;  ///< of leaves that come of this one

  ZKD_HOST_DEVICE void combine(const LevelTotals& next) {
    divided += next.divided;
    nodes += next.nodes;
    references += next.references;
    leaf_references += next.leaf_references;
  }
};

/// What the host reads of a level.
struct LevelCounts {
  LevelTotals totals;
  std::uint32_t straddlers = 0;
  std::uint32_t events = 0;  ///< of the next level
  std::uint32_t fresh = 0;   ///< of them, those that clipping made
};

/// In DivideRoom::place: the reference was clipped on its way.
inline constexpr std::uint32_t clipped_bit = 0x80000000u;

/// What is only needed while a level is divided.
struct DivideRoom {
  std::uint32_t* straddlers;       ///< references on both sides of their plane
  std::uint32_t* straddler_of;     ///< of such references: their number in that list
  std::uint32_t* straddler_fresh;  ///< of each in the list: its first fresh event
  Box* clipped;                    ///< two of each in the list; empty: not on this side after all
  std::uint32_t* place;  ///< two of each reference: its index in that child, later on the next
                         ///< level (with clipped_bit); none: not there
  ChildSize* sizes;      ///< two of each node
  ChildPlace* places;    ///< likewise
  LevelTotals* before;   ///< of each node: of all nodes before it

  void lay_out(Arena& arena, std::size_t nodes, std::size_t references) {
    straddlers = arena.take<std::uint32_t>(references);
    straddler_of = arena.take<std::uint32_t>(references);
    straddler_fresh = arena.take<std::uint32_t>(references);
    clipped = arena.take<Box>(2 * references);
    place = arena.take<std::uint32_t>(2 * references);
    sizes = arena.take<ChildSize>(2 * nodes);
    places = arena.take<ChildPlace>(2 * nodes);
    before = arena.take<LevelTotals>(nodes);
  }
};

/// What the nodes of a level came to, until the tree is put together.
struct LevelRecord {
  /// Links: to the node of the next level, or Link::leaf(references it lists). Axis 3: not divided.
  Node* nodes;
  std::uint32_t* leaf_begin;  ///< in leaf_references: of each node, and the end
  std::uint32_t* leaf_references;
  std::uint32_t node_count = 0;
  std::uint32_t leaf_reference_count = 0;

  static constexpr std::uint32_t not_divided = 3;

  void lay_out(Arena& arena, std::size_t node_room, std::size_t reference_room) {
    nodes = arena.take<Node>(node_room);
    leaf_begin = arena.take<std::uint32_t>(node_room + 1);
    leaf_references = arena.take<std::uint32_t>(reference_room);
  }
};

/// Whether a reference lies on both sides of a plane that divides its node.
struct Straddles {
  Level level;

  ZKD_HOST_DEVICE bool operator()(std::uint32_t i) const {
    const Reference& reference = level.references[i];
    const Decision& decision = level.decisions[reference.node];
    return decision.divided != 0 && side_of(reference.box, decision) == Side::both;
  }
};

struct ClipStraddler {
  Level level;
  DivideRoom room;
  Clipper clip;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    const std::uint32_t index = room.straddlers[i];
    room.straddler_of[index] = i;
    const Reference reference = level.references[index];
    const Decision decision = level.decisions[reference.node];
    for (std::uint32_t which = 0; which < 2; ++which) {
      Box cell = level.nodes[reference.node].cell;
      Box box = reference.box;
      (which == 0 ? cell.hi : cell.lo)[decision.axis] = decision.plane;
      (which == 0 ? box.hi : box.lo)[decision.axis] = decision.plane;
      room.clipped[2 * i + which] = clip(reference.id, cell, box) ? box : Box{};
    }
  }
};

/// Sums over references of one node: those on each side.
struct SideSums {
  ChildSize side[2];
  std::uint32_t begins = 0;  ///< 1: a node begins in between

  ZKD_HOST_DEVICE void combine(const SideSums& next) {
    if (next.begins != 0) {
      *this = next;
      return;
    }
    for (int which = 0; which < 2; ++which) {
      include(side[which].box, next.side[which].box);
      side[which].count += next.side[which].count;
    }
  }
};

/// A scan over references: the index of each in its children, and the sizes of these.
struct PlaceInChildren {
  Level level;
  DivideRoom room;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i, SideSums& sums) const {
    const Reference& reference = level.references[i];
    if (i == level.reference_begin[reference.node]) {
      sums = SideSums{};
      sums.begins = 1;
    }
    for (std::uint32_t which = 0; which < 2; ++which) {
      const Box* const box = box_in(i, which);
      if (box == nullptr) continue;
      include(sums.side[which].box, *box);
      ++sums.side[which].count;
    }
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t segment_begin(std::uint32_t i) const {
    return level.reference_begin[level.references[i].node];
  }
  ZKD_HOST_DEVICE void take(std::uint32_t i, const SideSums& sums) const {
    const std::uint32_t node = level.references[i].node;
    const bool last = i + 1 == level.reference_begin[node + 1];
    for (std::uint32_t which = 0; which < 2; ++which) {
      const bool there = box_in(i, which) != nullptr;
      room.place[2 * i + which] = there ? sums.side[which].count - 1 : none;
      if (last) room.sizes[2 * node + which] = sums.side[which];
    }
  }

 private:
  /// The box of a reference in a child; null if it is not there.
  [[nodiscard]] ZKD_HOST_DEVICE const Box* box_in(std::uint32_t i, std::uint32_t which) const {
    const Reference& reference = level.references[i];
    const Decision& decision = level.decisions[reference.node];
    if (decision.divided == 0) return nullptr;
    const Side side = side_of(reference.box, decision);
    if (side != Side::both)
      return static_cast<std::uint32_t>(side) == which ? &reference.box : nullptr;
    const Box& clipped = room.clipped[2 * room.straddler_of[i] + which];
    return clipped.empty() ? nullptr : &clipped;
  }
};

/// A scan over nodes: which children are open, and where everything goes.
struct CountChildren {
  Level level;
  DivideRoom room;
  SahOptions options;
  LevelTotals* totals;

  ZKD_HOST_DEVICE void operator()(std::uint32_t node, LevelTotals& sum) const {
    if (level.decisions[node].divided == 0) {
      sum.leaf_references += level.count_of(node);
      return;
    }
    ++sum.divided;
    for (std::uint32_t which = 0; which < 2; ++which) {
      const std::uint32_t count = room.sizes[2 * node + which].count;
      if (may_pay(count, level.depth + 1, options)) {
        ++sum.nodes;
        sum.references += count;
      } else {
        sum.leaf_references += count;
      }
    }
  }
  [[nodiscard]] static ZKD_HOST_DEVICE std::uint32_t segment_begin(std::uint32_t) { return 0; }
  ZKD_HOST_DEVICE void take(std::uint32_t node, const LevelTotals& sum) const {
    LevelTotals own;
    (*this)(node, own);
    room.before[node] = {sum.divided - own.divided, sum.nodes - own.nodes,
                         sum.references - own.references,
                         sum.leaf_references - own.leaf_references};
    if (node + 1 == level.node_count) *totals = sum;
  }
};

/// A node's record, and its open children on the next level.
struct MakeChildren {
  Level level;
  DivideRoom room;
  SahOptions options;
  Level next;
  LevelRecord record;

  ZKD_HOST_DEVICE void operator()(std::uint32_t index) const {
    const Decision decision = level.decisions[index];
    LevelTotals at = room.before[index];
    record.leaf_begin[index] = at.leaf_references;
    if (index == 0) {
      record.leaf_begin[level.node_count] = record.leaf_reference_count;
      next.reference_begin[next.node_count] = next.reference_count;
    }
    Node node{};
    node.axis = LevelRecord::not_divided;
    if (decision.divided != 0) {
      node.axis = decision.axis;
      node.plane = decision.plane;
      for (std::uint32_t which = 0; which < 2; ++which) {
        const ChildSize size = room.sizes[2 * index + which];
        for (int a = 0; a < 3; ++a) {
          node.bounds[a][which] = size.box.lo[a];
          node.bounds[a][2 + which] = size.box.hi[a];
        }
        ChildPlace& place = room.places[2 * index + which];
        if (may_pay(size.count, level.depth + 1, options)) {
          place = {at.references, at.nodes};
          node.child[which] = Link::node(at.nodes);
          OpenNode child{level.nodes[index].cell, size.box};
          (which == 0 ? child.cell.hi : child.cell.lo)[decision.axis] = decision.plane;
          next.nodes[at.nodes] = child;
          next.child_of[at.nodes] = 2 * index + which;
          next.reference_begin[at.nodes] = at.references;
          ++at.nodes;
          at.references += size.count;
        } else {
          place = {at.leaf_references, none};
          node.child[which] = Link::leaf(size.count);
          at.leaf_references += size.count;
        }
      }
    }
    record.nodes[index] = node;
  }
};

/// A reference goes to the next level or to a leaf.
struct MoveReference {
  Level level;
  DivideRoom room;
  Level next;
  LevelRecord record;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    const Reference reference = level.references[i];
    const Decision decision = level.decisions[reference.node];
    if (decision.divided == 0) {
      record.leaf_references[record.leaf_begin[reference.node] + i -
                             level.reference_begin[reference.node]] = reference.id;
      return;
    }
    const bool straddles = side_of(reference.box, decision) == Side::both;
    for (std::uint32_t which = 0; which < 2; ++which) {
      std::uint32_t& place = room.place[2 * i + which];
      if (place == none) continue;
      const ChildPlace child = room.places[2 * reference.node + which];
      const std::uint32_t to = child.begin + place;
      if (child.node == none) {
        record.leaf_references[to] = reference.id;
        place = none;
        continue;
      }
      next.references[to] = {
          straddles ? room.clipped[2 * room.straddler_of[i] + which] : reference.box, reference.id,
          child.node};
      place = straddles ? to | clipped_bit : to;
    }
  }
};

}  // namespace zkd::core::wu2011
