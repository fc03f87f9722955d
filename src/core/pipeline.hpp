// SPDX-License-Identifier: Apache-2.0
//
// The Morton builder, start to end, over the verbs of a backend: Li, Wang, Deng, Fully Parallel
// Kd-Tree Construction for Real-Time Ray Tracing, I3D 2014. Each step is one file of this folder.
//
// MortonPipeline::run is the table of contents. Every step is a fixed number of passes over all
// elements; none goes level by level, and nothing here recurses. The verbs are described in
// core/verbs.hpp.
#pragma once

#include <cstdint>
#include <type_traits>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/statistics.hpp>
#include <zkd/tree.hpp>

#include "core/arena.hpp"
#include "core/boxes.hpp"
#include "core/clusters.hpp"
#include "core/compress.hpp"
#include "core/crowded_leaves.hpp"
#include "core/essential.hpp"
#include "core/frame.hpp"
#include "core/key.hpp"
#include "core/lattice.hpp"
#include "core/morton.hpp"
#include "core/planes.hpp"
#include "core/recode.hpp"
#include "core/references.hpp"
#include "core/split.hpp"
#include "core/status.hpp"
#include "core/trunks.hpp"
#include "core/validate.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// Small results of the stages, in the backend's memory.
struct BuildState {
  ValidationReport report;
  Link root;
  BuildCounts counts;
  Lattice lattice;
  MortonCoder coder;
  SceneFrame frame;
};
// It is copied as a whole, and a checker of memory takes padding for a number that nobody wrote.
static_assert(sizeof(BuildState) == sizeof(ValidationReport) + sizeof(Link) + sizeof(BuildCounts) +
                                        sizeof(Lattice) + sizeof(MortonCoder) + sizeof(SceneFrame));

/// What a tree consists of, but for its references.
struct TreeArrays {
  TreeHeader* header;
  Node* nodes;
  std::uint32_t* leaf_offsets;

  void lay_out(Arena& arena, std::size_t leaves) {
    header = arena.take<TreeHeader>(1);
    nodes = arena.take<Node>(leaves > 0 ? leaves - 1 : 0);
    leaf_offsets = arena.take<std::uint32_t>(leaves + 1);
  }
};

/// Everything whose size follows from the number of triangles.
template <class Code>
struct Workspace {
  BuildState* state;
  Box* boxes;
  SortBuffers<Code> sort;
  std::uint32_t* trunk_first;  ///< position of the first triangle of each trunk, and the end
  TrunkKey* trunk_keys;
  std::uint8_t* levels;  ///< of essential nodes
  Parent* parents_of_nodes;
  Parent* parents_of_leaves;
  std::uint32_t* arrivals;  ///< children that have arrived at each node, for climb

  void lay_out(Arena& arena, std::size_t triangles) {
    state = arena.take<BuildState>(1);
    boxes = arena.take<Box>(triangles);
    sort = {arena.take<Code>(triangles), arena.take<std::uint32_t>(triangles),
            arena.take<Code>(triangles), arena.take<std::uint32_t>(triangles)};
    trunk_first = arena.take<std::uint32_t>(triangles + 1);
    trunk_keys = arena.take<TrunkKey>(triangles);
    levels = arena.take<std::uint8_t>(triangles);
    parents_of_nodes = arena.take<Parent>(triangles);
    parents_of_leaves = arena.take<Parent>(triangles);
    arrivals = arena.take<std::uint32_t>(triangles);
  }
};

/// `all`: the tree of trunks, before it is known how many leaves there will be.
struct SkeletonWorkspace {
  SplitNode* nodes;

  void lay_out(Arena& arena, std::size_t leaves) { nodes = arena.take<SplitNode>(leaves); }
};

/// Whether triangles may have to be split.
inline bool may_split(const BuildOptions& options) {
  return options.references != References::once;
}

