// SPDX-License-Identifier: Apache-2.0
//
// widen(): which nodes of the tree become wide ones is found from the leaves up (collapse.hpp), in
// subtrees that one thread each solves and then in the top of the tree. Nodes and blocks are laid
// out depth first, each subtree by one thread. The top of the tree is cut into subtrees by the
// number of leaves alone, each is counted, places come from a sum over the counts, and then each is
// written. All of it has the same bytes for any number of threads.
#include <zkd/cpu/wide_tree.hpp>

#include <algorithm>
#include <atomic>
#include <limits>
#include <string>

#include <zkd/error.hpp>
#include <zkd/traversal/triangle.hpp>

#include "core/arena.hpp"
#include "core/check_input.hpp"
#include "core/host_block.hpp"
#include "cpu/float_environment.hpp"
#include "cpu/threads.hpp"
#include "cpu/tree_form.hpp"
#include "cpu/wide/block.hpp"
#include "cpu/wide/collapse.hpp"

namespace zkd::cpu {
namespace {

// Nodes and blocks: how many, or the next ones to be written.
struct Place {
  std::uint32_t node = 0;
  std::uint32_t block = 0;
};

// A part that becomes a node, and where its number goes.
struct Subtree {
  Part part;
  std::uint32_t parent;  // no_parent: the root
  std::uint32_t slot;
};
constexpr std::uint32_t no_parent = 0xFFFFFFFFu;

// A subtree that one thread lays out.
struct Task {
  Subtree subtree;
  Place place;  // first its counts, then where it begins
};

// The tasks that the top of the tree leaves to threads.
struct Tasks {
  static constexpr std::uint32_t most = 4096;
  Task* data = nullptr;
  std::uint32_t capacity = 0;
  std::uint32_t count = 0;
  std::uint32_t largest = 0;  // leaves
  bool placed = false;        // the same tasks are named once more, and keep their places

  bool take(const Subtree& subtree) {
    if (count == capacity || subtree.part.end - subtree.part.begin > largest) return false;
    if (!placed) data[count] = {subtree, {}};
    ++count;
    return true;
  }
};

// A part of the tree that one thread collapses.
struct Branch {
  Part part;
  double area;
  Surfaces surfaces;
};

std::uint32_t blocks_for(std::uint32_t references) { return (references + wide - 1) / wide; }

class Layout {
 public:
  Layout(const TreeView& tree, const TriangleView& triangles)
      : tree_(tree), triangles_(triangles) {}

  void collapse_by(const Shares& shares) { shares_ = shares; }

  void write_to(WideNode* nodes, TriangleBlock* blocks) {
    nodes_ = nodes;
    blocks_ = blocks;
  }

  // Counts a subtree, or writes it where write_to() was called, from `next` on. `tasks` takes what
  // it will of the subtrees below; null: nothing.
  [[gnu::noinline]] void lay_out(const Subtree& top, Place& next, Tasks* tasks) const {
    Subtree waiting[std::size_t{max_depth} * (wide - 1) + wide];
    std::uint32_t count = 0;
    waiting[count++] = top;
    while (count > 0) {
      const Subtree subtree = waiting[--count];
      const std::uint32_t index = next.node++;
      const Children children(tree_, shares_, subtree.part);
      if (nodes_ != nullptr) start(subtree, index, children);
      for (int i = 0; i < children.count(); ++i)
        if (children.is_leaf(i)) {
          const std::uint32_t first = next.block;
          next.block += leaf(children.part(i), first);
          if (nodes_ != nullptr) nodes_[index].child[i] = Link::leaf(first);
        }
      // Taken from the end: the leftmost comes first.
      for (int i = children.count() - 1; i >= 0; --i) {
        if (children.is_leaf(i)) continue;
        const Subtree below{children.part(i), index, static_cast<std::uint32_t>(i)};
        if (tasks == nullptr || !tasks->take(below)) waiting[count++] = below;
      }
    }
  }

