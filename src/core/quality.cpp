// SPDX-License-Identifier: Apache-2.0
//
// One walk over a finished tree that adds up the terms of its SAH cost.
#include "core/quality.hpp"

#include <algorithm>

#include "core/key.hpp"

namespace zkd::core {
namespace {

double half_area(const float (&lo)[3], const float (&hi)[3]) {
  double side[3];
  for (int a = 0; a < 3; ++a) {
    side[a] = static_cast<double>(hi[a]) - static_cast<double>(lo[a]);
    if (!(side[a] >= 0.0)) return 0.0;  // an empty leaf
  }
  return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

}  // namespace

void measure_quality(const TreeView& tree, Statistics& statistics) noexcept {
  statistics.depth = 0;
  statistics.largest_leaf = 0;
  statistics.sah_cost = 0.0;
  if (tree.empty()) return;

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
  double cost = 0.0;
  while (waiting > 0) {
    const Waiting at = stack[--waiting];
    if (at.link.is_leaf()) {
      const std::uint64_t references =
          tree.leaf_offsets[at.link.index() + 1] - tree.leaf_offsets[at.link.index()];
      statistics.depth = std::max(statistics.depth, at.depth);
      statistics.largest_leaf = std::max(statistics.largest_leaf, references);
      cost += at.area * static_cast<double>(references);
      continue;
    }
    cost += at.area;
    const Node& node = tree.nodes[at.link.index()];
    for (int child = 0; child < 2; ++child) {
      for (int a = 0; a < 3; ++a) {
        lo[a] = node.lo(child, a);
        hi[a] = node.hi(child, a);
      }
      stack[waiting++] = {node.child[child], at.depth + 1, half_area(lo, hi)};
    }
  }
  statistics.sah_cost = whole > 0.0 ? cost / whole : 0.0;
}

}  // namespace zkd::core
