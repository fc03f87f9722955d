// SPDX-License-Identifier: Apache-2.0
//
// One walk over a finished tree.
#include <zkd/tree_statistics.hpp>

#include <algorithm>

namespace zkd {
namespace {

double half_area(const float (&lo)[3], const float (&hi)[3]) {
  double side[3];
  for (int a = 0; a < 3; ++a) {
    side[a] = static_cast<double>(hi[a]) - static_cast<double>(lo[a]);
    if (!(side[a] >= 0.0)) return 0.0;  // an empty leaf
  }
  return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

void count_leaf(std::uint64_t references, std::uint32_t depth, double area,
                TreeStatistics& statistics) {
  ++statistics.leaves;
  ++statistics.leaves_at_depth[depth];
  ++statistics.leaves_of_size[LeafSizeBins::of(references)];
  statistics.references += references;
  statistics.largest_leaf = std::max(statistics.largest_leaf, references);
  statistics.depth = std::max(statistics.depth, depth);
  if (references == 0) {
    ++statistics.empty_leaves;
    return;
  }
  statistics.expected_leaf_visits += area;
  statistics.expected_triangle_tests += area * static_cast<double>(references);
}

// Areas to shares of the whole, sums to means.
void finish(double whole, TreeStatistics& statistics) {
  for (double* expected : {&statistics.expected_node_visits, &statistics.expected_leaf_visits,
                           &statistics.expected_triangle_tests}) {
    *expected = whole > 0.0 ? *expected / whole : 0.0;
  }
  double depths = 0.0;
  for (std::size_t depth = 0; depth < statistics.leaves_at_depth.size(); ++depth) {
    depths += static_cast<double>(depth) * static_cast<double>(statistics.leaves_at_depth[depth]);
  }
  statistics.mean_depth = depths / static_cast<double>(statistics.leaves);
  const std::uint64_t filled = statistics.leaves - statistics.empty_leaves;
  statistics.mean_leaf =
      filled > 0 ? static_cast<double>(statistics.references) / static_cast<double>(filled) : 0.0;
}

}  // namespace

TreeStatistics measure_tree(const TreeView& tree) noexcept {
  TreeStatistics statistics;
  if (tree.empty()) return statistics;

  struct Waiting {
    Link link;
    std::uint32_t depth;
    double area;
  };
  Waiting stack[max_depth + 1];
  float lo[3];
  float hi[3];
  for (int a = 0; a < 3; ++a) {
    lo[a] = tree.bounds().lo[a] * tree.scale();
    hi[a] = tree.bounds().hi[a] * tree.scale();
  }
  const double whole = half_area(lo, hi);
  int waiting = 0;
  stack[waiting++] = {tree.root(), 0, whole};
  while (waiting > 0) {
    const Waiting at = stack[--waiting];
    const std::uint32_t index = at.link.index();
    if (at.link.is_leaf()) {
      count_leaf(tree.leaf_offsets[index + 1] - tree.leaf_offsets[index], at.depth, at.area,
                 statistics);
      continue;
    }
    ++statistics.nodes;
    statistics.expected_node_visits += at.area;
    const Node& node = tree.nodes[index];
    for (int child = 0; child < 2; ++child) {
      for (int a = 0; a < 3; ++a) {
        lo[a] = node.lo(child, a);
        hi[a] = node.hi(child, a);
      }
      stack[waiting++] = {node.child[child], at.depth + 1, half_area(lo, hi)};
    }
  }
  finish(whole, statistics);
  return statistics;
}

}  // namespace zkd
