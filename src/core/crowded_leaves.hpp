// SPDX-License-Identifier: Apache-2.0
//
// Crowded leaves of a strict tree: where a leaf lists more triangles than splitting it would cost,
// what of them lies in its cell is coded again on a lattice of its own, by the centres of the boxes
// of those parts, and gets a subtree. The same stages once more, over references instead of
// triangles, for all crowded leaves at once.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/tree.hpp>

#include "core/area.hpp"
#include "core/arena.hpp"
#include "core/compress.hpp"
#include "core/essential.hpp"
#include "core/key.hpp"
#include "core/planes.hpp"
#include "core/recode.hpp"
#include "core/references.hpp"
#include "core/trunks.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// A leaf is crowded where it lists more than this many times leaf_size. It costs all those tests;
/// a subtree costs visits and lists its triangles more than once.
inline constexpr std::uint32_t crowded_factor = 8;

/// Trunks of references hold at most this many times leaf_size.
inline constexpr std::uint32_t reference_trunk_factor = 2;

/// Leaves of a crowded leaf's reference that are remembered.
inline constexpr std::uint32_t remembered_of_reference = 2;

/// A crowded leaf stays whole where a random line through what it lists meets so many eighths of
/// its triangles' boxes or more: they are nearly the same box, and each cell of a subtree would
/// list nearly all of them. (Half is too few: boxes of needles shrink as cells do, and 3,000
/// needles would be tested twice as often.)
inline constexpr std::uint64_t alike_eighths = 7;

/// How many levels a leaf's subtree may have: no path becomes longer than max_depth, and a leaf
/// that splitting would not thin gets none.
struct LevelsLeft {
  const std::uint32_t* offsets;
  std::uint32_t crowded;
  const std::uint32_t* numbers;
  const Box* inside;
  const Parent* parents_of_leaves;
  const Parent* parents_of_nodes;
  std::uint8_t* levels;

  ZKD_HOST_DEVICE void operator()(std::uint32_t leaf) const {
    const std::uint32_t first = offsets[leaf];
    const std::uint32_t end = offsets[leaf + 1];
    std::uint32_t depth = 0;
    if (end - first > crowded) {
      if (!splitting_thins(first, end)) {
        levels[leaf] = 0;
        return;
      }
      for (Parent up = parents_of_leaves[leaf]; !up.is_none(); up = parents_of_nodes[up.node()])
        ++depth;
    }
    levels[leaf] = static_cast<std::uint8_t>(smaller(fine_bits, max_depth - depth));
  }

 private:
  /// A line that meets the box about all meets another in it with the odds of their areas. Summed
  /// in whole parts of 2^-16, so that the order of the references does not matter.
  [[nodiscard]] ZKD_HOST_DEVICE bool splitting_thins(std::uint32_t first, std::uint32_t end) const {
    constexpr std::uint64_t unit = 65536;
    Box all;
    for (std::uint32_t i = first; i < end; ++i) include(all, inside[numbers[i]]);
    const double area = half_area(all);
    if (!(area > 0.0)) return false;
    const double scale = static_cast<double>(unit) / area;
    std::uint64_t met = 0;
    for (std::uint32_t i = first; i < end; ++i) {
      const double parts = half_area(inside[numbers[i]]) * scale;
      met += parts > 0.0 ? static_cast<std::uint64_t>(parts) : 0;
    }
    return 8 * met < alike_eighths * unit * (end - first);
  }
};

/// Leaf and code of a reference as one number.
struct ReferenceKeys {
  const std::uint32_t* leaves;
  const std::uint32_t* codes;

  ZKD_HOST_DEVICE void load() {}
  ZKD_HOST_DEVICE std::uint64_t operator[](std::uint32_t i) const {
    return static_cast<std::uint64_t>(leaves[i]) << 32 | codes[i];
  }
};

/// The trunks of references of one leaf: one of a leaf that is not crowded, even of an empty one.
struct ReferenceTrunks {
  BeginsTrunk<ReferenceKeys> begins;
  const std::uint32_t* offsets;
  std::uint32_t crowded;

  ZKD_HOST_DEVICE void load() { begins.load(); }

