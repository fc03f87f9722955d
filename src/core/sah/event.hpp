// SPDX-License-Identifier: Apache-2.0
//
// Events: where the boxes of references begin and end along an axis.
#pragma once

#include <cstdint>

#include <zkd/traversal/arithmetic.hpp>

namespace zkd::core::sah {

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
ZKD_HOST_DEVICE inline std::uint32_t ordered_bits(float x) {
  const std::uint32_t bits = bits_of(x);
  return bits ^ ((bits >> 31) != 0 ? 0xFFFFFFFFu : 0x80000000u);
}

ZKD_HOST_DEVICE inline std::uint32_t kind_and_reference(Kind kind, std::uint32_t reference) {
  return static_cast<std::uint32_t>(kind) << 30 | reference;
}
ZKD_HOST_DEVICE inline Event event_of(float position, Kind kind, std::uint32_t reference) {
  return Event{ordered_bits(position)} << 32 | kind_and_reference(kind, reference);
}
ZKD_HOST_DEVICE inline std::uint32_t position_bits(Event event) {
  return static_cast<std::uint32_t>(event >> 32);
}
ZKD_HOST_DEVICE inline float position_of(Event event) {
  const std::uint32_t ordered = position_bits(event);
  return float_of(ordered ^ ((ordered >> 31) != 0 ? 0x80000000u : 0xFFFFFFFFu));
}
ZKD_HOST_DEVICE inline Kind kind_of(Event event) { return static_cast<Kind>(event >> 30 & 3); }
ZKD_HOST_DEVICE inline std::uint32_t reference_of(Event event) {
  return static_cast<std::uint32_t>(event) & max_references_of_cell;
}
/// Position and kind: all that the order of events may depend on, since indices are of the input.
ZKD_HOST_DEVICE inline std::uint64_t rank_of(Event event) { return event >> 30; }
/// The same event of the same triangle under another index.
ZKD_HOST_DEVICE inline Event renumbered(Event event, std::uint32_t reference) {
  return rank_of(event) << 30 | reference;
}

}  // namespace zkd::core::sah
