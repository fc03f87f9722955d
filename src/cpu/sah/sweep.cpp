// SPDX-License-Identifier: Apache-2.0
//
// Sweeps over the events of a part, for both ways to measure areas.
#include "cpu/sah/sweep.hpp"

namespace zkd::cpu::sah {
namespace {

/// What references extend along the two axes that are not swept.
struct Extent {
  float lo[2] = {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity()};
  float hi[2] = {-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
};

double length(float lo, float hi) { return static_cast<double>(hi) - static_cast<double>(lo); }

/// One axis of a part.
class Sweep {
 public:
  Sweep(const Part& part, std::uint32_t axis, const SahOptions& options)
      : part_(part),
        events_(part.events[axis]),
        end_(part.event_count[axis]),
        axis_(axis),
        across_{axis == 0 ? 1u : 0u, axis == 2 ? 1u : 2u},
        cell_lo_(part.cell.lo[axis]),
        cell_hi_(part.cell.hi[axis]),
        test_cost_(static_cast<double>(options.test_cost)),
        visit_cost_(static_cast<double>(options.visit_cost)),
        kept_after_bonus_(1.0 - static_cast<double>(options.empty_bonus)) {
    best_.axis = axis;
  }

  /// SahAreas::tight: downwards for what lies above each plane, then upwards for what lies below.
  Split by_tight_boxes(double* room) {
    sum_above(room);
    const Box whole = part_.tight();
    const double visit =
        visit_cost_ * half_area(length(whole.lo[0], whole.hi[0]), length(whole.lo[1], whole.hi[1]),
                                length(whole.lo[2], whole.hi[2]));
    const float lowest = whole.lo[axis_];
    float last = lowest;      // where what has ended ended last
    Extent extent;            // of all that begins below the plane
    std::uint32_t begun = 0;  // how many those are
    std::uint32_t ended = 0;  // how many of them do not reach above it
    for (std::uint32_t i = 0; i < end_;) {
      const std::uint32_t at = position_bits(events_[i]);
      const float plane = position_of(events_[i]);
      const std::uint32_t group = i;
      for (; is(i, at, Kind::end); ++i) ++ended;
      if (i > group) last = plane;
      const bool crosses = begun > ended;
      const double without_flat = cost_of(begun, extent, length(lowest, crosses ? plane : last));
      const std::uint32_t first_flat = i;
      for (; is(i, at, Kind::flat); ++i) include(extent, i);
      const std::uint32_t flat = i - first_flat;
      if (flat > 0) last = plane;
      if (admits(plane, flat)) {
        const double with_flat =
            flat > 0 ? cost_of(begun + flat, extent, length(lowest, plane)) : without_flat;
        offer(visit + with_flat + room[2 * group], plane, true, begun + flat,
              part_.count - ended - flat);
        if (flat > 0)
          offer(visit + without_flat + room[2 * group + 1], plane, false, begun,
                part_.count - ended);
      }
      begun += flat;
      ended += flat;
      for (; is(i, at, Kind::start); ++i) {
        include(extent, i);
        ++begun;
      }
    }
    return best_;
  }

  /// SahAreas::cells: areas follow from the plane alone.
  Split by_cells() {
    const double x = length(part_.cell.lo[across_[0]], part_.cell.hi[across_[0]]);
    const double y = length(part_.cell.lo[across_[1]], part_.cell.hi[across_[1]]);
    const double visit = visit_cost_ * half_area(length(cell_lo_, cell_hi_), x, y);
    std::uint32_t below = 0;
    std::uint32_t above = part_.count;
    for (std::uint32_t i = 0; i < end_;) {
      const std::uint32_t at = position_bits(events_[i]);
      const float plane = position_of(events_[i]);
      for (; is(i, at, Kind::end); ++i) --above;
      const std::uint32_t first_flat = i;
      for (; is(i, at, Kind::flat); ++i) --above;
      const std::uint32_t flat = i - first_flat;
      if (cell_lo_ < plane && plane < cell_hi_) {
        const double area_below = half_area(length(cell_lo_, plane), x, y);
        const double area_above = half_area(length(plane, cell_hi_), x, y);
        const auto try_sides = [&](bool flat_below, std::uint32_t n_below, std::uint32_t n_above) {
          const double cost = visit + test_cost_ * (area_below * n_below + area_above * n_above);
          offer(n_below == 0 || n_above == 0 ? cost * kept_after_bonus_ : cost, plane, flat_below,
                n_below, n_above);
        };
        try_sides(true, below + flat, above);
        if (flat > 0) try_sides(false, below, above + flat);
      }
      below += flat;
      for (; is(i, at, Kind::start); ++i) ++below;
    }
    return best_;
  }