  /// Calls found(i) for the first reference of each, and returns how many there are.
  template <class Found>
  ZKD_HOST_DEVICE std::uint32_t each(std::uint32_t leaf, const Found& found) const {
    const std::uint32_t first = offsets[leaf];
    const std::uint32_t end = offsets[leaf + 1];
    std::uint32_t count = 1;
    found(first);
    if (end - first <= crowded) return count;
    for (std::uint32_t i = first + 1; i < end; ++i)
      if (begins(i)) {
        found(i);
        ++count;
      }
    return count;
  }
};

struct CountReferenceTrunks {
  ReferenceTrunks trunks;
  ZKD_HOST_DEVICE void load() { trunks.load(); }
  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t leaf) const {
    return trunks.each(leaf, [](std::uint32_t) {});
  }
};

/// Where each trunk of references begins, and its key: that of its leaf, whose last 32 levels are
/// free, and its first reference's code.
struct WriteReferenceTrunks {
  ReferenceTrunks trunks;
  const std::uint32_t* trunk_offsets;
  const TrunkKey* leaf_keys;
  std::uint32_t* first;
  std::uint32_t* leaves;
  TrunkKey* keys;

  ZKD_HOST_DEVICE void load() { trunks.load(); }
  ZKD_HOST_DEVICE void operator()(std::uint32_t leaf) const {
    const bool crowded = trunks.offsets[leaf + 1] - trunks.offsets[leaf] > trunks.crowded;
    std::uint32_t trunk = trunk_offsets[leaf];
    trunks.each(leaf, [&](std::uint32_t i) {
      const std::uint64_t code = crowded ? trunks.begins.keys.codes[i] : 0;
      first[trunk] = i;
      leaves[trunk] = leaf;
      keys[trunk] = {leaf_keys[leaf].code, leaf_keys[leaf].fine | code};
      ++trunk;
    });
  }
};

/// From now on the trunks of references are the leaves.
struct AdoptReferenceTrunks {
  BuildCounts* counts;
  const std::uint32_t* count;
  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    counts->first_trunks = counts->trunks;
    counts->trunks = *count;
    counts->nodes = *count > 0 ? *count - 1 : 0;
  }
};

/// Planes of the nodes inside crowded leaves; the others have theirs from before.
struct PlaceSplitPlaneAgain {
  const TrunkKey* keys;
  const std::uint8_t* levels;
  const std::uint32_t* leaves;
  const SplitNode* before;
  CrowdByPosition crowd;
  SplitNode* nodes;

  ZKD_HOST_DEVICE void operator()(std::uint32_t node) const {
    const std::uint32_t level = levels[node];
    if (level < first_reference_level) {
      nodes[node].axis = before[leaves[node]].axis;
      nodes[node].plane = before[leaves[node]].plane;
      return;
    }
    const SplitPlane plane =
        crowd.plane(node + 1, keys[node + 1].fine << 32, level - first_reference_level);
    nodes[node].axis = plane.axis;
    nodes[node].plane = static_cast<float>(plane.position) + 0.0F;
  }
};

/// Where the references of crowded leaves are, in the order of the leaves.
struct PlaceOfCrowded {
  CrowdedTriangles crowded;
  std::uint32_t* positions;
  std::uint32_t last_leaf = 0;  // of the reference before: most follow in the same

  ZKD_HOST_DEVICE void operator()(std::uint32_t k) {
    if (!crowded.holds(last_leaf, k)) last_leaf = crowded[k].trunk;
    positions[k] = crowded.position(last_leaf, k);
  }
};

/// Walks the cells of a crowded leaf's subtree that the k-th reference of those leaves touches, as
/// CellWalk.
struct ReferenceWalk {
  CellWalk walk;
  const std::uint32_t* positions;  ///< in the order of leaves and codes
  const std::uint32_t* numbers;
  const std::uint32_t* triangles;
  const Box* inside;
  const std::uint32_t* trunk_of;
  const std::uint8_t* levels;
  const Parent* parents_of_nodes;
  const Parent* parents_of_leaves;

  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t id(std::uint32_t k) const {
    return triangles[numbers[positions[k]]];
  }

  template <class Visit>
  ZKD_HOST_DEVICE void operator()(std::uint32_t k, Visit& visit) const {
    const std::uint32_t trunk = trunk_of[positions[k]];
    Link link = Link::leaf(trunk);
    Parent parent = parents_of_leaves[trunk];
    while (!parent.is_none() && levels[parent.node()] >= first_reference_level) {
      link = Link::node(parent.node());
      parent = parents_of_nodes[parent.node()];
    }
    const Box& box = inside[numbers[positions[k]]];
    if (link.is_leaf())
      visit(link.index(), box);
    else
      walk.below(id(k), link, walk.place(id(k)), box, visit);
  }
};

