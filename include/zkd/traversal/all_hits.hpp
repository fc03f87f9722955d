// SPDX-License-Identifier: Apache-2.0
//
// All hits of a ray from near to far, each once, through any tree, in a fixed amount of memory. For
// device code and the library: see arithmetic.hpp.
//
// For one ray and one triangle an intersector always computes the same bits. So a hit has one key,
// (t in tree space, id), whichever leaf it is met in, and keys order hits strictly. The walk takes
// boxes in the order in which the ray enters them and keeps the hits it has found, nearest first.
//
// A hit is reported when no box that waits begins before its `limit`. Where a ray enters a box is
// a lower bound of every hit below it, in the sense in which closest_hit relies on it ("Boxes" in
// docs/accuracy.md): a hit at t' lies in no box that begins behind limit_behind(t'), and that grows
// with t'. So nothing nearer, or equally near with a lower id, is still to come. A hit met again
// has the id of one that is kept, or a key that is not behind that of the last one reported.
//
// Where the hits kept are one too many, the furthest is dropped, and the furthest that is left is
// the horizon of this walk: what lies behind it is passed over, like what lies behind the best hit
// by closest_hit, so up to the horizon nothing is missing. Such a walk ends when its horizon has
// been reported, and another one begins behind that. It reports `size` hits at least, so there are
// no more walks than hits / size + 1.
#pragma once

#include <cstdint>
#include <new>

#include <zkd/query.hpp>
#include <zkd/traversal/candidate.hpp>
#include <zkd/traversal/ray.hpp>
#include <zkd/traversal/traverse.hpp>
#include <zkd/traversal/triangle.hpp>
#include <zkd/tree.hpp>

namespace zkd::core {

/// Boxes that a walk has still to look into. The first `ordered` are taken in the order in which
/// the ray enters them; while there are more, those beyond are taken last in, first out. They are
/// then brothers of the nodes on one path from the root, so max_depth of them at most.
template <std::uint32_t ordered>
class WaitingBoxes {
 public:
  ZKD_HOST_DEVICE void push(Link link, float t) {
    std::uint32_t at = count_++;
    if (at < ordered) {
      for (; at > 0 && waiting_[at - 1].t < t; --at) waiting_[at] = waiting_[at - 1];
    }
    waiting_[at] = {link.bits, t};
  }

  /// False: none is left. `t`: where the ray enters it.
  ZKD_HOST_DEVICE bool pop(Link& link, float& t) {
    if (count_ == 0) return false;
    link.bits = waiting_[--count_].link;
    t = waiting_[count_].t;
    return true;
  }

  /// Whether one of them may hold a hit that is not behind one with this limit.
  [[nodiscard]] ZKD_HOST_DEVICE bool may_come_before(Real limit) const {
    return count_ > ordered || (count_ > 0 && !(limit.value < waiting_[count_ - 1].t));
  }

 private:
  struct alignas(8) Waiting {  // without initialisers: an array of them costs nothing
    std::uint32_t link;
    float t;
  };
  Waiting waiting_[ordered + max_depth];
  std::uint32_t count_ = 0;
};

/// Hits that were found and not reported yet, `size` of them at most, nearest first.
template <class Candidate, std::uint32_t size>
class FoundHits {
 public:
  static_assert(size > 0);

  // Places get their values when they are used: many cost no more than few.
  ZKD_HOST_DEVICE FoundHits() {}

  /// No hit behind it is of use to this walk. Where nothing was dropped: none.
  [[nodiscard]] ZKD_HOST_DEVICE const Candidate& horizon() const { return horizon_; }

  /// Keeps a hit that comes before the horizon, unless it was met already.
  ZKD_HOST_DEVICE void add(const Candidate& hit) {
    if (last_.found() && !last_.before(hit)) return;
    for (std::uint32_t i = 0; i < count_; ++i) {
      if (hits_[i].triangle == hit.triangle) return;
    }
    std::uint32_t at = count_;
    const bool full = count_ == size;
    if (!full) {
      ++count_;
    } else if (hit.before(hits_[size - 1])) {
      --at;
    }
    if (at < size) {
      for (; at > 0 && hit.before(hits_[at - 1]); --at) place(at, hits_[at - 1]);
      place(at, hit);
    }
    if (full) horizon_ = hits_[size - 1];
  }

  /// visit(hit), which says whether to go on, for those that nothing in `boxes` can come before.
  /// Returns whether to go on.
  template <class Boxes, class Visit>
  ZKD_HOST_DEVICE bool report(const Boxes& boxes, Visit& visit) {
    std::uint32_t reported = 0;
    while (reported < count_ && !boxes.may_come_before(hits_[reported].limit)) {
      last_ = hits_[reported++];
      if (!visit(last_)) return false;
    }
    if (reported == 0) return true;
    const std::uint32_t end = smaller(count_, size);  // which it is, but compilers do not see it
    count_ = 0;
    for (std::uint32_t i = reported; i < end; ++i) place(count_++, hits_[i]);
    return true;
  }

  /// After a walk: whether something was dropped, and another walk has to find it. It begins behind
  /// the last hit reported.
  ZKD_HOST_DEVICE bool begin_again() {
    const bool dropped = horizon_.found();
    horizon_ = {};
    return dropped;
  }

  [[nodiscard]] ZKD_HOST_DEVICE const Candidate& last() const { return last_; }

 private:
  ZKD_HOST_DEVICE void place(std::uint32_t at, const Candidate& hit) {
    ::new (static_cast<void*>(hits_ + at)) Candidate(hit);
  }

