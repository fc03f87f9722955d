// SPDX-License-Identifier: Apache-2.0
//
// The lists that the SAH builder sweeps: references, and their events along each axis.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>

namespace zkd::cpu::sah {

/// A triangle in a cell. All positions are in tree space.
struct Reference {
  Box box;  ///< holds all of the triangle that lies in the cell
  std::uint32_t id;
};

/// What happens to a reference at a position (Wald and Havran 2006, section 4.2). In this order
/// where positions are equal: what ends at a plane is not above it, what starts there not below.
enum class Kind : std::uint32_t {
  end,    ///< of its box
  flat,   ///< its box is flat here: start and end in one
  start,  ///< of its box
};

/// References of one cell: their number must leave two bits for the kind.
inline constexpr std::uint32_t max_references_of_cell = (1u << 30) - 1;

/// Ordered by position, then kind, then reference: sorting events is sorting integers.
///
///     bits 63..32  position, so that unsigned integers order it
///          31..30  kind
///          29..0   index into the references of the cell
using Event = std::uint64_t;

/// Bits of a float that unsigned integers order as the float (which is not -0, nor NaN).
inline std::uint32_t ordered_bits(float x) {
  const std::uint32_t bits = core::bits_of(x);
  return bits ^ ((bits >> 31) != 0 ? 0xFFFFFFFFu : 0x80000000u);
}

inline std::uint32_t kind_and_reference(Kind kind, std::uint32_t reference) {
  return static_cast<std::uint32_t>(kind) << 30 | reference;
}
inline Event event_of(float position, Kind kind, std::uint32_t reference) {
  return Event{ordered_bits(position)} << 32 | kind_and_reference(kind, reference);
}
inline std::uint32_t position_bits(Event event) { return static_cast<std::uint32_t>(event >> 32); }
inline float position_of(Event event) {
  const std::uint32_t ordered = position_bits(event);
  return core::float_of(ordered ^ ((ordered >> 31) != 0 ? 0x80000000u : 0xFFFFFFFFu));
}
inline Kind kind_of(Event event) { return static_cast<Kind>(event >> 30 & 3); }
inline std::uint32_t reference_of(Event event) {
  return static_cast<std::uint32_t>(event) & max_references_of_cell;
}
/// Position and kind: all that the order of events may depend on, since indices are of the input.
inline std::uint64_t rank_of(Event event) { return event >> 30; }
/// The same event of the same triangle under another index.
inline Event renumbered(Event event, std::uint32_t reference) {
  return rank_of(event) << 30 | reference;
}

/// A node to be: a cell and what lies in it.
struct Part {
  Reference* references;
  Event* events[3];  ///< sorted; two a reference, one where it is flat
  std::uint32_t count;
  std::uint32_t event_count[3];
  Box cell;
  std::uint32_t depth;

  /// The box of all references: the first event along an axis is where one starts, the last where
  /// one ends. Empty for none.
  [[nodiscard]] Box tight() const {
    Box box;
    for (int a = 0; a < 3 && count > 0; ++a) {
      box.lo[a] = position_of(events[a][0]);
      box.hi[a] = position_of(events[a][event_count[a] - 1]);
    }
    return box;
  }
};

}  // namespace zkd::cpu::sah