/// Counts and frame from what validation found; or the end of the build.
ZKD_HOST_DEVICE inline void admit_scene(BuildState& state, const TriangleView& triangles,
                                        InvalidTriangles invalid) {
  const auto given = static_cast<std::uint32_t>(triangles.triangle_count);
  const std::uint32_t valid = state.report.valid;
  state.counts = {};
  state.counts.given = given;
  state.counts.listed = valid;
  state.counts.left_out = given - valid;
  judge(state.report, triangles, invalid, state.counts);
  if (state.counts.status.failed != 0) state.report.bounds = Box{};
  state.root = Link{};
  state.frame = SceneFrame(state.report.bounds);
}

/// The same with lattice and coder.
struct PrepareScene {
  BuildState* state;
  TriangleView triangles;
  std::uint32_t code_bits_asked;
  AxisOrder order;
  InvalidTriangles invalid;
  bool clusters;
  References references;
  const std::uint32_t* sizes;  ///< where the scene decides whether triangles are split

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    admit_scene(*state, triangles, invalid);
    const std::uint32_t valid = state->report.valid;
    bool splits = references == References::budget;
    if (splits_if_uneven(references))
      splits = is_uneven(references, unevenness_of(sizes, state->report.bounds, valid));
    state->counts.splits = splits ? 1 : 0;
    std::uint32_t code_bits = choose_code_bits(code_bits_asked, valid);
    if (clusters) code_bits = code_bits_below_path(code_bits, valid);
    state->lattice =
        make_lattice(widen(state->report.bounds), code_bits, order, state->frame.finest);
    state->coder = MortonCoder(state->lattice);
  }
};

struct CountNodes {
  BuildCounts* counts;
  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    counts->nodes = counts->trunks > 0 ? counts->trunks - 1 : 0;
  }
};

/// What a finished tree says about itself.
struct WriteHeader {
  const BuildState* state;
  TreeHeader* header;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    const bool failed = state->counts.status.failed != 0;
    header->bounds = failed ? Box{} : state->report.bounds;
    header->scale = static_cast<float>(state->frame.scale);
    header->root = failed ? Link{} : state->root;
    header->leaf_count = state->counts.trunks;
    header->reference_count = state->counts.references;
  }
};

/// What is coded and sorted: triangles, or at most so many fragments of them.
inline std::uint32_t most_elements(const BuildOptions& options, std::uint32_t triangles) {
  return may_split(options) ? most_fragments(options.budget, triangles) : triangles;
}

/// One build. `Code` only has to hold the bits of the lattice: it does not change the tree.
template <class Code, class Backend>
class MortonPipeline {
 public:
  MortonPipeline(Backend& backend, const TriangleView& triangles, const BuildOptions& options)
      : backend_(backend),
        triangles_(triangles),
        options_(options),
        triangle_count_(static_cast<std::uint32_t>(triangles.triangle_count)),
        most_(most_elements(options, triangle_count_)) {}

  /// Runs all stages. The tree's arrays are the backend's.
  void run() {
    Workspace<Code> work;
    backend_.take(work, most_);
    if (may_split(options_)) backend_.take(split_, triangle_count_, most_);
    state_ = work.state;
    counts_ = &work.state->counts;

    validate(work);                              // 1 validate.hpp, 2 lattice.hpp
    split(work);                                 //   split.hpp: unless for `once`
    encode(work);                                // 3 morton.hpp
    sort(work);                                  // 4 a verb of the backend
    arrange(work);                               //   clusters.hpp: for Quality::balanced
    const SortedKeys<Code> keys = recode(work);  // 5 recode.hpp
    find_trunks(work, keys);                     // 6 trunks.hpp
    find_essential_nodes(work);                  // 7 essential.hpp
    compress_paths(work);                        // 8 compress.hpp
    split_planes(work);                          // 9 planes.hpp
    list_references(work);                       // 10 references.hpp
    tight_boxes(work);                           // 11 boxes.hpp
  }

  /// What the stages found, in the backend's memory.
  [[nodiscard]] const BuildState* state() const { return state_; }

 private:
  [[nodiscard]] Count given() const { return {&counts_->given, most_}; }
  [[nodiscard]] Count listed() const { return {&counts_->listed, most_}; }
  [[nodiscard]] Count trunks() const { return {&counts_->trunks, most_}; }
  [[nodiscard]] Count nodes() const { return {&counts_->nodes, most_}; }

