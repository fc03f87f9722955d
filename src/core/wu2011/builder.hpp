// SPDX-License-Identifier: Apache-2.0
//
// Builder::wu2011, start to end, over the verbs of a backend: Z. Wu, F. Zhao, X. Liu, SAH KD-Tree
// Construction on GPU, HPG 2011. Builder::run is the table of contents.
//
// Breadth first: every pass is over all references or events of one level. Of each level the host
// reads a few counts, by which it takes memory for the next; so it waits twice a level. The paper's
// outline is kept: the tree is exact, candidates are counted by scans over sorted events, and only
// the events of clipped triangles are sorted, in buckets. Where it says less than a program needs,
// and in that areas are those of tight boxes, this is our own (sweep.hpp, divide.hpp, events.hpp).
// The planes are those of Builder::sah, and so is the tree, to the byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include <zkd/error.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/statistics.hpp>
#include <zkd/tree.hpp>

#include "core/arena.hpp"
#include "core/pipeline.hpp"
#include "core/sah/clip.hpp"
#include "core/sah/rounding.hpp"
#include "core/status.hpp"
#include "core/validate.hpp"
#include "core/verbs.hpp"
#include "core/wu2011/divide.hpp"
#include "core/wu2011/events.hpp"
#include "core/wu2011/level.hpp"
#include "core/wu2011/number.hpp"
#include "core/wu2011/sweep.hpp"

namespace zkd::core::wu2011 {

/// What a backend holds for its caller.
template <class Backend>
using Held = decltype(std::declval<Backend&>().hold(0));

/// A block for one layout after the other; it is kept where it is large enough.
template <class Backend>
class Room {
 public:
  explicit Room(Backend& backend) : backend_(&backend) {}

  template <class Layout, class... Counts>
  void lay_out(Layout& layout, Counts... counts) {
    const std::size_t bytes = bytes_of(layout, counts...);
    if (bytes > block_.bytes()) {
      block_ = {};
      block_ = backend_->hold(bytes + bytes / 4);  // the next level may be a little larger
    }
    Arena arena(block_.data());
    layout.lay_out(arena, counts...);
  }
  void clear() { block_ = {}; }

 private:
  Backend* backend_;
  Held<Backend> block_;
};

struct AdmitScene {
  BuildState* state;
  LevelCounts* counts;
  TriangleView triangles;
  InvalidTriangles invalid;
  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    admit_scene(*state, triangles, invalid);
    state->lattice = Lattice{};
    state->coder = MortonCoder{};
    *counts = LevelCounts{};
  }
};

/// Every valid triangle is a reference of the root.
struct PlaceReference {
  const Box* boxes;
  const std::uint32_t* ids;
  double scale;
  Reference* references;
  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    references[i] = {in_tree_space(boxes[ids[i]], scale), ids[i], 0};
  }
};

struct PlaceRoot {
  Level level;
  Box box;
  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    level.nodes[0] = {box, box};
    level.reference_begin[0] = 0;
    level.reference_begin[1] = level.reference_count;
  }
};

template <class Backend>
class Builder {
 public:
  Builder(Backend& backend, const TriangleView& triangles, const BuildOptions& options)
      : backend_(backend),
        triangles_(triangles),
        options_(options.sah),
        invalid_(options.invalid_triangles),
        input_room_(backend),
        level_rooms_{Room<Backend>(backend), Room<Backend>(backend)},
        event_rooms_{Room<Backend>(backend), Room<Backend>(backend)},
        room_(backend),
        sort_room_(backend) {}

  /// Runs all stages. The tree's arrays are the backend's. Throws Error.
  void run() {
    validate();
    make_root();
    backend_.stage(Stage::split_planes);
    while (level_.node_count > 0) {
      weigh_planes();  // sweep.hpp
      divide();        // divide.hpp
      sort_events();   // events.hpp
      std::swap(level_, next_);
      std::swap(level_rooms_[0], level_rooms_[1]);
      std::swap(event_rooms_[0], event_rooms_[1]);
    }
    put_together();  // number.hpp
  }

