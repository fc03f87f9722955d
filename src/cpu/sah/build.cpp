// SPDX-License-Identifier: Apache-2.0
//
// The SAH builder, start to end: I. Wald, V. Havran, On building fast kd-Trees for Ray Tracing, and
// on doing that in O(N log N), RT 2006. build() is the table of contents.
//
// Validation, tree space and what the owner is told are those of the Morton builder.
#include "cpu/sah/build.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "core/outcome.hpp"
#include "core/pipeline.hpp"
#include "core/quality.hpp"
#include "core/sah/rounding.hpp"
#include "cpu/backend.hpp"
#include "cpu/sah/divide.hpp"
#include "cpu/sah/front.hpp"

namespace zkd::cpu::sah {
namespace {

// What validation leaves behind.
struct Input {
  core::BuildState* state;
  Box* boxes;
  std::uint32_t* ids;

  void lay_out(core::Arena& arena, std::size_t triangles) {
    state = arena.take<core::BuildState>(1);
    boxes = arena.take<Box>(triangles);
    ids = arena.take<std::uint32_t>(triangles);
  }
};

class Build {
 public:
  Build(const Executor& executor, const TriangleView& triangles, const BuildOptions& options)
      : backend_(executor),
        threads_(executor),
        memory_(backend_.memory()),
        triangles_(triangles),
        options_(options) {}

  Tree run() {
    validate();
    Part root{};
    Block block = place_references(root);
    sort_events(root);

    backend_.stage(Stage::split_planes);
    const Clipper clip(triangles_, input_.state->frame);
    Front front(threads_, memory_, options_.sah, clip);
    if (root.count > 0) front.build(std::move(block), root);

    assemble(front);
    return finish();
  }

 private:
  [[nodiscard]] core::BuildCounts& counts() const { return input_.state->counts; }

  void validate() {
    backend_.stage(Stage::validate);
    const auto given = static_cast<std::uint32_t>(triangles_.triangle_count);
    backend_.take(input_, given);
    core::BuildState& state = *std::construct_at(input_.state);
    backend_.reduce(core::Count{nullptr, given}, &state.report,
                    core::ValidateTriangle{triangles_, input_.boxes});
    core::admit_scene(state, triangles_, options_.invalid_triangles);
    backend_.raise(&state.counts.status, triangles_);
    backend_.select(core::Count{nullptr, given}, core::IsListed{input_.boxes}, input_.ids,
                    &state.counts.listed);
    if (state.counts.listed > max_references_of_cell)
      throw Error(ErrorCode::too_many_triangles, state.counts.listed,
                  std::to_string(state.counts.listed) + " valid triangles; builder sah takes " +
                      std::to_string(max_references_of_cell));
  }

  // The root: every valid triangle with its box in tree space.
  Block place_references(Part& root) {
    root.count = counts().listed;
    Block block =
        lay_out_block(memory_, [&](core::Arena& arena) { take_part(arena, root.count, root); });
    const double scale = input_.state->frame.scale;
    if (root.count > 0) root.cell = in_tree_space(input_.state->report.bounds, scale);
    threads_.share(root.count, grain, [&root, scale, input = input_](Range range) {
      for (std::uint32_t i = range.begin; i < range.end; ++i) {
        const std::uint32_t id = input.ids[i];
        root.references[i] = {in_tree_space(input.boxes[id], scale), id};
      }
    });
    return block;
  }

  // A stable sort by position of events in the order of their kinds.
  void sort_events(Part& root) {
    backend_.stage(Stage::sort);
    core::SortBuffers<std::uint32_t> buffers{};
    const Block block = lay_out_block(memory_, [&](core::Arena& arena) {
      const std::size_t most = 2 * std::size_t{root.count};
      buffers = {arena.take<std::uint32_t>(most), arena.take<std::uint32_t>(most),
                 arena.take<std::uint32_t>(most), arena.take<std::uint32_t>(most)};
    });
    for (int a = 0; a < 3; ++a) {
      std::uint32_t n = 0;
      for (const Kind kind : {Kind::end, Kind::flat, Kind::start})
        for (std::uint32_t i = 0; i < root.count; ++i) {
          const Box& box = root.references[i].box;
          if ((box.lo[a] == box.hi[a]) != (kind == Kind::flat)) continue;
          buffers.keys[n] = ordered_bits(kind == Kind::end ? box.hi[a] : box.lo[a]);
          buffers.values[n++] = kind_and_reference(kind, i);
        }
      const auto sorted = backend_.radix_sort(buffers, core::Count{nullptr, n}, 32);
      threads_.share(n, grain, [events = root.events[a], sorted](Range range) {
        for (std::uint32_t i = range.begin; i < range.end; ++i)
          events[i] = Event{sorted.keys[i]} << 32 | sorted.values[i];
      });
      root.event_count[a] = n;
    }
  }

  // ---- From tops and subtrees to one tree ------------------------------------------------------