 private:
  [[nodiscard]] bool is(std::uint32_t i, std::uint32_t at, Kind kind) const {
    return i < end_ && position_bits(events_[i]) == at && kind_of(events_[i]) == kind;
  }

  void include(Extent& extent, std::uint32_t i) const {
    const Box& box = part_.references[reference_of(events_[i])].box;
    for (int k = 0; k < 2; ++k) {
      extent.lo[k] = core::smaller(extent.lo[k], box.lo[across_[k]]);
      extent.hi[k] = core::larger(extent.hi[k], box.hi[across_[k]]);
    }
  }

  [[nodiscard]] double cost_of(std::uint32_t count, const Extent& extent, double along) const {
    if (count == 0) return 0.0;
    return test_cost_ * (half_area(along, length(extent.lo[0], extent.hi[0]),
                                   length(extent.lo[1], extent.hi[1])) *
                         count);
  }

  /// For the first event i of each position: the cost of what lies above it in room[2 i], and with
  /// flat references in room[2 i + 1].
  void sum_above(double* room) const {
    const float highest = position_of(events_[end_ - 1]);
    float first = highest;     // where what begins above the plane begins first
    Extent extent;             // of all that reaches above the plane
    std::uint32_t reach = 0;   // how many those are
    std::uint32_t inside = 0;  // how many of them do not begin below it
    for (std::uint32_t i = end_; i > 0;) {
      const std::uint32_t at = position_bits(events_[i - 1]);
      const float plane = position_of(events_[i - 1]);
      const std::uint32_t group_end = i;
      for (; i > 0 && is(i - 1, at, Kind::start); --i) ++inside;
      if (i < group_end) first = plane;
      const bool crosses = reach > inside;
      const double without_flat = cost_of(reach, extent, length(crosses ? plane : first, highest));
      const std::uint32_t flat_end = i;
      for (; i > 0 && is(i - 1, at, Kind::flat); --i) include(extent, i - 1);
      const std::uint32_t flat = flat_end - i;
      if (flat > 0) first = plane;
      const double with_flat =
          flat > 0 ? cost_of(reach + flat, extent, length(plane, highest)) : without_flat;
      reach += flat;
      inside += flat;
      for (; i > 0 && is(i - 1, at, Kind::end); --i) {
        include(extent, i - 1);
        ++reach;
      }
      room[2 * i] = without_flat;
      room[2 * i + 1] = with_flat;
    }
  }

  /// A plane lies inside the cell, or in a face of it where references lie in that face: they get a
  /// flat cell for themselves.
  [[nodiscard]] bool admits(float plane, std::uint32_t flat) const {
    return cell_lo_ < cell_hi_ && (flat > 0 || (cell_lo_ < plane && plane < cell_hi_));
  }

  void offer(double cost, float plane, bool flat_below, std::uint32_t below, std::uint32_t above) {
    if (!(cost < best_.cost)) return;
    best_.cost = cost;
    best_.plane = plane;
    best_.flat_below = flat_below;
    best_.below = below;
    best_.above = above;
  }

  const Part& part_;
  const Event* events_;
  std::uint32_t end_;
  std::uint32_t axis_;
  std::uint32_t across_[2];
  float cell_lo_;
  float cell_hi_;
  double test_cost_;
  double visit_cost_;
  double kept_after_bonus_;
  Split best_;
};

}  // namespace

Split sweep(const Part& part, std::uint32_t axis, const SahOptions& options, double* room) {
  Sweep sweep(part, axis, options);
  return options.areas == SahAreas::tight ? sweep.by_tight_boxes(room) : sweep.by_cells();
}

bool choose(const Part& part, const Split (&by_axis)[3], const SahOptions& options, Split& best) {
  best = by_axis[0];
  for (int a = 1; a < 3; ++a)
    if (by_axis[a].cost < best.cost) best = by_axis[a];
  const Box box = options.areas == SahAreas::tight ? part.tight() : part.cell;
  const double leaf = static_cast<double>(options.test_cost) *
                      (half_area(static_cast<double>(box.hi[0]) - static_cast<double>(box.lo[0]),
                                 static_cast<double>(box.hi[1]) - static_cast<double>(box.lo[1]),
                                 static_cast<double>(box.hi[2]) - static_cast<double>(box.lo[2])) *
                       part.count);
  return best.cost < leaf;
}

}  // namespace zkd::cpu::sah
