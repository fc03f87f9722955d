// SPDX-License-Identifier: Apache-2.0
//
// Sweeps over the events of a part, for both ways to measure areas.
#include "cpu/sah/sweep.hpp"

namespace zkd::cpu::sah {
namespace {

/// One axis of a part.
class Sweep {
 public:
  Sweep(const Part& part, std::uint32_t axis, const SahOptions& options)
      : part_(part),
        events_(part.events[axis]),
        end_(part.event_count[axis]),
        tight_(part.tight()),
        lowest_(tight_.lo[axis]),
        costs_(tight_, part.cell, axis, options) {
    best_.axis = axis;
  }

  /// SahAreas::tight: downwards for what lies above each plane, then upwards for what lies below.
  Split by_tight_boxes(double* room) {
    sum_above(room);
    float last = lowest_;     // where what has ended ended last
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
      const double without_flat = costs_.below(begun, extent, crosses ? plane : last);
      const std::uint32_t first_flat = i;
      for (; is(i, at, Kind::flat); ++i) include(extent, i);
      const std::uint32_t flat = i - first_flat;
      if (flat > 0) last = plane;
      if (costs_.admits_tight(plane, flat > 0)) {
        const double with_flat =
            flat > 0 ? costs_.below(begun + flat, extent, plane) : without_flat;
        offer(costs_.visit() + with_flat + room[2 * group], plane, true, begun + flat,
              part_.count - ended - flat);
        if (flat > 0)
          offer(costs_.visit() + without_flat + room[2 * group + 1], plane, false, begun,
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
    std::uint32_t below = 0;
    std::uint32_t above = part_.count;
    for (std::uint32_t i = 0; i < end_;) {
      const std::uint32_t at = position_bits(events_[i]);
      const float plane = position_of(events_[i]);
      for (; is(i, at, Kind::end); ++i) --above;
      const std::uint32_t first_flat = i;
      for (; is(i, at, Kind::flat); ++i) --above;
      const std::uint32_t flat = i - first_flat;
      if (costs_.admits_cells(plane)) {
        offer(costs_.cells(plane, below + flat, above), plane, true, below + flat, above);
        if (flat > 0)
          offer(costs_.cells(plane, below, above + flat), plane, false, below, above + flat);
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
    costs_.include(extent, part_.references[reference_of(events_[i])].box);
  }

  /// For the first event i of each position: the cost of what lies above it in room[2 i], and with
  /// flat references in room[2 i + 1].
  void sum_above(double* room) const {
    float first = tight_.hi[best_.axis];  // where what begins above the plane begins first
    Extent extent;                        // of all that reaches above the plane
    std::uint32_t reach = 0;              // how many those are
    std::uint32_t inside = 0;             // how many of them do not begin below it
    for (std::uint32_t i = end_; i > 0;) {
      const std::uint32_t at = position_bits(events_[i - 1]);
      const float plane = position_of(events_[i - 1]);
      const std::uint32_t group_end = i;
      for (; i > 0 && is(i - 1, at, Kind::start); --i) ++inside;
      if (i < group_end) first = plane;
      const bool crosses = reach > inside;
      const double without_flat = costs_.above(reach, extent, crosses ? plane : first);
      const std::uint32_t flat_end = i;
      for (; i > 0 && is(i - 1, at, Kind::flat); --i) include(extent, i - 1);
      const std::uint32_t flat = flat_end - i;
      if (flat > 0) first = plane;
      const double with_flat = flat > 0 ? costs_.above(reach + flat, extent, plane) : without_flat;
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

  void offer(double cost, float plane, bool flat_below, std::uint32_t below, std::uint32_t above) {
    if (!(cost < best_.cost)) return;
    best_.cost = cost;
    best_.plane = plane;
    best_.flat_below = flat_below ? 1 : 0;
    best_.below = below;
    best_.above = above;
  }

  const Part& part_;
  const Event* events_;
  std::uint32_t end_;
  Box tight_;
  float lowest_;
  AxisCosts costs_;
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
  const double leaf = leaf_cost(part.tight(), part.cell, part.count, options);
  return best.cost < leaf;
}

}  // namespace zkd::cpu::sah
