// SPDX-License-Identifier: Apache-2.0
//
// The events of the next level, sorted: those of this level stay in order, and only what clipping
// moved is sorted, in buckets between them.
//
// Events of this level are the buckets: a fresh event goes behind all events of its node that do
// not come after it, which bisection finds. So only fresh events are sorted, and each kept one
// moves by as many places as there are fresh ones before it: the last of each bucket notes how many
// those are, and a scan hands the notes on.
#pragma once

#include <cstdint>

#include <zkd/traversal/arithmetic.hpp>

#include "core/arena.hpp"
#include "core/verbs.hpp"
#include "core/wu2011/divide.hpp"
#include "core/wu2011/level.hpp"

namespace zkd::core::wu2011 {

/// What is only needed while events are sorted.
struct EventRoom {
  SortBuffers<std::uint64_t> sort;  ///< fresh events: segment (from bit 34 on) and rank; reference
  std::uint32_t* bucket;            ///< of each: the event of this level that it goes before
  std::uint32_t* first;             ///< of each segment of the next level that has any: its first
  std::uint32_t* end;               ///< and behind its last
  std::uint32_t* notes;  ///< two an event of this level, for each child: how many fresh events of
                         ///< the child go before it, if one is in its bucket; else 0. Then, where
                         ///< not 0: how many events of the child that are kept

  void lay_out(Arena& arena, std::size_t fresh, std::size_t next_segments, std::size_t events) {
    sort = {arena.take<std::uint64_t>(fresh), arena.take<std::uint32_t>(fresh),
            arena.take<std::uint64_t>(fresh), arena.take<std::uint32_t>(fresh)};
    bucket = arena.take<std::uint32_t>(fresh);
    first = arena.take<std::uint32_t>(next_segments);
    end = arena.take<std::uint32_t>(next_segments);
    notes = arena.take<std::uint32_t>(2 * events);
  }
};

inline constexpr std::uint32_t rank_bits = 34;

ZKD_HOST_DEVICE inline std::uint64_t fresh_key(std::uint32_t segment, float position, Kind kind) {
  return std::uint64_t{segment} << rank_bits | rank_of(event_of(position, kind, 0));
}
ZKD_HOST_DEVICE inline std::uint32_t segment_of(std::uint64_t key) {
  return static_cast<std::uint32_t>(key >> rank_bits);
}
ZKD_HOST_DEVICE inline std::uint64_t rank_in(std::uint64_t key) {
  return key & ((std::uint64_t{1} << rank_bits) - 1);
}
ZKD_HOST_DEVICE inline Event event_in(std::uint64_t key, std::uint32_t reference) {
  return rank_in(key) << 30 | reference;
}

/// visit(kind, position) for the events of a box along an axis.
template <class Visit>
ZKD_HOST_DEVICE void for_each_event(const Box& box, std::uint32_t axis, const Visit& visit) {
  const float lo = box.lo[axis];
  const float hi = box.hi[axis];
  if (lo == hi) {
    visit(Kind::flat, lo);
  } else {
    visit(Kind::start, lo);
    visit(Kind::end, hi);
  }
}

/// Sums over references of one node: events along each axis.
struct EventSums {
  std::uint32_t along[3] = {};
  std::uint32_t begins = 0;  ///< 1: a node begins in between

  ZKD_HOST_DEVICE void combine(const EventSums& next) {
    if (next.begins != 0) {
      *this = next;
      return;
    }
    for (int a = 0; a < 3; ++a) along[a] += next.along[a];
  }
};

/// A scan over references: fills Level::event_counts.
struct CountEvents {
  Level level;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i, EventSums& sums) const {
    const Reference& reference = level.references[i];
    if (i == level.reference_begin[reference.node]) {
      sums = EventSums{};
      sums.begins = 1;
    }
    for (int a = 0; a < 3; ++a) sums.along[a] += reference.box.lo[a] < reference.box.hi[a] ? 2 : 1;
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t segment_begin(std::uint32_t i) const {
    return level.reference_begin[level.references[i].node];
  }
  ZKD_HOST_DEVICE void take(std::uint32_t i, const EventSums& sums) const {
    const std::uint32_t node = level.references[i].node;
    if (i + 1 != level.reference_begin[node + 1]) return;
    for (std::uint32_t a = 0; a < 3; ++a)
      level.event_counts[level.segment(a, node)] = sums.along[a];
  }
};

struct ReadEventCount {
  const std::uint32_t* counts;
  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t segment) const { return counts[segment]; }
};

