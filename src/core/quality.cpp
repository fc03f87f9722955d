// SPDX-License-Identifier: Apache-2.0
//
// BuildOptions::measure_quality.
#include "core/quality.hpp"

#include <zkd/tree_statistics.hpp>

namespace zkd::core {

void measure_quality(const TreeView& tree, Statistics& statistics) noexcept {
  const TreeStatistics measured = measure_tree(tree);
  statistics.depth = measured.depth;
  statistics.largest_leaf = measured.largest_leaf;
  statistics.sah_cost = measured.sah_cost();
}

}  // namespace zkd::core