  [[nodiscard]] bool balanced() const { return options_.quality == Quality::balanced; }
  /// Once validation is done. Where only the device knows: true, and no triangle gets a cut.
  [[nodiscard]] bool splits() const {
    return may_split(options_) && backend_.may_exist(Count{&counts_->splits, 1});
  }

  /// Where the links and planes of nodes are, of which there may be none.
  template <class AnyNode>
  [[nodiscard]] static Link* links_of(AnyNode* nodes) {
    return nodes != nullptr ? nodes->child : nullptr;
  }
  template <class AnyNode>
  [[nodiscard]] static PlaneWriter planes_of(AnyNode* nodes) {
    if (nodes == nullptr) return {};
    return {&nodes->axis, &nodes->plane, sizeof(AnyNode) / sizeof(float)};
  }

  /// Whether leaves list every triangle that touches their cells.
  [[nodiscard]] bool strict() const { return options_.references == References::all; }

  /// Bits that a code may have; the lattice may use fewer, whose digits the sort leaves out.
  [[nodiscard]] std::uint32_t code_bits_bound() const {
    return options_.code_bits != 0 ? options_.code_bits
                                   : static_cast<std::uint32_t>(8 * sizeof(Code));
  }

  void validate(Workspace<Code>& work) {
    backend_.stage(Stage::validate);
    const Count triangles{nullptr, triangle_count_};
    const ValidateTriangle validate{triangles_, may_split(options_) ? split_.boxes : work.boxes};
    if (splits_if_uneven(options_.references))
      backend_.reduce_and_count(triangles, &state_->report, ValidateAndMeasure{validate},
                                SizeClasses::count, split_.sizes);
    else
      backend_.reduce(triangles, &state_->report, validate);
    backend_.for_each(one, PrepareScene{state_, triangles_, options_.code_bits, options_.axis_order,
                                        options_.invalid_triangles, balanced(), options_.references,
                                        split_.sizes});
    backend_.raise(&counts_->status, triangles_);
  }

  void split(Workspace<Code>& work) {
    if (!may_split(options_)) return;
    if (!splits()) {
      work.boxes = split_.boxes;
      return;
    }
    backend_.stage(Stage::split);
    SplitAll<Backend>{triangles_, split_,          &state_->lattice, &state_->report.bounds,
                      counts_,    options_.budget, work.boxes}
        .run(backend_);
  }

  void encode(Workspace<Code>& work) {
    backend_.stage(Stage::encode);
    std::uint32_t* ids = work.sort.values;
    if (backend_.may_exist(Count{&counts_->left_out, most_}))
      backend_.select(given(), IsListed{work.boxes}, ids, &counts_->listed);
    else
      backend_.for_each(listed(), Number{ids});
    backend_.for_each(listed(),
                      EncodeTriangle<Code>{work.boxes, ids, &state_->coder, work.sort.keys});
  }

  void sort(Workspace<Code>& work) {
    backend_.stage(Stage::sort);
    work.sort = backend_.radix_sort(work.sort, listed(), code_bits_bound());
  }

  void arrange(Workspace<Code>& work) {
    if constexpr (sizeof(Code) == 8) {
      if (!balanced()) return;
      backend_.stage(Stage::clusters);
      backend_.take(clusters_, 1u);
      ArrangeClusters<Backend> stage{work.boxes,     &state_->lattice,
                                     &state_->coder, &state_->report.valid,
                                     listed(),       clusters_.state};
      work.sort = stage.run(backend_, work.sort);
      cluster_planes_ = stage.planes();
    }
  }