// ---- The root: every event is fresh -------------------------------------------------------------

struct CountEventsOfReference {
  const Reference* references;

  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t i) const {
    const Box& box = references[i].box;
    std::uint32_t count = 3;
    for (int a = 0; a < 3; ++a) count += box.lo[a] < box.hi[a] ? 1 : 0;
    return count;
  }
};

struct EmitEvents {
  const Reference* references;
  const std::uint32_t* begin;
  std::uint64_t* keys;
  std::uint32_t* values;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    std::uint32_t to = begin[i];
    for (std::uint32_t axis = 0; axis < 3; ++axis)
      for_each_event(references[i].box, axis, [&](Kind kind, float position) {
        keys[to] = fresh_key(axis, position, kind);
        values[to++] = i;
      });
  }
};

struct WriteEvent {
  const std::uint64_t* keys;
  const std::uint32_t* values;
  Event* events;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    events[i] = event_in(keys[i], values[i]);
  }
};

// ---- From level to level ------------------------------------------------------------------------

/// What passes over fresh events share.
struct Division {
  Level level;
  Level next;
  DivideRoom room;
  EventRoom events;

  /// visit(segment, kind, position, reference) for the events of a straddler's pieces on the next
  /// level that it does not have on this one.
  template <class Visit>
  ZKD_HOST_DEVICE void for_each_fresh(std::uint32_t straddler, const Visit& visit) const {
    const std::uint32_t index = room.straddlers[straddler];
    const Box& whole = level.references[index].box;
    for (std::uint32_t which = 0; which < 2; ++which) {
      const std::uint32_t place = room.place[2 * index + which];
      if (place == none) continue;
      const std::uint32_t to = place & ~clipped_bit;
      const Reference& piece = next.references[to];
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        for_each_event(piece.box, axis, [&](Kind kind, float position) {
          if (!has_event(whole, axis, kind, position))
            visit(next.segment(axis, piece.node), kind, position, to);
        });
    }
  }

  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t next_segment(std::uint32_t fresh) const {
    return segment_of(events.sort.keys[fresh]);
  }
  /// Which child of its parent a segment of the next level belongs to.
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t child_of(std::uint32_t segment) const {
    return next.child_of[segment % next.node_count];
  }
  /// The parent's segment along the same axis.
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t parent_of(std::uint32_t segment) const {
    return level.segment(segment / next.node_count, child_of(segment) / 2);
  }
};

struct CountFresh {
  Division division;

  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t straddler) const {
    std::uint32_t count = 0;
    division.for_each_fresh(straddler, [&](std::uint32_t, Kind, float, std::uint32_t) { ++count; });
    return count;
  }
};

struct EmitFresh {
  Division division;

  ZKD_HOST_DEVICE void operator()(std::uint32_t straddler) const {
    std::uint32_t at = division.room.straddler_fresh[straddler];
    const SortBuffers<std::uint64_t>& sort = division.events.sort;
    division.for_each_fresh(
        straddler, [&](std::uint32_t segment, Kind kind, float position, std::uint32_t reference) {
          sort.keys[at] = fresh_key(segment, position, kind);
          sort.values[at++] = reference;
        });
  }
};

/// The bucket of a fresh event, and where its segment begins and ends.
struct FindBucket {
  Division division;
  std::uint32_t fresh_count;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    const std::uint64_t key = division.events.sort.keys[i];
    const std::uint32_t segment = segment_of(key);
    if (i == 0 || division.next_segment(i - 1) != segment) division.events.first[segment] = i;
    if (i + 1 == fresh_count || division.next_segment(i + 1) != segment)
      division.events.end[segment] = i + 1;
    const std::uint32_t parent = division.parent_of(segment);
    std::uint32_t low = division.level.event_begin[parent];
    std::uint32_t high = division.level.event_begin[parent + 1];
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      if (rank_of(division.level.events[middle]) <= rank_in(key))
        low = middle + 1;
      else
        high = middle;
    }
    division.events.bucket[i] = low;
  }
};