/// What the leaves list from now on: crowded ones what was found below them, the others what they
/// did.
struct LeafLists {
  const std::uint32_t* offsets;  ///< of leaves, and the end, as they were
  std::uint32_t crowded;
  CrowdedTriangles members;            ///< references of crowded leaves, by walk
  const std::uint32_t* found_offsets;  ///< by walk: what it found first
  const std::uint32_t* walk_count;
  const std::uint64_t* found_count;

  struct Range {
    std::uint32_t begin;
    std::uint32_t end;
  };
  [[nodiscard]] ZKD_HOST_DEVICE Range before(std::uint32_t leaf) const {
    return {offsets[leaf], offsets[leaf + 1]};
  }
  [[nodiscard]] ZKD_HOST_DEVICE bool is_crowded(std::uint32_t leaf) const {
    return offsets[leaf + 1] - offsets[leaf] > crowded;
  }
  /// What was found below a crowded leaf.
  [[nodiscard]] ZKD_HOST_DEVICE Range found(std::uint32_t leaf) const {
    const std::uint32_t c = last_at_or_before(members.first, *members.trunks, offsets[leaf]);
    const std::uint32_t first = members.offsets[c];
    return {first_found(first), first_found(first + (offsets[leaf + 1] - offsets[leaf]))};
  }

 private:
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t first_found(std::uint32_t k) const {
    return k < *walk_count ? found_offsets[k] : static_cast<std::uint32_t>(*found_count);
  }
};

struct CountListed {
  LeafLists lists;
  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t leaf) const {
    const LeafLists::Range range = lists.is_crowded(leaf) ? lists.found(leaf) : lists.before(leaf);
    return range.end - range.begin;
  }
};

/// Puts the references of one leaf where they belong, those found below a crowded one in the order
/// of the leaves that it became: they follow one another, and so do those leaves.
struct PlaceReferences {
  LeafLists lists;
  const std::uint32_t* list_offsets;  ///< by leaf
  const std::uint32_t* numbers_before;
  const std::uint32_t* leaf_count;
  const std::uint32_t* trunk_count;
  const std::uint32_t* trunk_offsets;  ///< by leaf: its first trunk
  const std::uint32_t* found_in;       ///< which trunk
  std::uint32_t* numbers;
  std::uint32_t* offsets;  ///< of trunks
  std::uint32_t* next;     ///< likewise: where the next goes

  ZKD_HOST_DEVICE void operator()(std::uint32_t leaf) const {
    const std::uint32_t first = trunk_offsets[leaf];
    std::uint32_t place = list_offsets[leaf];
    if (!lists.is_crowded(leaf)) {
      const LeafLists::Range range = lists.before(leaf);
      offsets[first] = place;
      for (std::uint32_t i = range.begin; i < range.end; ++i) numbers[place++] = numbers_before[i];
      return;
    }
    const std::uint32_t last = leaf + 1 < *leaf_count ? trunk_offsets[leaf + 1] : *trunk_count;
    const LeafLists::Range range = lists.found(leaf);
    for (std::uint32_t t = first; t < last; ++t) next[t] = 0;
    for (std::uint32_t i = range.begin; i < range.end; ++i) ++next[found_in[i]];
    for (std::uint32_t t = first; t < last; ++t) {
      offsets[t] = place;
      place += next[t];
      next[t] = offsets[t];
    }
    for (std::uint32_t i = range.begin; i < range.end; ++i)
      numbers[next[found_in[i]]++] = i | found_again;
  }
};

/// As LabelTrunk, for trunks of crowded leaves alone: others are not looked for.
struct LabelReferenceTrunk {
  LabelTrunk label;
  const std::uint32_t* leaves;
  LeafLists lists;
  ZKD_HOST_DEVICE void operator()(std::uint32_t trunk) const {
    if (lists.is_crowded(leaves[trunk])) label(trunk);
  }
};

/// Memory of what is needed before it is known whether a leaf is crowded.
struct CrowdedLeavesWorkspace {
  std::uint32_t* scratch[2];  ///< then of crowded references: positions, offsets of what they find
  std::uint8_t* levels_left;

