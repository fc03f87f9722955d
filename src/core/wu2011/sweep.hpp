// SPDX-License-Identifier: Apache-2.0
//
// The costs of all split candidates of a level, by scans over its events: what lies above each
// plane is summed downwards, what lies below upwards; then the cheapest of each node.
//
// A candidate lies between two neighbouring events and belongs to one of them: to the last of those
// that end at its position (or are flat there), which is a plane with flat references below, or to
// the first of those that are flat or start there: with flat references above, or where nothing
// else ends.
#pragma once

#include <cstdint>
#include <limits>

#include <zkd/options.hpp>
#include <zkd/traversal/arithmetic.hpp>

#include "core/arena.hpp"
#include "core/wu2011/level.hpp"

namespace zkd::core::wu2011 {

/// What a plane costs that may not divide its node.
inline constexpr double impossible = std::numeric_limits<double>::infinity();

/// Best of some planes: the cheapest, of equally cheap ones the lowest, and flat references below.
struct Candidate {
  double cost = impossible;
  float plane = 0.0F;
  std::uint32_t flat_below = 0;

  ZKD_HOST_DEVICE void combine(const Candidate& other) {
    if (other.cost < cost ||
        (other.cost == cost &&
         (other.plane < plane || (other.plane == plane && other.flat_below > flat_below))))
      *this = other;
  }
};

/// What is only needed while planes are weighed.
struct SweepRoom {
  double* costs;    ///< two an event, of the candidates that belong to it: 2 i that with flat
                    ///< references below, 2 i + 1 the other. Infinite: there is none
  Candidate* best;  ///< of each segment

  void lay_out(Arena& arena, std::size_t events, std::size_t segments) {
    costs = arena.take<double>(2 * events);
    best = arena.take<Candidate>(segments);
  }
};

/// Sums over the events on one side of a plane.
struct Swept {
  Extent extent;             ///< of references that reach to this side of the plane
  std::uint32_t reach = 0;   ///< how many those are
  std::uint32_t inside = 0;  ///< how many of them do not cross the plane
  float nearest = 0.0F;      ///< where the one of these ends that comes nearest to it
  std::uint32_t begins = 0;  ///< 1: a segment begins in between

  ZKD_HOST_DEVICE void combine(const Swept& next) {
    if (next.begins != 0) {
      *this = next;
      return;
    }
    for (int k = 0; k < 2; ++k) {
      extent.lo[k] = smaller(extent.lo[k], next.extent.lo[k]);
      extent.hi[k] = larger(extent.hi[k], next.extent.hi[k]);
    }
    reach += next.reach;
    if (next.inside > 0) nearest = next.nearest;
    inside += next.inside;
  }
  ZKD_HOST_DEVICE void begin() {
    *this = Swept{};
    begins = 1;
  }
  /// Up to where boxes on this side reach.
  [[nodiscard]] ZKD_HOST_DEVICE float end(float plane) const {
    return reach > inside ? plane : nearest;
  }
};

/// What both directions share: an event, its segment, and what planes cost there.
class Sweep {
 public:
  Sweep(const Level& level, const SahOptions& options, double* costs)
      : level_(level), options_(options), room_(costs) {}

 protected:
  ZKD_HOST_DEVICE void move_to(std::uint32_t i) {
    if (!cursor_.move_to(level_, i)) return;
    const OpenNode& node = level_.nodes[cursor_.node];
    costs_ = AxisCosts(node.tight, node.cell, cursor_.axis, options_);
  }

  /// Adds event i. `crossing`: the kind of events of references that reach to the other side too.
  ZKD_HOST_DEVICE void add(std::uint32_t i, Kind crossing, Swept& sum) const {
    const Event event = level_.events[i];
    if (kind_of(event) != crossing) {
      ++sum.inside;
      sum.nearest = position_of(event);
      if (kind_of(event) != Kind::flat) return;
    }
    costs_.include(sum.extent, level_.references[reference_of(event)].box);
    ++sum.reach;
  }

  /// Whether a candidate with flat references below belongs to event i.
  [[nodiscard]] ZKD_HOST_DEVICE bool closes(std::uint32_t i) const {
    return kind_of(level_.events[i]) != Kind::start &&
           (i + 1 == cursor_.end || !level_.same_position(i, i + 1) ||
            kind_of(level_.events[i + 1]) == Kind::start);
  }
  /// Whether another does.
  [[nodiscard]] ZKD_HOST_DEVICE bool opens(std::uint32_t i) const {
    const Kind kind = kind_of(level_.events[i]);
    if (kind == Kind::end) return false;
    return i == cursor_.begin || !level_.same_position(i - 1, i) ||
           (kind == Kind::flat && kind_of(level_.events[i - 1]) == Kind::end);
  }

