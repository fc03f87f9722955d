// SPDX-License-Identifier: Apache-2.0
//
// A part becomes two: references go to the sides they are on, those on both are clipped, and the
// events of the children come out sorted (Wald and Havran 2006, section 4.3).
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/arena.hpp"
#include "core/sah/clip.hpp"
#include "cpu/sah/part.hpp"
#include "cpu/sah/sweep.hpp"

namespace zkd::cpu::sah {

/// Lays out a part of at most `count` references.
template <class Room>
void take_part(Room& room, std::size_t count, Part& part) {
  part.references = room.template take<Reference>(count);
  for (Event*& events : part.events) events = room.template take<Event>(2 * count);
}

/// What is only needed while one part is divided.
struct DivideRoom {
  std::uint32_t* places;  ///< of each reference: its index among those of one child, and which
  Event* fresh[2][3];     ///< events of clipped references, for each child and axis
  std::uint32_t fresh_count[2][3];

  template <class Room>
  void take(Room& room, const Part& part, const Split& split) {
    // Each reference is counted on one side or on both.
    const std::size_t on_both = split.below + split.above - part.count;
    places = room.template take<std::uint32_t>(part.count);
    for (auto& child : fresh)
      for (Event*& events : child) events = room.template take<Event>(2 * on_both);
  }
};

/// References of both children and the fresh events. `children` have room for split.below and
/// split.above references; their cells, depths and counts are made. O(references), and the sorting
/// of what is on both sides.
void divide_references(const Part& part, const Split& split, const Clipper& clip, DivideRoom& room,
                       Part (&children)[2]);

/// Events of both children along one axis: those of references on one side stay in order, and fresh
/// ones are merged in. O(events).
void divide_events(const Part& part, std::uint32_t axis, const DivideRoom& room,
                   Part (&children)[2]);

}  // namespace zkd::cpu::sah