  SortedKeys<Code> recode(Workspace<Code>& work) {
    backend_.stage(Stage::recode);
    SortedKeys<Code> keys{work.sort.keys, nullptr,
                          balanced() ? &clusters_.state->key_bits : &state_->lattice.code_bits};
    if (!options_.recode_crowded) return keys;
    SecondRound<Code, Backend> round{work.boxes,
                                     work.sort.keys,
                                     work.sort.values,
                                     listed(),
                                     options_.leaf_size,
                                     options_.axis_order,
                                     &state_->frame,
                                     &counts_->crowded_trunks,
                                     &counts_->crowded_triangles,
                                     work.sort.other_values,  // free again after the sort
                                     work.trunk_first};       // not yet in use
    round.run(backend_);
    recoded_ = round.work;
    keys.fine = recoded_.fine;
    return keys;
  }

  void find_trunks(Workspace<Code>& work, const SortedKeys<Code>& keys) {
    backend_.stage(Stage::trunks);
    using Keys = std::conditional_t<sizeof(Code) == 4, PackedKeys, SortedKeys<Code>>;
    backend_.select(listed(), BeginsTrunk<Keys>{Keys{keys}, &counts_->listed, options_.leaf_size},
                    work.trunk_first, &counts_->trunks);
    backend_.for_each(one, CountNodes{counts_});
    backend_.for_each(trunks(),
                      TrunkKeyOf<SortedKeys<Code>>{keys, work.trunk_first, work.trunk_keys});
    if (strict())
      backend_.take(skeleton_, backend_.size(trunks()));
    else
      backend_.allocate_tree(trunks());
  }

  void find_essential_nodes(Workspace<Code>& work) {
    backend_.stage(Stage::essential_nodes);
    backend_.for_each(nodes(), EssentialLevel{work.trunk_keys, work.levels});
  }

  void compress_paths(Workspace<Code>& work) {
    backend_.stage(Stage::path_compression);
    const LinkWriter writer{strict() ? links_of(skeleton_.nodes) : links_of(backend_.nodes()),
                            (strict() ? sizeof(SplitNode) : sizeof(Node)) / sizeof(Link),
                            work.parents_of_nodes,
                            work.parents_of_leaves,
                            &state_->root,
                            &counts_->trunks};
    backend_.for_each(trunks(), LinkTrunk{work.levels, writer});
    backend_.for_each(nodes(), LinkEssentialNode{work.trunk_keys, work.levels, writer});
  }

  void split_planes(Workspace<Code>& work) {
    backend_.stage(Stage::split_planes);
    const PlaneWriter writer = strict() ? planes_of(skeleton_.nodes) : planes_of(backend_.nodes());
    const CrowdByPosition crowd{work.trunk_first, recoded_.first, &counts_->crowded_trunks,
                                recoded_.lattices, recoded_.coders};
    const auto place = [&](const auto& scene) {
      using Scene = std::decay_t<decltype(scene)>;
      backend_.for_each(this->nodes(), PlaceSplitPlane<Scene, CrowdByPosition>{
                                           work.trunk_keys, work.levels, scene, crowd,
                                           &state_->frame.scale, writer});
    };
    if constexpr (sizeof(Code) == 8)
      if (balanced()) return place(cluster_planes_);
    place(LatticePlanes{&state_->lattice, &state_->coder});
  }

  void list_references(Workspace<Code>& work) {
    backend_.stage(Stage::references);
    if (strict()) {
      list_everywhere(work);
    } else if (!splits()) {
      backend_.for_each(one, ReferenceEachOnce{counts_});
      backend_.allocate_references(listed());
      backend_.for_each(listed(), CopyTo<std::uint32_t>{work.sort.values, backend_.references()});
      backend_.for_each(trunks(), CopyTo<std::uint32_t>{work.trunk_first, backend_.leaf_offsets()});
      backend_.for_each(
          one, CloseOffsets{&counts_->trunks, &counts_->references, backend_.leaf_offsets()});
    } else {
      backend_.for_each(one, CloseTrunks{counts_, work.trunk_first});
      const TrunkOfFragments fragments{work.sort.values, work.trunk_first, split_.owners,
                                       options_.leaf_size};
      backend_.exclusive_scan(trunks(), CountOwners{fragments}, backend_.leaf_offsets(),
                              &counts_->references);
      backend_.allocate_references(Count{&counts_->references, most_});
      backend_.for_each(trunks(),
                        ListOwners{fragments, backend_.leaf_offsets(), backend_.references()});
      backend_.for_each(
          one, CloseOffsets{&counts_->trunks, &counts_->references, backend_.leaf_offsets()});
    }
  }