  /// What was found, in the backend's memory.
  [[nodiscard]] const BuildState* state() const { return small_.state; }

 private:
  /// What lives as long as the build.
  struct Small {
    BuildState* state;
    LevelCounts* counts;
    void lay_out(Arena& arena) {
      state = arena.take<BuildState>(1);
      counts = arena.take<LevelCounts>(1);
    }
  };
  struct Input {
    Box* boxes;
    std::uint32_t* ids;
    void lay_out(Arena& arena, std::size_t triangles) {
      boxes = arena.take<Box>(triangles);
      ids = arena.take<std::uint32_t>(triangles);
    }
  };
  struct Events {
    Event* events;
    void lay_out(Arena& arena, std::size_t count) { events = arena.take<Event>(count); }
  };
  struct RootEvents {
    std::uint32_t* begin;
    SortBuffers<std::uint64_t> sort;
    void lay_out(Arena& arena, std::size_t references, std::size_t events) {
      begin = arena.take<std::uint32_t>(references);
      sort = {arena.take<std::uint64_t>(events), arena.take<std::uint32_t>(events),
              arena.take<std::uint64_t>(events), arena.take<std::uint32_t>(events)};
    }
  };

  static Count exactly(std::uint32_t n) { return {nullptr, n}; }

  void validate() {
    backend_.stage(Stage::validate);
    const auto given = static_cast<std::uint32_t>(triangles_.triangle_count);
    backend_.take(small_);
    input_room_.lay_out(input_, given);
    backend_.reduce(exactly(given), &small_.state->report,
                    ValidateTriangle{triangles_, input_.boxes});
    backend_.for_each(one, AdmitScene{small_.state, small_.counts, triangles_, invalid_});
    const BuildState state = backend_.read(small_.state);
    core::raise(state.counts.status, triangles_);
    backend_.select(exactly(given), IsListed{input_.boxes}, input_.ids,
                    &small_.state->counts.listed);
    frame_ = state.frame;
    listed_ = state.counts.listed;
    bounds_ = state.report.bounds;
  }

  void make_root() {
    backend_.stage(Stage::sort);
    if (!may_pay(listed_, 0, options_)) return;
    check_references(listed_);
    level_.node_count = 1;
    level_.reference_count = listed_;
    level_.depth = 0;
    level_rooms_[0].lay_out(level_, 1u, listed_);
    backend_.for_each(exactly(listed_),
                      PlaceReference{input_.boxes, input_.ids, frame_.scale, level_.references});
    backend_.for_each(one, PlaceRoot{level_, in_tree_space(bounds_, frame_.scale)});
    input_room_.clear();

    count_events(level_);
    level_.event_count = backend_.read(&small_.counts->events);
    close_events(level_, event_rooms_[0]);
    RootEvents root{};
    room_.lay_out(root, listed_, level_.event_count);
    backend_.exclusive_scan(exactly(listed_), CountEventsOfReference{level_.references}, root.begin,
                            &small_.counts->fresh);
    backend_.for_each(exactly(listed_),
                      EmitEvents{level_.references, root.begin, root.sort.keys, root.sort.values});
    root.sort = backend_.radix_sort(root.sort, exactly(level_.event_count), rank_bits + 2);
    backend_.for_each(exactly(level_.event_count),
                      WriteEvent{root.sort.keys, root.sort.values, level_.events});
  }

  /// How many events each segment of a level has, and how many all have.
  void count_events(const Level& level) {
    backend_.template scan<EventSums>(exactly(level.reference_count), CountEvents{level});
    backend_.exclusive_scan(exactly(3 * level.node_count), ReadEventCount{level.event_counts},
                            level.event_begin, &small_.counts->events);
  }
  /// Room for them, when the host knows.
  void close_events(Level& level, Room<Backend>& room) {
    Events events{};
    room.lay_out(events, level.event_count);
    level.events = events.events;
    backend_.for_each(one, Fill{level.event_begin + 3 * level.node_count, level.event_count});
  }