  union {
    Candidate hits_[size];
  };
  std::uint32_t count_ = 0;
  Candidate last_;
  Candidate horizon_;
};

/// What the hits of one ray took.
struct AllHitsCost {
  std::uint64_t node_visits = 0;
  std::uint64_t triangle_tests = 0;
  std::uint64_t walks = 0;

  /// Counts that are too large stay at the largest.
  [[nodiscard]] ZKD_HOST_DEVICE TraversalCost as_traversal_cost() const {
    constexpr std::uint64_t most = 0xFFFFFFFFu;
    return {static_cast<std::uint32_t>(smaller(node_visits, most)),
            static_cast<std::uint32_t>(smaller(triangle_tests, most))};
  }
};

/// One walk from the root. Returns whether to go on after it.
template <std::uint32_t ordered, class Boxes, class Intersect, class Found, class Visit>
ZKD_HOST_DEVICE inline bool walk_in_order(const TreeView& tree, const TriangleView& triangles,
                                          const PreparedRay& ray, const Intersect& intersect,
                                          Found& found, Visit& visit, AllHitsCost& cost) {
  const Boxes boxes(ray);
  WaitingBoxes<ordered> waiting;
  Link link = tree.root();
  float t = 0.0F;
  ++cost.walks;
  for (;;) {
    bool reached = true;
    while (!link.is_leaf()) {
      ++cost.node_visits;
      const auto& node = Boxes::read(tree.nodes[link.index()]);
      const Entries entries = boxes(node, smaller(ray.last, found.horizon().limit));
      if (entries.hit == 3) {
        const std::uint32_t near = entries.near(node, ray);
        waiting.push(element(node.child, 1 - near), element(entries.t, 1 - near));
        link = element(node.child, near);
      } else if (entries.hit != 0) {
        link = element(node.child, entries.hit - 1);
      } else {
        reached = false;
        break;
      }
    }
    if (reached) {
      auto candidate = found.horizon();
      const std::uint32_t end = tree.leaf_offsets[link.index() + 1];
      for (std::uint32_t r = tree.leaf_offsets[link.index()]; r < end; ++r) {
        const std::uint32_t id = tree.references[r];
        ++cost.triangle_tests;
        if (!intersect(corners_of(triangles, id), id, candidate)) continue;
        found.add(candidate);
        candidate = found.horizon();
      }
    }
    if (!found.report(waiting, visit)) return false;
    do {
      if (!waiting.pop(link, t)) return found.report(waiting, visit);
    } while (t > found.horizon().limit.value);
  }
}

/// visit(candidate), which says whether to go on, for all hits of a ray, nearest first. `size`: how
/// many hits are kept; `ordered`: how many boxes wait in order.
template <std::uint32_t size, std::uint32_t ordered, class Boxes, class Intersect, class Visit>
ZKD_HOST_DEVICE inline AllHitsCost for_each_hit(const TreeView& tree, const TriangleView& triangles,
                                                const Ray& ray, Visit& visit) {
  AllHitsCost cost;
  PreparedRay prepared(tree, ray, Intersect::hit_distance);
  if (!prepared.valid) return cost;
  const Intersect intersect(prepared, ray);
  FoundHits<typename Intersect::Candidate, size> found;
  while (walk_in_order<ordered, Boxes>(tree, triangles, prepared, intersect, found, visit, cost) &&
         found.begin_again())
    prepared.first = larger(prepared.first, limit_before(found.last()));
  return cost;
}

/// A visitor that writes the hits of one ray down until their places are full.
class HitPlaces {
 public:
  ZKD_HOST_DEVICE HitPlaces(Hit* places, std::uint32_t most) : places_(places), most_(most) {}

  template <class Candidate>
  ZKD_HOST_DEVICE bool operator()(const Candidate& found) {
    places_[count_++] = to_hit(found);
    return count_ < most_;
  }

  /// Fills the places that are left with misses. Returns how many hits there are.
  ZKD_HOST_DEVICE std::uint32_t finish() {
    for (std::uint32_t i = count_; i < most_; ++i) places_[i] = {};
    return count_;
  }

 private:
  Hit* places_;
  std::uint32_t most_;
  std::uint32_t count_ = 0;
};

/// The first `most` hits of a ray, misses behind them. Returns how many hits. `cost` may be null.
template <std::uint32_t size, std::uint32_t ordered, class Boxes, class Intersect>
ZKD_HOST_DEVICE inline std::uint32_t closest_hits(const TreeView& tree,
                                                  const TriangleView& triangles, const Ray& ray,
                                                  Hit* hits, std::uint32_t most,
                                                  TraversalCost* cost) {
  HitPlaces places(hits, most);
  AllHitsCost spent;
  if (most != 0)
    spent = for_each_hit<size, ordered, Boxes, Intersect>(tree, triangles, ray, places);
  if (cost != nullptr) *cost = spent.as_traversal_cost();
  return places.finish();
}

/// for_each_hit by a loop over all triangles for each hit.
template <class Intersect, class Visit>
ZKD_HOST_DEVICE inline void for_each_hit_brute_force(const TreeView& tree,
                                                     const TriangleView& triangles, const Ray& ray,
                                                     Visit& visit) {
  const PreparedRay prepared(tree, ray, Intersect::hit_distance);
  if (!prepared.valid) return;
  const Intersect intersect(prepared, ray);
  typename Intersect::Candidate last;
  for (;;) {
    typename Intersect::Candidate next;
    for (std::uint32_t id = 0; id < triangles.triangle_count; ++id) {
      const Corners corners = corners_of(triangles, id);
      typename Intersect::Candidate candidate = next;
      if (intersect(corners, id, candidate) && is_valid(corners) &&
          (!last.found() || last.before(candidate)))
        next = candidate;
    }
    if (!next.found() || !visit(next)) return;
    last = next;
  }
}

}  // namespace zkd::core