  void list_everywhere(Workspace<Code>& work) {
    StrictTree tree{};
    tree.leaves = trunks();
    tree.inner = nodes();
    tree.nodes = skeleton_.nodes;
    tree.parents_of_nodes = work.parents_of_nodes;
    tree.parents_of_leaves = work.parents_of_leaves;
    tree.arrivals = work.arrivals;
    // Memory that earlier stages are done with.
    auto* trunk_of = reinterpret_cast<std::uint32_t*>(work.sort.other_keys);
    const CellWalk walk{triangles_,
                        work.sort.values,
                        splits() ? split_.owners : nullptr,
                        trunk_of,
                        split_.boxes,
                        skeleton_.nodes,
                        work.levels,
                        work.parents_of_nodes,
                        work.parents_of_leaves,
                        balanced() ? nullptr : &state_->coder,
                        &state_->frame};
    ReferenceAll<Backend>{walk,    work.trunk_first, listed(),
                          counts_, trunk_of,         work.sort.other_values}
        .run(backend_, triangles_, tree);
    SplitCrowdedLeaves<Backend>{walk,
                                work.trunk_keys,
                                options_.leaf_size,
                                options_.axis_order,
                                counts_,
                                &state_->root,
                                most_reference_trunks(backend_.reference_capacity(), most_)}
        .run(backend_, triangles_, tree);
    backend_.allocate_tree(tree.leaves);
    backend_.for_each(tree.inner, FinishNode{tree.nodes, backend_.nodes()});
    backend_.for_each(tree.leaves, CopyTo<std::uint32_t>{tree.offsets, backend_.leaf_offsets()});
    if (tree.references.actual != &counts_->references)
      backend_.for_each(one, CopyTo<std::uint32_t>{tree.references.actual, &counts_->references});
    backend_.for_each(
        one, CloseOffsets{&counts_->trunks, &counts_->references, backend_.leaf_offsets()});
    backend_.allocate_references(tree.references);
    backend_.for_each(tree.references, GatherIds{tree.listed, tree.numbers, backend_.references()});
    strict_tree_ = tree;
  }

  void tight_boxes(Workspace<Code>& work) {
    backend_.stage(Stage::tight_boxes);
    if (strict()) {
      const StrictTree& tree = strict_tree_;
      backend_.for_each(tree.inner, Fill{tree.arrivals, 0});
      backend_.climb(
          tree.leaves, tree.arrivals,
          TightBoxes{nullptr, tree.offsets, nullptr, tree.parents_of_nodes, tree.parents_of_leaves,
                     &state_->frame, tree.listed, tree.numbers, backend_.nodes()});
    } else {
      backend_.for_each(nodes(), Fill{work.arrivals, 0});
      backend_.climb(trunks(), work.arrivals,
                     TightBoxes{work.boxes,
                                splits() ? work.trunk_first : backend_.leaf_offsets(),
                                splits() ? work.sort.values : backend_.references(),
                                work.parents_of_nodes,
                                work.parents_of_leaves,
                                &state_->frame,
                                {},
                                nullptr,
                                backend_.nodes()});
    }
    backend_.for_each(one, WriteHeader{state_, backend_.header()});
  }

  Backend& backend_;
  const TriangleView& triangles_;
  const BuildOptions& options_;
  std::uint32_t triangle_count_;
  std::uint32_t most_;
  BuildState* state_ = nullptr;
  BuildCounts* counts_ = nullptr;
  RecodeWorkspace recoded_{};
  SplitWorkspace split_{};
  ClusterRecord clusters_{};
  ClusterPlanes cluster_planes_{};
  SkeletonWorkspace skeleton_{};  ///< for `all`
  StrictTree strict_tree_{};      ///< likewise
};

}  // namespace zkd::core