  void weigh_planes() {
    SweepRoom sweep{};
    const Count events = exactly(level_.event_count);
    const Count segments = exactly(3 * level_.node_count);
    room_.lay_out(sweep, events.bound, segments.bound);
    if (options_.areas == SahAreas::tight)
      backend_.template scan<Swept>(events, SumAbove(level_, options_, sweep.costs));
    backend_.template scan<Swept>(events, SumBelow(level_, options_, sweep.costs));
    backend_.segmented_reduce(segments, level_.event_begin, events, sweep.best,
                              OfferCandidates{level_.events, sweep.costs});
    backend_.for_each(exactly(level_.node_count), Decide{level_, options_, sweep.best});
  }

  void divide() {
    const Count nodes = exactly(level_.node_count);
    const Count references = exactly(level_.reference_count);
    divide_ = {};
    room_.lay_out(divide_, nodes.bound, references.bound);
    backend_.select(references, Straddles{level_}, divide_.straddlers, &small_.counts->straddlers);
    backend_.for_each(Count{&small_.counts->straddlers, references.bound},
                      ClipStraddler{level_, divide_, Clipper(triangles_, frame_)});
    backend_.template scan<SideSums>(references, PlaceInChildren{level_, divide_});
    backend_.template scan<LevelTotals>(
        nodes, CountChildren{level_, divide_, options_, &small_.counts->totals});
    const LevelCounts counts = backend_.read(small_.counts);
    straddlers_ = counts.straddlers;
    check_references(counts.totals.references);

    next_ = Level{};
    next_.node_count = counts.totals.nodes;
    next_.reference_count = counts.totals.references;
    next_.depth = level_.depth + 1;
    level_rooms_[1].lay_out(next_, next_.node_count, next_.reference_count);
    Kept& kept = records_[level_.depth];
    LevelRecord& record = kept.record;
    record.node_count = level_.node_count;
    record.leaf_reference_count = counts.totals.leaf_references;
    kept.block = backend_.hold(bytes_of(record, record.node_count, record.leaf_reference_count));
    Arena arena(kept.block.data());
    record.lay_out(arena, record.node_count, record.leaf_reference_count);
    levels_ = level_.depth + 1;
    divided_ += counts.totals.divided;
    leaf_references_ += record.leaf_reference_count;
    check_tree();

    backend_.for_each(nodes, MakeChildren{level_, divide_, options_, next_, record});
    backend_.for_each(references, MoveReference{level_, divide_, next_, record});
  }

  void sort_events() {
    if (next_.node_count == 0) return;
    count_events(next_);
    Division division{level_, next_, divide_, EventRoom{}};
    const Count straddlers = exactly(straddlers_);
    backend_.exclusive_scan(straddlers, CountFresh{division}, divide_.straddler_fresh,
                            &small_.counts->fresh);
    const LevelCounts counts = backend_.read(small_.counts);
    next_.event_count = counts.events;
    close_events(next_, event_rooms_[1]);
    division.next = next_;
    EventRoom& events = division.events;
    const std::uint32_t segments = 3 * next_.node_count;
    sort_room_.lay_out(events, counts.fresh, segments, level_.event_count);

    const Count fresh = exactly(counts.fresh);
    backend_.for_each(straddlers, EmitFresh{division});
    events.sort = backend_.radix_sort(events.sort, fresh, rank_bits + bits_to_count(segments));
    backend_.for_each(exactly(2 * level_.event_count), Fill{events.notes, 0});
    backend_.for_each(fresh, FindBucket{division, counts.fresh});
    backend_.for_each(fresh, NoteBucket{division});
    backend_.template scan<KeptSums>(exactly(level_.event_count), KeepEvents(division));
    backend_.for_each(fresh, PlaceFresh{division});
  }

