// SPDX-License-Identifier: Apache-2.0
//
// strip_boxes(). A subtree of n leaves has 2 n - 1 nodes, so the place of each is known on the way
// down: the top of the tree is cut into subtrees by the number of leaves alone, and each is written
// by one thread.
#include <zkd/cpu/plane_tree.hpp>

#include <algorithm>
#include <bit>
#include <string>

#include <zkd/error.hpp>

#include "core/arena.hpp"
#include "core/host_block.hpp"
#include "core/rounding.hpp"
#include "cpu/threads.hpp"
#include "cpu/tree_form.hpp"

namespace zkd::cpu {
namespace {

// The node or leaf at `link`, over the leaves from `begin` to `end`, and its place.
struct Subtree {
  Link link;
  std::uint32_t begin;
  std::uint32_t end;
  std::uint32_t place;
};

class Stripping {
 public:
  Stripping(const Executor& executor, const TreeView& tree)
      : tree_(tree),
        threads_(executor),
        memory_(executor.memory != nullptr ? executor.memory : std::pmr::get_default_resource()) {}

  PlaneTree run() {
    check_counts();
    const std::uint32_t leaves = tree_.leaf_count();
    TreeHeader* header = nullptr;
    std::uint32_t* references = nullptr;
    const auto take = [&](core::Arena arena) {
      header = arena.take<TreeHeader>(1);
      nodes_ = arena.take<PlaneNode>(std::size_t{2} * leaves - 1);
      references = arena.take<std::uint32_t>(tree_.reference_count());
      return arena.used();
    };
    core::HostBlock block(memory_, take(core::Arena()));
    take(core::Arena(block.data()));
    *header = *tree_.header;
    write_nodes();
    threads_.share(tree_.reference_count(), grain, [this, references](Range range) {
      std::copy(tree_.references + range.begin, tree_.references + range.end,
                references + range.begin);
    });
    const Box bounds = core::in_tree_space(tree_.bounds(), static_cast<double>(tree_.scale()));
    return TreeFormAssembler::assemble(PlaneTreeView{header, nodes_, references, bounds}, block);
  }

 private:
  void check_counts() const {
    const std::uint32_t leaves = tree_.leaf_count();
    if (leaves > PlaneNode::most / 2 + 1)
      throw Error(ErrorCode::too_many_references, leaves,
                  "the tree has " + std::to_string(leaves) + " leaves; a plane tree has at most " +
                      std::to_string(PlaneNode::most / 2 + 1));
    if (tree_.reference_count() <= PlaneNode::most) return;
    for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
      const std::uint32_t count = references_of(leaf);
      if (count > PlaneNode::most)
        throw Error(ErrorCode::too_many_references, count,
                    "leaf " + std::to_string(leaf) + " lists " + std::to_string(count) +
                        " triangles; of a plane tree one lists at most " +
                        std::to_string(PlaneNode::most));
    }
  }

  [[nodiscard]] std::uint32_t references_of(std::uint32_t leaf) const {
    return tree_.leaf_offsets[leaf + 1] - tree_.leaf_offsets[leaf];
  }

  void write_nodes() {
    const Subtree all{tree_.root(), 0, tree_.leaf_count(), 0};
    // 256 shares of equal size, or fewer that are worth a thread's while: a path meets few subtrees
    // that are larger, and none is longer than max_depth.
    const std::uint32_t largest = std::max<std::uint32_t>(1024, tree_.leaf_count() / 256);
    const core::HostBlock workspace(
        memory_, tree_.leaf_count() > largest ? most_tasks * sizeof(Subtree) : 0);
    auto* const tasks = static_cast<Subtree*>(workspace.data());
    std::uint32_t count = 0;
    write(all, [&](const Subtree& below) {
      if (tasks == nullptr || below.end - below.begin > largest || count == most_tasks)
        return false;
      tasks[count++] = below;
      return true;
    });
    threads_.share(count, 1, [this, tasks](Range range) {
      for (std::uint32_t i = range.begin; i < range.end; ++i)
        write(tasks[i], [](const Subtree&) { return false; });
    });
  }

  // Writes a subtree, but for those below that `take` takes.
  template <class Take>
  void write(const Subtree& top, Take take) const {
    Subtree waiting[max_depth];
    std::uint32_t count = 0;
    Subtree subtree = top;
    for (;;) {
      PlaneNode& to = nodes_[subtree.place];
      if (subtree.link.is_leaf()) {
        const std::uint32_t leaf = subtree.link.index();
        to = {tree_.leaf_offsets[leaf], references_of(leaf) << 2 | PlaneNode::leaf};
      } else {
        const std::uint32_t index = subtree.link.index();
        const Node& node = tree_.nodes[index];
        const std::uint32_t middle = index + 1;
        const Subtree above{node.child[1], middle, subtree.end,
                            subtree.place + 2 * (middle - subtree.begin)};
        const Subtree below{node.child[0], subtree.begin, middle, subtree.place + 1};
        to = {std::bit_cast<std::uint32_t>(node.plane), above.place << 2 | node.axis};
        if (!take(above)) waiting[count++] = above;
        if (!take(below)) {
          subtree = below;
          continue;
        }
      }
      if (count == 0) return;
      subtree = waiting[--count];
    }
  }

  static constexpr std::uint32_t most_tasks = 32768;

  TreeView tree_;
  Threads threads_;
  std::pmr::memory_resource* memory_;
  PlaneNode* nodes_ = nullptr;
};

}  // namespace

PlaneTree strip_boxes(const Executor& executor, const Tree& tree) {
  check_executor(executor);
  if (tree.view().reference_count() == 0) return {};
  if (tree.options().references != References::all)
    throw Error(ErrorCode::unsupported_option, 0,
                std::string("strip_boxes is for strict trees, of References::all, Builder::sah or "
                            "wu2011; this one is of References::") +
                    to_string(tree.options().references));
  return Stripping(executor, tree.view()).run();
}

}  // namespace zkd::cpu
