// SPDX-License-Identifier: Apache-2.0
//
// Depth first, so that a part is still in cache when it is divided. The depth of recursion is that
// of the tree, max_depth at most.
#include "cpu/sah/subtree.hpp"

#include <algorithm>

#include "cpu/sah/divide.hpp"

namespace zkd::cpu::sah {

void write_node(Node& node, const Split& split, const Box (&boxes)[2], const Link (&children)[2]) {
  for (int which = 0; which < 2; ++which) {
    for (int a = 0; a < 3; ++a) {
      node.bounds[a][which] = boxes[which].lo[a];
      node.bounds[a][2 + which] = boxes[which].hi[a];
    }
    node.child[which] = children[which];
  }
  node.plane = split.plane;
  node.axis = split.axis;
}

bool SubtreeBuilder::build(const Part& part, Subtree& subtree) {
  subtree_ = {left_.nodes, left_.leaf_ends, left_.references, Link{}, 0, 0};
  const std::size_t mark = room_.mark();
  const bool enough = grow(part, subtree_.root);
  room_.back_to(mark);
  if (!enough) return false;
  left_.nodes += subtree_.leaf_count;
  left_.leaf_ends += subtree_.leaf_count;
  left_.leaves -= subtree_.leaf_count;
  left_.references += subtree_.reference_count;
  left_.reference_count -= subtree_.reference_count;
  subtree = subtree_;
  return true;
}

bool SubtreeBuilder::grow(const Part& part, Link& link) {
  Split split;
  if (!find_split(part, split)) return !room_.exhausted() && add_leaf(part, link);

  const std::size_t before = room_.mark();
  Part children[2];
  take_part(room_, split.above, children[1]);
  const std::size_t before_lower = room_.mark();
  take_part(room_, split.below, children[0]);
  const std::size_t after = room_.mark();
  DivideRoom divide_room;
  divide_room.take(room_, part, split);
  if (room_.exhausted()) return false;
  divide_references(part, split, clip_, divide_room, children);
  for (std::uint32_t a = 0; a < 3; ++a) divide_events(part, a, divide_room, children);
  room_.back_to(after);

  const Box boxes[2] = {children[0].tight(), children[1].tight()};
  Link links[2];
  if (!grow(children[0], links[0])) return false;
  room_.back_to(before_lower);
  const std::uint32_t node = subtree_.leaf_count - 1;
  if (!grow(children[1], links[1])) return false;
  room_.back_to(before);
  write_node(subtree_.nodes[node], split, boxes, links);
  link = Link::node(node);
  return true;
}

bool SubtreeBuilder::add_leaf(const Part& part, Link& link) {
  if (subtree_.leaf_count == left_.leaves ||
      part.count > left_.reference_count - subtree_.reference_count)
    return false;
  for (std::uint32_t i = 0; i < part.count; ++i)
    subtree_.references[subtree_.reference_count++] = part.references[i].id;
  link = Link::leaf(subtree_.leaf_count);
  subtree_.leaf_ends[subtree_.leaf_count++] = subtree_.reference_count;
  return true;
}

bool SubtreeBuilder::find_split(const Part& part, Split& split) {
  if (!may_pay(part, options_)) return false;
  const std::size_t mark = room_.mark();
  const std::uint32_t most =
      std::max({part.event_count[0], part.event_count[1], part.event_count[2]});
  double* const sums = room_.take<double>(sweep_room(most));
  if (room_.exhausted()) return false;
  Split by_axis[3];
  for (std::uint32_t a = 0; a < 3; ++a) by_axis[a] = sweep(part, a, options_, sums);
  room_.back_to(mark);
  return choose(part, by_axis, options_, split);
}

}  // namespace zkd::cpu::sah
