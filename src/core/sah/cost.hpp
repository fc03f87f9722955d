// SPDX-License-Identifier: Apache-2.0
//
// The surface-area heuristic: what a split plane costs, and when it pays (MacDonald and Booth 1990;
// Wald and Havran 2006, section 4). The same sums in the same order for every builder, so that all
// choose the same planes.
#pragma once

#include <cstdint>
#include <limits>

#include <zkd/config.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/tree.hpp>

namespace zkd::core::sah {

/// Where a cell is divided in two.
struct CellSplit {
  float plane = 0.0F;
  std::uint32_t axis = 0;
  std::uint32_t flat_below = 0;  ///< 1: references that lie in the plane go below, 0: above
};

/// Where references lie with respect to a split.
enum class Side : std::uint32_t { below, above, both };

ZKD_HOST_DEVICE inline Side side_of(const Box& box, const CellSplit& split) {
  const float lo = box.lo[split.axis];
  const float hi = box.hi[split.axis];
  if (lo == split.plane && hi == split.plane)
    return split.flat_below != 0 ? Side::below : Side::above;
  if (hi <= split.plane) return Side::below;
  if (lo >= split.plane) return Side::above;
  return Side::both;
}

ZKD_HOST_DEVICE inline double length(float lo, float hi) {
  return static_cast<double>(hi) - static_cast<double>(lo);
}

/// Half the surface of a box from its sides; 0 for an empty one.
ZKD_HOST_DEVICE inline double half_area(double x, double y, double z) {
  return x * y + y * z + z * x;
}
ZKD_HOST_DEVICE inline double half_area(const Box& box) {
  return half_area(length(box.lo[0], box.hi[0]), length(box.lo[1], box.hi[1]),
                   length(box.lo[2], box.hi[2]));
}

/// Whether any split of so many references may be cheaper than a leaf: one visit costs less than
/// the tests of all, and a walk may go deeper.
ZKD_HOST_DEVICE inline bool may_pay(std::uint32_t count, std::uint32_t depth,
                                    const SahOptions& options) {
  const double least =
      static_cast<double>(options.visit_cost) *
      (options.areas == SahAreas::tight ? 1.0 : 1.0 - static_cast<double>(options.empty_bonus));
  const double tests = static_cast<double>(options.test_cost) * count;
  return depth < max_depth && tests > least;
}

/// What a node costs as a leaf. `tight`: the box of its references.
ZKD_HOST_DEVICE inline double leaf_cost(const Box& tight, const Box& cell, std::uint32_t count,
                                        const SahOptions& options) {
  return static_cast<double>(options.test_cost) *
         (half_area(options.areas == SahAreas::tight ? tight : cell) * count);
}

/// What references extend along the two axes that planes are not sought along.
struct Extent {
  float lo[2] = {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity()};
  float hi[2] = {-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
};

/// The cost of planes of one node along one axis: expected triangle tests and node visits of a ray
/// that meets the node, times the area of the node.
class AxisCosts {
 public:
  AxisCosts() = default;
  ZKD_HOST_DEVICE AxisCosts(const Box& tight, const Box& cell, std::uint32_t axis,
                            const SahOptions& options)
      : across_{axis == 0 ? 1u : 0u, axis == 2 ? 1u : 2u},
        lowest_(tight.lo[axis]),
        highest_(tight.hi[axis]),
        cell_lo_(cell.lo[axis]),
        cell_hi_(cell.hi[axis]),
        test_cost_(static_cast<double>(options.test_cost)),
        kept_after_bonus_(1.0 - static_cast<double>(options.empty_bonus)) {
    const auto visit_cost = static_cast<double>(options.visit_cost);
    if (options.areas == SahAreas::tight) {
      visit_ = visit_cost * half_area(tight);
    } else {
      sides_[0] = length(cell.lo[across_[0]], cell.hi[across_[0]]);
      sides_[1] = length(cell.lo[across_[1]], cell.hi[across_[1]]);
      visit_ = visit_cost * half_area(length(cell_lo_, cell_hi_), sides_[0], sides_[1]);
    }
  }

  ZKD_HOST_DEVICE void include(Extent& extent, const Box& box) const {
    for (int k = 0; k < 2; ++k) {
      extent.lo[k] = smaller(extent.lo[k], box.lo[across_[k]]);
      extent.hi[k] = larger(extent.hi[k], box.hi[across_[k]]);
    }
  }

  /// SahAreas::tight: a plane lies inside the cell, or in a face of it where references lie in that
  /// face: they get a flat cell for themselves.
  [[nodiscard]] ZKD_HOST_DEVICE bool admits_tight(float plane, bool any_flat) const {
    return cell_lo_ < cell_hi_ && (any_flat || admits_cells(plane));
  }
  /// SahAreas::cells.
  [[nodiscard]] ZKD_HOST_DEVICE bool admits_cells(float plane) const {
    return cell_lo_ < plane && plane < cell_hi_;
  }

  /// SahAreas::tight: what `count` references cost that reach from the lower end of the node up to
  /// `end`, or from `begin` to its upper end. The sum of both and visit() is the cost of the plane.
  [[nodiscard]] ZKD_HOST_DEVICE double below(std::uint32_t count, const Extent& extent,
                                             float end) const {
    return tests(count, extent, length(lowest_, end));
  }
  [[nodiscard]] ZKD_HOST_DEVICE double above(std::uint32_t count, const Extent& extent,
                                             float begin) const {
    return tests(count, extent, length(begin, highest_));
  }
  [[nodiscard]] ZKD_HOST_DEVICE double visit() const { return visit_; }

  /// SahAreas::cells: the whole cost follows from the plane and how many references are on each
  /// side.
  [[nodiscard]] ZKD_HOST_DEVICE double cells(float plane, std::uint32_t below,
                                             std::uint32_t above) const {
    const double area_below = half_area(length(cell_lo_, plane), sides_[0], sides_[1]);
    const double area_above = half_area(length(plane, cell_hi_), sides_[0], sides_[1]);
    const double cost = visit_ + test_cost_ * (area_below * below + area_above * above);
    return below == 0 || above == 0 ? cost * kept_after_bonus_ : cost;
  }

 private:
  [[nodiscard]] ZKD_HOST_DEVICE double tests(std::uint32_t count, const Extent& extent,
                                             double along) const {
    if (count == 0) return 0.0;
    return test_cost_ * (half_area(along, length(extent.lo[0], extent.hi[0]),
                                   length(extent.lo[1], extent.hi[1])) *
                         count);
  }

  std::uint32_t across_[2] = {};
  float lowest_ = 0.0F;
  float highest_ = 0.0F;
  float cell_lo_ = 0.0F;
  float cell_hi_ = 0.0F;
  double sides_[2] = {};
  double test_cost_ = 0.0;
  double kept_after_bonus_ = 0.0;
  double visit_ = 0.0;
};

}  // namespace zkd::core::sah