  void lay_out(Arena& arena, std::size_t references, std::size_t leaves) {
    for (std::uint32_t*& room : scratch) room = arena.take<std::uint32_t>(references);
    levels_left = arena.take<std::uint8_t>(leaves);
  }
};

/// Where trunks of references begin, by leaf.
struct ReferenceTrunkWorkspace {
  std::uint32_t* offsets;
  std::uint32_t* list_offsets;  ///< where the references of each leaf go
  std::uint32_t* trunk_of;      ///< of the references of crowded leaves

  void lay_out(Arena& arena, std::size_t references, std::size_t leaves) {
    offsets = arena.take<std::uint32_t>(leaves);
    list_offsets = arena.take<std::uint32_t>(leaves);
    trunk_of = arena.take<std::uint32_t>(references);
  }
};

/// The tree over trunks of references.
struct SubtreeWorkspace {
  std::uint32_t* first;
  std::uint32_t* leaves;
  TrunkKey* keys;
  std::uint8_t* levels;
  SplitNode* nodes;
  Parent* parents_of_nodes;
  Parent* parents_of_leaves;
  std::uint32_t* arrivals;

  void lay_out(Arena& arena, std::size_t trunks) {
    first = arena.take<std::uint32_t>(trunks);
    leaves = arena.take<std::uint32_t>(trunks);
    keys = arena.take<TrunkKey>(trunks);
    levels = arena.take<std::uint8_t>(trunks);
    nodes = arena.take<SplitNode>(trunks);
    parents_of_nodes = arena.take<Parent>(trunks);
    parents_of_leaves = arena.take<Parent>(trunks);
    arrivals = arena.take<std::uint32_t>(trunks);
  }
};

/// What was found below crowded leaves.
struct FoundAgainWorkspace {
  std::uint32_t* found_in;
  std::uint32_t* ids;
  Box* inside;

  void lay_out(Arena& arena, std::size_t found) {
    found_in = arena.take<std::uint32_t>(found);
    ids = arena.take<std::uint32_t>(found);
    inside = arena.take<Box>(found);
  }
};

/// References of the smaller leaves.
struct SplitReferenceWorkspace {
  std::uint32_t* numbers;
  std::uint32_t* offsets;

  void lay_out(Arena& arena, std::size_t references, std::size_t leaves) {
    numbers = arena.take<std::uint32_t>(references);
    offsets = arena.take<std::uint32_t>(leaves + 1);
  }
};

/// The most leaves that `references` in `leaves` leaves can be split into.
inline std::uint32_t most_reference_trunks(std::uint64_t references, std::uint64_t leaves) {
  return static_cast<std::uint32_t>(smaller(references + leaves, std::uint64_t{max_count}));
}

/// Start to end. Changes `tree` to the tree of the smaller leaves, if any leaf is crowded.
template <class Backend>
struct SplitCrowdedLeaves {
  CellWalk walk;  ///< of the tree as it is
  const TrunkKey* leaf_keys;
  std::uint32_t leaf_size;
  AxisOrder order;
  BuildCounts* counts;
  Link* root;
  std::uint32_t most_leaves;  ///< as many as the backend makes room for