  void put_together() {
    backend_.stage(Stage::references);
    for (Room<Backend>* room : {&level_rooms_[0], &level_rooms_[1], &event_rooms_[0],
                                &event_rooms_[1], &room_, &sort_room_})
      room->clear();
    const std::uint32_t leaves = listed_ > 0 ? divided_ + 1 : 0;
    const std::uint32_t references =
        levels_ > 0 ? static_cast<std::uint32_t>(leaf_references_) : listed_;
    backend_.allocate_tree_exactly(leaves, references);
    if (levels_ == 0) {
      backend_.for_each(exactly(listed_), CopyTo<std::uint32_t>{input_.ids, backend_.references()});
    }
    Subtrees top{};
    if (levels_ > 0) top = number();
    backend_.for_each(one, FinishTree{small_.state, backend_.header(), backend_.leaf_offsets(), top,
                                      leaves, references});
  }

  /// Returns what the first level has.
  Subtrees number() {
    for (std::uint32_t i = 0; i < levels_; ++i) {
      Kept& kept = records_[i];
      kept.subtree_block = backend_.hold(bytes_of(kept.subtrees, kept.record.node_count));
      Arena arena(kept.subtree_block.data());
      kept.subtrees.lay_out(arena, kept.record.node_count);
    }
    for (std::uint32_t i = levels_; i-- > 0;)
      backend_.for_each(
          exactly(records_[i].record.node_count),
          MeasureSubtree{records_[i].record, records_[i].subtrees, records_[i + 1].subtrees});
    backend_.for_each(one, Fill{&records_[0].subtrees.places->leaf, 0});
    backend_.for_each(one, Fill{&records_[0].subtrees.places->reference, 0});
    for (std::uint32_t i = 0; i < levels_; ++i) {
      const Kept& kept = records_[i];
      backend_.for_each(exactly(kept.record.node_count),
                        PlaceSubtree{kept.record, kept.subtrees, records_[i + 1].subtrees,
                                     backend_.nodes(), backend_.leaf_offsets()});
      backend_.for_each(exactly(kept.record.leaf_reference_count),
                        PlaceLeafReference{kept.record, kept.subtrees, backend_.references()});
    }
    return records_[0].subtrees;
  }

  static void check_references(std::uint64_t references) {
    if (references > max_references_of_level)
      throw Error(ErrorCode::too_many_references, references,
                  "a level of builder wu2011 has " + std::to_string(references) +
                      " references, and may have " + std::to_string(max_references_of_level));
  }
  void check_tree() const {
    if (leaf_references_ > max_count || divided_ >= max_count)
      throw Error(ErrorCode::too_many_references, leaf_references_,
                  "builder wu2011 needs at least " +
                      std::to_string(leaf_references_ > divided_ ? leaf_references_ : divided_) +
                      " leaves or references, and a tree holds at most " +
                      std::to_string(max_count));
  }

  /// A level that has been divided.
  struct Kept {
    LevelRecord record{};
    Held<Backend> block;
    Subtrees subtrees{};
    Held<Backend> subtree_block;
  };

  Backend& backend_;
  const TriangleView& triangles_;
  SahOptions options_;
  InvalidTriangles invalid_;

  Small small_{};
  Input input_{};
  SceneFrame frame_;
  Box bounds_;
  std::uint32_t listed_ = 0;

  Room<Backend> input_room_;
  Room<Backend> level_rooms_[2];  ///< of level_ and next_
  Room<Backend> event_rooms_[2];
  Room<Backend> room_;       ///< SweepRoom, then DivideRoom
  Room<Backend> sort_room_;  ///< EventRoom

  Level level_{};
  Level next_{};
  DivideRoom divide_{};
  std::uint32_t straddlers_ = 0;

  Kept records_[max_depth + 2];
  std::uint32_t levels_ = 0;
  std::uint32_t divided_ = 0;
  std::uint64_t leaf_references_ = 0;
};

}  // namespace zkd::core::wu2011
