// SPDX-License-Identifier: Apache-2.0
//
// The lists that the SAH builder sweeps: references, and their events along each axis.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>

#include "core/sah/event.hpp"

namespace zkd::cpu::sah {

// Events, costs and clipping are those of every builder that weighs areas.
using namespace core::sah;

/// A triangle in a cell. All positions are in tree space.
struct Reference {
  Box box;  ///< holds all of the triangle that lies in the cell
  std::uint32_t id;
};

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
