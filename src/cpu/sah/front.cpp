// SPDX-License-Identifier: Apache-2.0
//
// Passes over generations of large parts, then rounds over subtrees. Memory is taken between them,
// by the calling thread.
#include "cpu/sah/front.hpp"

#include <algorithm>
#include <atomic>
#include <string>
#include <utility>

#include "cpu/sah/divide.hpp"

namespace zkd::cpu::sah {
namespace {

// A part of this many references fits the second-level cache with what comes of it; half a million
// triangles make enough of them for many threads.
constexpr std::uint32_t subtree_size = 8192;

// body(i) for i < count, by threads as they become free.
template <class Body>
void for_each(const Threads& threads, std::size_t count, const Body& body) {
  threads.share(static_cast<std::uint32_t>(count), 1, [&body](Range range) {
    for (std::uint32_t i = range.begin; i < range.end; ++i) body(i);
  });
}

}  // namespace

// A large part on its way to two.
struct Front::Division {
  std::uint32_t top = 0;
  double* sums[3] = {};
  Block sums_block;
  Split by_axis[3];
  Split best;
  bool pays = false;
  Block child_block[2];
  Part child[2] = {};
  Block divide_block;
  DivideRoom divide_room{};
};

void Front::build(Block block, const Part& root) {
  Top top(std::move(block));
  top.part = root;
  top.box = root.tight();
  tops_.add(std::move(top));
  divide_large();
  finish_subtrees();
}

void Front::divide_large() {
  std::uint32_t begin = 0;
  while (begin < tops_.size()) {
    const auto end = static_cast<std::uint32_t>(tops_.size());
    divide_generation(begin, end);
    begin = end;
  }
}

void Front::divide_generation(std::uint32_t begin, std::uint32_t end) {
  List<Division> divisions(memory_);
  for (std::uint32_t i = begin; i < end; ++i) {
    const Part& part = tops_[i].part;
    if (part.count <= subtree_size || !may_pay(part, options_)) continue;
    Division& division = divisions.add(Division{});
    division.top = i;
    division.sums_block = lay_out_block(memory_, [&](core::Arena& arena) {
      for (int a = 0; a < 3; ++a)
        division.sums[a] = arena.take<double>(sweep_room(part.event_count[a]));
    });
  }
  if (divisions.size() == 0) return;

  for_each(threads_, 3 * divisions.size(), [&](std::uint32_t i) {
    Division& division = divisions[i / 3];
    const std::uint32_t axis = i % 3;
    division.by_axis[axis] = sweep(tops_[division.top].part, axis, options_, division.sums[axis]);
  });
  for (std::size_t i = 0; i < divisions.size(); ++i) {
    Division& division = divisions[i];
    const Part& part = tops_[division.top].part;
    division.sums_block.clear();
    division.pays = choose(part, division.by_axis, options_, division.best);
    if (!division.pays) continue;
    for (int which = 0; which < 2; ++which)
      division.child_block[which] = lay_out_block(memory_, [&](core::Arena& arena) {
        take_part(arena, which == 0 ? division.best.below : division.best.above,
                  division.child[which]);
      });
    division.divide_block = lay_out_block(memory_, [&](core::Arena& arena) {
      division.divide_room.take(arena, part, division.best);
    });
  }
  for_each(threads_, divisions.size(), [&](std::uint32_t i) {
    Division& division = divisions[i];
    if (division.pays)
      divide_references(tops_[division.top].part, division.best, clip_, division.divide_room,
                        division.child);
  });
  for_each(threads_, 3 * divisions.size(), [&](std::uint32_t i) {
    Division& division = divisions[i / 3];
    if (division.pays)
      divide_events(tops_[division.top].part, i % 3, division.divide_room, division.child);
  });
  for (std::size_t i = 0; i < divisions.size(); ++i) {
    Division& division = divisions[i];
    if (!division.pays) continue;
    division.divide_block.clear();
    tops_[division.top].block.clear();
    tops_[division.top].divided = true;
    tops_[division.top].split = division.best;
    for (int which = 0; which < 2; ++which) {
      Top child(std::move(division.child_block[which]));
      child.part = division.child[which];
      child.box = child.part.tight();
      tops_[division.top].child[which] = static_cast<std::uint32_t>(tops_.size());
      tops_.add(std::move(child));
    }
  }
}

void Front::finish_subtrees() {
  for (std::size_t i = 0; i < tops_.size(); ++i)
    if (!tops_[i].divided && tops_[i].part.count > subtree_size) finish_large_leaf(tops_[i]);
  double plenty = 1.0;
  for (;;) {
    List<std::uint32_t> waiting(memory_);
    for (std::size_t i = 0; i < tops_.size(); ++i)
      if (!tops_[i].divided && !tops_[i].finished) waiting.add(static_cast<std::uint32_t>(i));
    if (waiting.size() == 0) return;
    if (finish_some(waiting, plenty)) plenty *= 2.0;
  }
}

void Front::finish_large_leaf(Top& top) {
  Subtree& leaf = top.subtree;
  leaf.root = Link::leaf(0);
  leaf.leaf_count = 1;
  leaf.reference_count = top.part.count;
  outputs_.add(lay_out_block(memory_, [&](core::Arena& arena) {
    leaf.leaf_ends = arena.take<std::uint32_t>(1);
    leaf.references = arena.take<std::uint32_t>(top.part.count);
  }));
  leaf.leaf_ends[0] = top.part.count;
  for (std::uint32_t i = 0; i < top.part.count; ++i) leaf.references[i] = top.part.references[i].id;
  top.finished = true;
  top.block.clear();
}

bool Front::finish_some(List<std::uint32_t>& waiting, double plenty) {
  std::size_t largest = 0;
  std::size_t all = 0;
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    largest = std::max<std::size_t>(largest, tops_[waiting[i]].part.count);
    all += tops_[waiting[i]].part.count;
  }
  const auto team = static_cast<std::uint32_t>(
      std::min(waiting.size(), static_cast<std::size_t>(threads_.available())));