  // Blocks of a leaf; writes them from number `first` on.
  std::uint32_t leaf(const Part& part, std::uint32_t first) const {
    const std::uint32_t begin = tree_.leaf_offsets[part.begin];
    const std::uint32_t n = tree_.leaf_offsets[part.end] - begin;
    const bool merged = part.end - part.begin > 1;
    const std::uint32_t count = merged ? 1 : blocks_for(n);
    if (blocks_ == nullptr) {
      check(begin, n);
      return count;
    }
    if (merged) {
      const PartTriangles triangles(tree_, part);
      write(blocks_[first], triangles.ids(), triangles.count());
    }
    for (std::uint32_t i = 0; i < n && !merged; i += wide)
      write(blocks_[first + i / wide], tree_.references + begin + i,
            std::min<std::uint32_t>(n - i, wide));
    blocks_[first + count - 1].ids[0] |= TriangleBlock::last_bit;
    return count;
  }

  // Throws where a leaf lists a triangle that there is not.
  void check_references() const {
    const std::uint32_t offender = offender_.load(std::memory_order_relaxed);
    if (offender == no_triangle) return;
    throw Error(ErrorCode::index_out_of_range, offender,
                "the tree lists triangle " + std::to_string(offender) + " of " +
                    std::to_string(triangles_.triangle_count) + ": it is of other triangles");
  }

 private:
  // Everything of a node but the places of its children.
  void start(const Subtree& subtree, std::uint32_t index, const Children& children) const {
    WideNode& node = nodes_[index];
    constexpr float infinity = std::numeric_limits<float>::infinity();
    for (int i = 0; i < wide; ++i) {
      const bool used = i < children.count();
      for (int a = 0; a < 3; ++a) {
        node.bounds[a][0][i] = used ? children.box(i).lo[a] : infinity;
        node.bounds[a][1][i] = used ? children.box(i).hi[a] : -infinity;
      }
      node.child[i] = Link{};
    }
    if (subtree.parent != no_parent) nodes_[subtree.parent].child[subtree.slot] = Link::node(index);
  }

  void check(std::uint32_t begin, std::uint32_t n) const {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t id = tree_.references[begin + i];
      if (id < triangles_.triangle_count) continue;
      std::uint32_t lowest = offender_.load(std::memory_order_relaxed);
      while (id < lowest &&
             !offender_.compare_exchange_weak(lowest, id, std::memory_order_relaxed)) {
      }
    }
  }

  void write(TriangleBlock& block, const std::uint32_t* ids, std::uint32_t count) const {
    fill(block, triangles_, count, [ids](std::uint32_t lane) { return ids[lane]; });
  }

  const TreeView& tree_;
  const TriangleView& triangles_;
  Shares shares_;
  WideNode* nodes_ = nullptr;
  TriangleBlock* blocks_ = nullptr;
  mutable std::atomic<std::uint32_t> offender_{no_triangle};  // the lowest
};

// Collapses the whole tree, and lays it out in two passes.
class Widening {
 public:
  Widening(const Executor& executor, const TreeView& tree, const TriangleView& triangles)
      : tree_(tree),
        threads_(executor),
        memory_(executor.memory != nullptr ? executor.memory : std::pmr::get_default_resource()),
        layout_(tree, triangles),
        root_{{tree.root(), 0, tree.leaf_count()}, no_parent, 0} {}

