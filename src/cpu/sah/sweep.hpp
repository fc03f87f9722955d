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

#include "cpu/sah/event.hpp"

namespace zkd::cpu::sah {

/// A plane, and what it costs: expected triangle tests and node visits of a ray that meets the
/// part, times the area of the part.
struct Split {
  double cost = std::numeric_limits<double>::infinity();
  float plane = 0.0F;
  std::uint32_t axis = 0;
  bool flat_below = false;  ///< to which side references go that lie in the plane
  std::uint32_t below = 0;  ///< references on each side
  std::uint32_t above = 0;
};

/// Where references lie with respect to a split.
enum class Side : std::uint32_t { below, above, both };

inline Side side_of(const Box& box, const Split& split) {
  const float lo = box.lo[split.axis];
  const float hi = box.hi[split.axis];
  if (lo == split.plane && hi == split.plane) return split.flat_below ? Side::below : Side::above;
  if (hi <= split.plane) return Side::below;
  if (lo >= split.plane) return Side::above;
  return Side::both;
}

/// Half the surface of a box from its sides; 0 for an empty one.
inline double half_area(double x, double y, double z) { return x * y + y * z + z * x; }

/// Whether any split may be cheaper than a leaf: one visit costs less than the tests of all
/// references, and a walk may go deeper.
inline bool may_pay(const Part& part, const SahOptions& options) {
  const double least =
      static_cast<double>(options.visit_cost) *
      (options.areas == SahAreas::tight ? 1.0 : 1.0 - static_cast<double>(options.empty_bonus));
  const double tests = static_cast<double>(options.test_cost) * part.count;
  return part.depth < max_depth && tests > least;
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
