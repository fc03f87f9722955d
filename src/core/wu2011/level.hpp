// SPDX-License-Identifier: Apache-2.0
//
// One level of the tree while it is built: its open nodes, left to right, what they list, and the
// events of all of them along each axis.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>

#include "core/arena.hpp"
#include "core/sah/cost.hpp"
#include "core/sah/event.hpp"

namespace zkd::core::wu2011 {

// Events, costs and clipping are those of every builder that weighs areas.
using namespace sah;

/// Where there is none: no child on this side, no open node.
inline constexpr std::uint32_t none = 0xFFFFFFFFu;

/// A triangle in an open node. All positions are in tree space.
struct Reference {
  Box box;  ///< holds all of the triangle that lies in the cell
  std::uint32_t id;
  std::uint32_t node;  ///< of the level
};

/// A node that a split may still pay for.
struct OpenNode {
  Box cell;
  Box tight;  ///< of its references
};

/// What becomes of an open node.
struct Decision : CellSplit {
  std::uint32_t divided = 0;  ///< 1: at this plane, 0: it is a leaf
};

/// References a level may have: 32 bits number its events, six a reference, and CUB takes counts
/// below 2^31.
inline constexpr std::uint32_t max_references_of_level = 0x7FFFFFFFu / 6;

/// Segments are what one node has along one axis: first those of all nodes along x, then y, then z.
struct Level {
  OpenNode* nodes;
  Decision* decisions;             ///< of each node, when its planes are weighed
  std::uint32_t* child_of;         ///< of each node: 2 * parent + 1 if it lies above the plane
  std::uint32_t* reference_begin;  ///< of each node, and the end
  Reference* references;           ///< node by node, ids ascending in each
  std::uint32_t* event_counts;     ///< of each segment
  std::uint32_t* event_begin;      ///< of each segment, and the end
  Event* events;                   ///< segment by segment, ascending; of references of the level
  std::uint32_t node_count = 0;
  std::uint32_t reference_count = 0;
  std::uint32_t event_count = 0;
  std::uint32_t depth = 0;

  /// All but the events, which are counted later.
  void lay_out(Arena& arena, std::size_t node_room, std::size_t reference_room) {
    nodes = arena.take<OpenNode>(node_room);
    decisions = arena.take<Decision>(node_room);
    child_of = arena.take<std::uint32_t>(node_room);
    reference_begin = arena.take<std::uint32_t>(node_room + 1);
    references = arena.take<Reference>(reference_room);
    event_counts = arena.take<std::uint32_t>(3 * node_room);
    event_begin = arena.take<std::uint32_t>(3 * node_room + 1);
  }

  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t segment(std::uint32_t axis,
                                                      std::uint32_t node) const {
    return axis * node_count + node;
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t count_of(std::uint32_t node) const {
    return reference_begin[node + 1] - reference_begin[node];
  }
  [[nodiscard]] ZKD_HOST_DEVICE bool same_position(std::uint32_t i, std::uint32_t j) const {
    return position_bits(events[i]) == position_bits(events[j]);
  }
};

/// The segment of one event after the other: neighbours mostly share it.
struct Cursor {
  std::uint32_t axis = 0;
  std::uint32_t node = 0;
  std::uint32_t begin = 0;
  std::uint32_t end = 0;

  /// Whether event i is in another segment than the last.
  ZKD_HOST_DEVICE bool move_to(const Level& level, std::uint32_t i) {
    if (begin <= i && i < end) return false;
    node = level.references[reference_of(level.events[i])].node;
    axis = i >= level.event_begin[2 * level.node_count] ? 2
           : i >= level.event_begin[level.node_count]   ? 1
                                                        : 0;
    begin = level.event_begin[level.segment(axis, node)];
    end = level.event_begin[level.segment(axis, node) + 1];
    return true;
  }
};

/// Whether a box begins or ends at this event of an axis.
ZKD_HOST_DEVICE inline bool has_event(const Box& box, std::uint32_t axis, Kind kind,
                                      float position) {
  const float lo = box.lo[axis];
  const float hi = box.hi[axis];
  if (kind == Kind::flat) return lo == hi && lo == position;
  return lo < hi && (kind == Kind::start ? lo : hi) == position;
}

}  // namespace zkd::core::wu2011
