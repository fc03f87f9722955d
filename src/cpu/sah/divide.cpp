// SPDX-License-Identifier: Apache-2.0
//
// Which reference goes where, and the merging of events.
#include "cpu/sah/divide.hpp"

#include <algorithm>

namespace zkd::cpu::sah {
namespace {

// A place: the side in the two lowest bits, the index above them.
std::uint32_t place_of(Side side, std::uint32_t index) {
  return index << 2 | static_cast<std::uint32_t>(side);
}

// Puts a clipped reference into a child.
void add_clipped(const Reference& reference, std::uint32_t which, DivideRoom& room, Part& child) {
  const std::uint32_t index = child.count++;
  child.references[index] = reference;
  for (std::uint32_t a = 0; a < 3; ++a) {
    const float lo = reference.box.lo[a];
    const float hi = reference.box.hi[a];
    Event* events = room.fresh[which][a];
    std::uint32_t& count = room.fresh_count[which][a];
    if (lo == hi) {
      events[count++] = event_of(lo, Kind::flat, index);
    } else {
      events[count++] = event_of(lo, Kind::start, index);
      events[count++] = event_of(hi, Kind::end, index);
    }
  }
}

// Events of one child as they come, in order, with the fresh ones merged in.
class Merge {
 public:
  Merge(Event* out, const Event* fresh, std::uint32_t fresh_count)
      : begin_(out), out_(out), fresh_(fresh), fresh_end_(fresh + fresh_count) {}

  void add(Event event) {
    while (fresh_ != fresh_end_ && rank_of(*fresh_) < rank_of(event)) *out_++ = *fresh_++;
    *out_++ = event;
  }
  std::uint32_t finish() {
    out_ = std::copy(fresh_, fresh_end_, out_);
    return static_cast<std::uint32_t>(out_ - begin_);
  }

 private:
  Event* begin_;
  Event* out_;
  const Event* fresh_;
  const Event* fresh_end_;
};

}  // namespace

void divide_references(const Part& part, const Split& split, const Clipper& clip, DivideRoom& room,
                       Part (&children)[2]) {
  for (std::uint32_t which = 0; which < 2; ++which) {
    children[which].count = 0;
    children[which].cell = part.cell;
    children[which].depth = part.depth + 1;
    for (std::uint32_t& count : room.fresh_count[which]) count = 0;
  }
  children[0].cell.hi[split.axis] = split.plane;
  children[1].cell.lo[split.axis] = split.plane;

  for (std::uint32_t i = 0; i < part.count; ++i) {
    const Reference& reference = part.references[i];
    const Side side = side_of(reference.box, split);
    if (side == Side::both) {
      room.places[i] = place_of(side, 0);
      for (std::uint32_t which = 0; which < 2; ++which) {
        Reference clipped = reference;
        (which == 0 ? clipped.box.hi : clipped.box.lo)[split.axis] = split.plane;
        if (clip(clipped.id, children[which].cell, clipped.box))
          add_clipped(clipped, which, room, children[which]);
      }
    } else {
      Part& child = children[static_cast<std::uint32_t>(side)];
      room.places[i] = place_of(side, child.count);
      child.references[child.count++] = reference;
    }
  }
  for (std::uint32_t which = 0; which < 2; ++which)
    for (int a = 0; a < 3; ++a)
      std::sort(room.fresh[which][a], room.fresh[which][a] + room.fresh_count[which][a]);
}

void divide_events(const Part& part, std::uint32_t axis, const DivideRoom& room,
                   Part (&children)[2]) {
  Merge merge[2] = {
      {children[0].events[axis], room.fresh[0][axis], room.fresh_count[0][axis]},
      {children[1].events[axis], room.fresh[1][axis], room.fresh_count[1][axis]},
  };
  for (std::uint32_t i = 0; i < part.event_count[axis]; ++i) {
    const Event event = part.events[axis][i];
    const std::uint32_t place = room.places[reference_of(event)];
    const std::uint32_t side = place & 3;
    if (side != static_cast<std::uint32_t>(Side::both))
      merge[side].add(renumbered(event, place >> 2));
  }
  for (int which = 0; which < 2; ++which) children[which].event_count[axis] = merge[which].finish();
}

}  // namespace zkd::cpu::sah