  Level level_;
  SahOptions options_;
  double* room_;
  Cursor cursor_;
  AxisCosts costs_;
};

/// SahAreas::tight, from the last event of the level to its first: what lies above each candidate.
struct SumAbove : private Sweep {
  using Sweep::Sweep;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i, Swept& sum) {
    const std::uint32_t event = turned(i);
    move_to(event);
    if (event + 1 == cursor_.end) sum.begin();
    add(event, Kind::end, sum);
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t segment_begin(std::uint32_t i) {
    move_to(turned(i));
    return turned(cursor_.end - 1);
  }
  /// `sum`: of event i and all above.
  ZKD_HOST_DEVICE void take(std::uint32_t i, const Swept& sum) {
    const std::uint32_t event = turned(i);
    move_to(event);
    if (event + 1 == cursor_.end && closes(event)) room_[2 * event] = 0.0;
    if (opens(event)) room_[2 * event + 1] = above(event, sum);
    if (event > cursor_.begin && closes(event - 1)) room_[2 * (event - 1)] = above(event - 1, sum);
  }

 private:
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t turned(std::uint32_t i) const {
    return level_.event_count - 1 - i;
  }
  [[nodiscard]] ZKD_HOST_DEVICE double above(std::uint32_t event, const Swept& sum) const {
    const float plane = position_of(level_.events[event]);
    return costs_.above(sum.reach, sum.extent, sum.end(plane));
  }
};

/// From the first event to the last: what lies below, and with what SumAbove left the whole cost.
struct SumBelow : private Sweep {
  using Sweep::Sweep;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i, Swept& sum) {
    move_to(i);
    if (i == cursor_.begin) sum.begin();
    add(i, Kind::start, sum);
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t segment_begin(std::uint32_t i) {
    move_to(i);
    return cursor_.begin;
  }
  /// `sum`: of event i and all below.
  ZKD_HOST_DEVICE void take(std::uint32_t i, const Swept& sum) {
    move_to(i);
    if (i == cursor_.begin) weigh(opens(i), i, Swept{}, room_[2 * i + 1]);
    weigh(closes(i), i, sum, room_[2 * i]);
    if (i + 1 < cursor_.end) weigh(opens(i + 1), i + 1, sum, room_[2 * i + 3]);
  }

 private:
  ZKD_HOST_DEVICE void weigh(bool is_candidate, std::uint32_t event, const Swept& sum,
                             double& cost) const {
    double whole = impossible;
    if (is_candidate) {
      const float plane = position_of(level_.events[event]);
      if (options_.areas == SahAreas::cells) {
        if (costs_.admits_cells(plane))
          whole = costs_.cells(plane, sum.reach, level_.count_of(cursor_.node) - sum.inside);
      } else if (costs_.admits_tight(plane, kind_of(level_.events[event]) == Kind::flat)) {
        whole = costs_.visit() + costs_.below(sum.reach, sum.extent, sum.end(plane)) + cost;
      }
    }
    cost = whole;
  }
};

/// Both candidates of event i.
struct OfferCandidates {
  const Event* events;
  const double* costs;

  ZKD_HOST_DEVICE void operator()(std::uint32_t, std::uint32_t i, Candidate& best) const {
    const float plane = position_of(events[i]);
    best.combine({costs[2 * i], plane, 1});
    best.combine({costs[2 * i + 1], plane, kind_of(events[i]) == Kind::flat ? 0u : 1u});
  }
};

/// The cheapest of the three axes, of equally cheap ones the first, if it is cheaper than a leaf.
struct Decide {
  Level level;
  SahOptions options;
  const Candidate* best;

  ZKD_HOST_DEVICE void operator()(std::uint32_t node) const {
    Decision decision;
    Candidate cheapest;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const Candidate& candidate = best[level.segment(axis, node)];
      if (axis > 0 && !(candidate.cost < cheapest.cost)) continue;
      cheapest = candidate;
      decision.axis = axis;
    }
    decision.plane = cheapest.plane;
    decision.flat_below = cheapest.flat_below;
    const double leaf =
        leaf_cost(level.nodes[node].tight, level.nodes[node].cell, level.count_of(node), options);
    decision.divided = cheapest.cost < leaf ? 1 : 0;
    level.decisions[node] = decision;
  }
};

}  // namespace zkd::core::wu2011