/// The last fresh event of each bucket, for each child, notes how many there are up to it.
struct NoteBucket {
  Division division;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    const std::uint32_t segment = division.next_segment(i);
    const std::uint32_t bucket = division.events.bucket[i];
    if (bucket == division.level.event_begin[division.parent_of(segment) + 1]) return;
    if (i + 1 != division.events.end[segment] && division.events.bucket[i + 1] == bucket) return;
    division.events.notes[2 * bucket + (division.child_of(segment) & 1)] =
        i + 1 - division.events.first[segment];
  }
};

/// Sums over events of one segment, for each child.
struct KeptSums {
  std::uint32_t kept[2] = {};
  std::uint32_t fresh[2] = {};  ///< that go before
  std::uint32_t begins = 0;     ///< 1: a segment begins in between

  ZKD_HOST_DEVICE void combine(const KeptSums& next) {
    if (next.begins != 0) {
      *this = next;
      return;
    }
    for (int which = 0; which < 2; ++which) {
      kept[which] += next.kept[which];
      if (next.fresh[which] != 0) fresh[which] = next.fresh[which];
    }
  }
};

/// A scan over the events of this level: those that stay go to the next.
class KeepEvents {
 public:
  explicit KeepEvents(const Division& division) : division_(division) {}

  ZKD_HOST_DEVICE void operator()(std::uint32_t i, KeptSums& sums) {
    cursor_.move_to(division_.level, i);
    if (i == cursor_.begin) {
      sums = KeptSums{};
      sums.begins = 1;
    }
    if (division_.level.decisions[cursor_.node].divided == 0) return;
    for (std::uint32_t which = 0; which < 2; ++which) {
      const std::uint32_t note = division_.events.notes[2 * i + which];
      if (note != 0) sums.fresh[which] = note;
      if (place_of(i, which) != none) ++sums.kept[which];
    }
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t segment_begin(std::uint32_t i) {
    cursor_.move_to(division_.level, i);
    return cursor_.begin;
  }
  ZKD_HOST_DEVICE void take(std::uint32_t i, const KeptSums& sums) {
    cursor_.move_to(division_.level, i);
    if (division_.level.decisions[cursor_.node].divided == 0) return;
    for (std::uint32_t which = 0; which < 2; ++which) {
      const std::uint32_t place = place_of(i, which);
      std::uint32_t& note = division_.events.notes[2 * i + which];
      if (note != 0) note = sums.kept[which] - (place != none ? 1 : 0);
      if (place == none) continue;
      const std::uint32_t child = division_.room.places[2 * cursor_.node + which].node;
      const std::uint32_t begin =
          division_.next.event_begin[division_.next.segment(cursor_.axis, child)];
      division_.next.events[begin + sums.kept[which] - 1 + sums.fresh[which]] =
          renumbered(division_.level.events[i], place);
    }
  }

 private:
  /// The reference of event i on the next level in this child, if it has the event there.
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t place_of(std::uint32_t i, std::uint32_t which) const {
    const Event event = division_.level.events[i];
    const std::uint32_t place = division_.room.place[2 * reference_of(event) + which];
    if (place == none || (place & clipped_bit) == 0) return place;
    const std::uint32_t to = place & ~clipped_bit;
    return has_event(division_.next.references[to].box, cursor_.axis, kind_of(event),
                     position_of(event))
               ? to
               : none;
  }

  Division division_;
  Cursor cursor_;
};

/// A fresh event goes behind the fresh ones before it and the kept ones before its bucket.
struct PlaceFresh {
  Division division;

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    const EventRoom& events = division.events;
    const std::uint32_t segment = division.next_segment(i);
    const std::uint32_t bucket = events.bucket[i];
    const bool behind_all = bucket == division.level.event_begin[division.parent_of(segment) + 1];
    const std::uint32_t to =
        behind_all ? division.next.event_begin[segment + 1] - (events.end[segment] - i)
                   : division.next.event_begin[segment] + (i - events.first[segment]) +
                         events.notes[2 * bucket + (division.child_of(segment) & 1)];
    division.next.events[to] = event_in(events.sort.keys[i], events.sort.values[i]);
  }
};

}  // namespace zkd::core::wu2011