  // How much a reference of a part comes to: seen on scenes of all kinds. Where it is not enough,
  // what did not fit is done again with twice as much.
  const auto times = [plenty](double factor, std::size_t count) {
    return static_cast<std::size_t>(factor * plenty * static_cast<double>(count)) + 64;
  };
  // No more than a tree may hold.
  const auto limited = [](std::size_t count) { return std::min<std::size_t>(count, max_count); };
  constexpr double leaves_per_reference = 2.0;
  constexpr double references_per_reference = 3.0;
  const std::size_t share = largest + (all + all / 4) / team;
  const std::size_t room_bytes = times(512.0, largest);

  struct Worker {
    SubtreeBuilder::Output output;
    void* room;
  };
  List<Worker> workers(memory_);
  List<Block> rooms(memory_);
  for (std::uint32_t i = 0; i < team; ++i) {
    Worker worker{};
    worker.output.leaves = limited(times(leaves_per_reference, share));
    worker.output.reference_count = limited(times(references_per_reference, share));
    outputs_.add(lay_out_block(memory_, [&](core::Arena& arena) {
      worker.output.nodes = arena.take<Node>(worker.output.leaves);
      worker.output.leaf_ends = arena.take<std::uint32_t>(worker.output.leaves);
      worker.output.references = arena.take<std::uint32_t>(worker.output.reference_count);
    }));
    worker.room = rooms.add(Block(memory_, room_bytes)).data();
    workers.add(std::move(worker));
  }

  std::atomic<std::size_t> next{0};
  std::atomic<bool> ran_out{false};
  threads_.divide(team, static_cast<int>(team), [&](Range, int thread) {
    const Worker& worker = workers[static_cast<std::size_t>(thread)];
    SubtreeBuilder builder(options_, clip_, Room(worker.room, room_bytes), worker.output);
    for (std::size_t i = next++; i < waiting.size(); i = next++) {
      Top& top = tops_[waiting[i]];
      // What will hardly fit is left to the next round.
      if (builder.left().leaves < limited(times(leaves_per_reference, top.part.count)) ||
          builder.left().reference_count < limited(times(references_per_reference, top.part.count)))
        continue;
      if (builder.build(top.part, top.subtree))
        top.finished = true;
      else
        ran_out = true;
    }
  });
  bool any_finished = false;
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    if (!tops_[waiting[i]].finished) continue;
    tops_[waiting[i]].block.clear();
    any_finished = true;
  }
  if (!any_finished && times(leaves_per_reference, share) > max_count)
    throw Error(ErrorCode::too_many_references, max_count + 1,
                "builder sah needs at least " + std::to_string(max_count + 1) +
                    " leaves or references, and a tree holds at most " + std::to_string(max_count));
  return ran_out;
}

}  // namespace zkd::cpu::sah