  // Where the leaves and references of a top begin in the finished tree.
  struct Place {
    std::uint32_t leaf;
    std::uint32_t reference;
  };

  void assemble(const Front& front) {
    backend_.stage(Stage::references);
    const List<Top>& tops = front.tops();
    count(tops);
    backend_.allocate_tree(core::Count{&counts().trunks, 0});
    backend_.allocate_references(core::Count{&counts().references, 0});
    Place* places = nullptr;
    Link* roots = nullptr;
    const Block block = lay_out_block(memory_, [&](core::Arena& arena) {
      places = arena.take<Place>(tops.size());
      roots = arena.take<Link>(tops.size());
    });
    Place end{0, 0};
    if (tops.size() > 0) {
      number(tops, 0, end, places, roots);
      input_.state->root = roots[0];
    }
    backend_.leaf_offsets()[end.leaf] = end.reference;
    threads_.share(static_cast<std::uint32_t>(tops.size()), 1, [&](Range range) {
      for (std::uint32_t i = range.begin; i < range.end; ++i)
        if (!tops[i].divided) copy(tops[i].subtree, places[i]);
    });
    backend_.for_each(core::one, core::WriteHeader{input_.state, backend_.header()});
  }

  void count(const List<Top>& tops) const {
    std::uint64_t leaves = 0;
    std::uint64_t references = 0;
    for (std::size_t i = 0; i < tops.size(); ++i) {
      if (tops[i].divided) continue;
      leaves += tops[i].subtree.leaf_count;
      references += tops[i].subtree.reference_count;
    }
    const std::uint64_t most = std::max(leaves, references);
    if (most > max_count)
      throw Error(ErrorCode::too_many_references, most,
                  "builder sah makes " + std::to_string(leaves) + " leaves with " +
                      std::to_string(references) + " references, and a tree holds at most " +
                      std::to_string(max_count));
    counts().trunks = static_cast<std::uint32_t>(leaves);
    counts().nodes = leaves > 0 ? static_cast<std::uint32_t>(leaves - 1) : 0;
    counts().references = static_cast<std::uint32_t>(references);
  }

  // Depth first: where each subtree goes, and the nodes above them.
  void number(const List<Top>& tops, std::uint32_t i, Place& end, Place* places,
              Link* roots) const {
    const Top& top = tops[i];
    places[i] = end;
    if (!top.divided) {
      roots[i] = moved(top.subtree.root, end.leaf);
      end.leaf += top.subtree.leaf_count;
      end.reference += top.subtree.reference_count;
      return;
    }
    number(tops, top.child[0], end, places, roots);
    const std::uint32_t node = end.leaf - 1;
    number(tops, top.child[1], end, places, roots);
    write_node(backend_.nodes()[node], top.split, {tops[top.child[0]].box, tops[top.child[1]].box},
               {roots[top.child[0]], roots[top.child[1]]});
    roots[i] = Link::node(node);
  }

  // Nodes and leaves are numbered alike, from the first leaf on.
  static Link moved(Link link, std::uint32_t by) { return Link{link.bits + by}; }

  void copy(const Subtree& subtree, const Place& place) const {
    Node* const nodes = backend_.nodes() + place.leaf;
    for (std::uint32_t i = 0; i + 1 < subtree.leaf_count; ++i) {
      nodes[i] = subtree.nodes[i];
      for (Link& child : nodes[i].child) child = moved(child, place.leaf);
    }
    std::uint32_t* const offsets = backend_.leaf_offsets() + place.leaf;
    std::uint32_t begin = place.reference;
    for (std::uint32_t i = 0; i < subtree.leaf_count; ++i) {
      offsets[i] = begin;
      begin = place.reference + subtree.leaf_ends[i];
    }
    std::copy_n(subtree.references, subtree.reference_count,
                backend_.references() + place.reference);
  }

  Tree finish() {
    backend_.finish();
    const core::BuildState& state = *input_.state;
    Statistics statistics =
        core::describe(state, options_, triangles_.triangle_count, backend_.passes_left_out());
    statistics.workspace_bytes = backend_.workspace_bytes() + memory_.most_held();
    statistics.stage_ms = backend_.stage_ms();
    const TreeView view{backend_.header(), backend_.nodes(), backend_.leaf_offsets(),
                        backend_.references()};
    if (options_.measure_quality) core::measure_quality(view, statistics);
    BuildOptions used = options_;
    used.backend = zkd::Backend::cpu;
    used.references = References::all;
    return TreeAssembler::assemble(view, state, used, statistics, backend_.tree_block(),
                                   backend_.reference_block());
  }

  Backend backend_;
  Threads threads_;
  Memory memory_;
  const TriangleView& triangles_;
  const BuildOptions& options_;
  Input input_{};
};

}  // namespace

Tree build(const Executor& executor, const TriangleView& triangles, const BuildOptions& options) {
  return Build(executor, triangles, options).run();
}

}  // namespace zkd::cpu::sah