  void run(Backend& backend, const TriangleView& view, StrictTree& tree) {
    // Those before; they are fewer than what tree.leaves.actual says from AdoptReferenceTrunks on.
    Count leaves = tree.leaves;
    const Count references = tree.references;
    const std::uint32_t crowded = crowded_factor * leaf_size;
    CrowdedLeavesWorkspace room{};
    backend.take(room, backend.size(references), backend.size(leaves));
    backend.for_each(leaves,
                     LevelsLeft{tree.offsets, crowded, tree.numbers, tree.listed.inside,
                                tree.parents_of_leaves, tree.parents_of_nodes, room.levels_left});
    SecondRound<std::uint32_t, Backend> round{tree.listed.inside,
                                              tree.leaf_of,
                                              tree.numbers,
                                              references,
                                              crowded,
                                              order,
                                              walk.frame,
                                              &counts->crowded_leaves,
                                              &counts->crowded_references,
                                              room.scratch[0],
                                              room.scratch[1],
                                              room.levels_left};
    round.run(backend);
    if (round.work.fine == nullptr) return;

    ReferenceTrunkWorkspace by_leaf{};
    backend.take(by_leaf, backend.size(references), backend.size(leaves));
    const ReferenceTrunks trunks{
        {{tree.leaf_of, round.work.fine}, references.actual, reference_trunk_factor * leaf_size, 0},
        tree.offsets,
        crowded};
    backend.exclusive_scan(leaves, CountReferenceTrunks{trunks}, by_leaf.offsets,
                           &counts->reference_trunks);
    SubtreeWorkspace work{};
    const Count split{&counts->reference_trunks, most_leaves};
    backend.take(work, backend.size(split));
    backend.for_each(leaves, WriteReferenceTrunks{trunks, by_leaf.offsets, leaf_keys, work.first,
                                                  work.leaves, work.keys});
    backend.for_each(one, AdoptReferenceTrunks{counts, &counts->reference_trunks});

    leaves.actual = &counts->first_trunks;

    const Count nodes{&counts->nodes, most_leaves};
    const SplitNode* before = tree.nodes;
    backend.for_each(nodes, EssentialLevel{work.keys, work.levels});
    const LinkWriter writer{work.nodes != nullptr ? work.nodes->child : nullptr,
                            sizeof(SplitNode) / sizeof(Link),
                            work.parents_of_nodes,
                            work.parents_of_leaves,
                            root,
                            &counts->trunks};
    backend.for_each(split, LinkTrunk{work.levels, writer});
    backend.for_each(nodes, LinkEssentialNode{work.keys, work.levels, writer});
    backend.for_each(nodes,
                     PlaceSplitPlaneAgain{work.keys,
                                          work.levels,
                                          work.leaves,
                                          before,
                                          {work.first, round.work.first, &counts->crowded_leaves,
                                           round.work.lattices, round.work.coders},
                                          work.nodes});
    const Count crowded_references{&counts->crowded_references, references.bound};
    std::uint32_t* positions = room.scratch[0];
    std::uint32_t* found_offsets = room.scratch[1];
    const LeafLists lists{tree.offsets,
                          crowded,
                          round.members(),
                          found_offsets,
                          crowded_references.actual,
                          &counts->found_again_needed};
    backend.for_each(split, LabelReferenceTrunk{
                                {work.first, &counts->trunks, references.actual, by_leaf.trunk_of},
                                work.leaves,
                                lists});
    backend.for_each(crowded_references, PlaceOfCrowded{round.members(), positions});

    CellWalk below = walk;
    below.nodes = work.nodes;
    const ReferenceWalk again{below,
                              positions,
                              tree.numbers,
                              tree.listed.ids,
                              tree.listed.inside,
                              by_leaf.trunk_of,
                              work.levels,
                              work.parents_of_nodes,
                              work.parents_of_leaves};
    FindReferences<ReferenceWalk, Backend> find{again, crowded_references, remembered_of_reference,
                                                found_offsets};
    find.count(backend, &counts->found_again_needed);
    backend.for_each(one, AdmitFoundAgain{counts});
    backend.raise(&counts->status, view);
    backend.exclusive_scan(leaves, CountListed{lists}, by_leaf.list_offsets,
                           &counts->references_needed);
    const Count listed = admit_references(backend, counts, &counts->references, view);
    FoundAgainWorkspace found{};
    backend.take(found, backend.size(Count{&counts->found_again, listed.bound}));
    find.write(backend, &counts->found_again, {found.found_in, found.ids, found.inside});
    SplitReferenceWorkspace placed{};
    backend.take(placed, backend.size(listed), backend.size(split));
    backend.for_each(
        leaves, PlaceReferences{lists, by_leaf.list_offsets, tree.numbers, &counts->first_trunks,
                                &counts->trunks, by_leaf.offsets, found.found_in, placed.numbers,
                                placed.offsets, work.arrivals});
    backend.for_each(one, CloseOffsets{&counts->trunks, listed.actual, placed.offsets});
    tree.leaves = {&counts->trunks, most_leaves};
    tree.inner = nodes;
    tree.nodes = work.nodes;
    tree.parents_of_nodes = work.parents_of_nodes;
    tree.parents_of_leaves = work.parents_of_leaves;
    tree.arrivals = work.arrivals;
    tree.references = listed;
    tree.offsets = placed.offsets;
    tree.leaf_of = nullptr;
    tree.numbers = placed.numbers;
    tree.listed.ids_again = found.ids;
    tree.listed.inside_again = found.inside;
  }
};

}  // namespace zkd::core
