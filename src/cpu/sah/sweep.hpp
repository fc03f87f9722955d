// SPDX-License-Identifier: Apache-2.0
//
// The surface-area heuristic: the cheapest plane of a part along one axis, by one sweep over its
// events (Wald and Havran 2006, section 4.3).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include <zkd/options.hpp>
#include <zkd/tree.hpp>

#include "core/sah/cost.hpp"
#include "cpu/sah/part.hpp"

namespace zkd::cpu::sah {

/// The best of some planes.
struct Split : CellSplit {
  double cost = std::numeric_limits<double>::infinity();
  std::uint32_t below = 0;  ///< references on each side
  std::uint32_t above = 0;
};

inline bool may_pay(const Part& part, const SahOptions& options) {
  return core::sah::may_pay(part.count, part.depth, options);
}

/// Room that sweep() needs: numbers of type double for a part with so many events along an axis.
inline std::size_t sweep_room(std::size_t events) { return 2 * events; }

/// The cheapest plane along `axis`; of equally cheap ones the lowest, and flat references below.
/// Infinite cost: there is none. O(events).
Split sweep(const Part& part, std::uint32_t axis, const SahOptions& options, double* room);

/// The cheapest of the three axes, of equally cheap ones the first, if it is cheaper than a leaf.
/// Whether it is.
bool choose(const Part& part, const Split (&by_axis)[3], const SahOptions& options, Split& best);

}  // namespace zkd::cpu::sah