  WideTree run() {
    // 256 subtrees of equal size, or fewer that are worth a thread's while.
    tasks_.largest = std::max<std::uint32_t>(1024, tree_.leaf_count() / 256);
    if (tree_.leaf_count() > tasks_.largest) tasks_.capacity = Tasks::most;
    std::uint32_t* shares = nullptr;
    const auto take_workspace = [&](core::Arena arena) {
      shares = arena.take<std::uint32_t>(tree_.node_count());
      tasks_.data = arena.take<Task>(tasks_.capacity);
      branches_ = arena.take<Branch>(tasks_.capacity);
      return arena.used();
    };
    const core::HostBlock workspace(memory_, take_workspace(core::Arena()));
    take_workspace(core::Arena(workspace.data()));

    collapse(Shares(shares));
    Place end = lay_out_top();
    for_each_task([this](Task& task) { layout_.lay_out(task.subtree, task.place, nullptr); });
    layout_.check_references();
    for (std::uint32_t i = 0; i < tasks_.count; ++i) {
      const Place counts = tasks_.data[i].place;
      tasks_.data[i].place = end;
      end = {end.node + counts.node, end.block + counts.block};
    }

    TreeHeader* header = nullptr;
    WideNode* nodes = nullptr;
    TriangleBlock* blocks = nullptr;
    const auto take = [&](core::Arena arena) {
      header = arena.take<TreeHeader>(1);
      nodes = arena.take<WideNode>(end.node);
      blocks = arena.take<TriangleBlock>(end.block);
      return arena.used();
    };
    core::HostBlock block(memory_, take(core::Arena()));
    take(core::Arena(block.data()));
    *header = *tree_.header;
    header->root = is_one_leaf() ? Link::leaf(0) : Link::node(0);

    layout_.write_to(nodes, blocks);
    tasks_.placed = true;
    lay_out_top();
    for_each_task([this](Task& task) { layout_.lay_out(task.subtree, task.place, nullptr); });
    return TreeFormAssembler::assemble(WideTreeView{header, nodes, blocks, end.node, end.block},
                                       block);
  }

 private:
  [[nodiscard]] bool is_one_leaf() const { return is_leaf(tree_, root_.part); }

  // Branches first, each by one thread, then what is above them. The top is gone through twice, in
  // the same order: to name the branches (what is written of it then means nothing), and with what
  // they have come to. Branches beyond the most there is room for are left to the top.
  void collapse(const Shares& shares) {
    layout_.collapse_by(shares);
    if (is_one_leaf()) return;
    const Collapse collapse(tree_, shares);
    const auto none = [](const Part&, double, Surfaces&) { return false; };
    std::uint32_t count = 0;
    const auto is_branch = [&](const Part& part) {
      return count < tasks_.capacity && part.end - part.begin <= tasks_.largest;
    };
    const auto name = [&](const Part& part, double area, Surfaces&) {
      if (!is_branch(part)) return false;
      branches_[count++] = {part, area, {}};
      return true;
    };
    const auto solved = [&](const Part& part, double, Surfaces& surfaces) {
      if (!is_branch(part)) return false;
      surfaces = branches_[count++].surfaces;
      return true;
    };
    if (tasks_.capacity > 0) collapse.solve(root_.part, 0.0, name);
    threads_.share(count, 1, [this, &collapse, none](Range range) {
      for (std::uint32_t i = range.begin; i < range.end; ++i) {
        Branch& branch = branches_[i];
        branch.surfaces = collapse.solve(branch.part, branch.area, none);
      }
    });
    count = 0;
    collapse.solve(root_.part, 0.0, solved);
  }

  // Names the tasks on the way.
  Place lay_out_top() {
    Place end;
    tasks_.count = 0;
    if (is_one_leaf())
      end.block = layout_.leaf(root_.part, 0);
    else
      layout_.lay_out(root_, end, &tasks_);
    return end;
  }

  template <class Work>
  void for_each_task(Work work) {
    threads_.share(tasks_.count, 1, [this, work](Range range) {
      for (std::uint32_t i = range.begin; i < range.end; ++i) work(tasks_.data[i]);
    });
  }

  TreeView tree_;
  Threads threads_;
  std::pmr::memory_resource* memory_;
  Layout layout_;
  Subtree root_;
  Tasks tasks_;
  Branch* branches_ = nullptr;
};

}  // namespace

WideTree widen(const Executor& executor, const TreeView& tree, const TriangleView& triangles) {
  core::check_view(triangles);
  check_executor(executor);
  if (tree.reference_count() == 0) return {};
  const FloatEnvironment environment;  // for what is done by this thread alone
  return Widening(executor, tree, triangles).run();
}

}  // namespace zkd::cpu
