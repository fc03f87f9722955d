// SPDX-License-Identifier: Apache-2.0
//
// What a finished tree looks like: counts, histograms, and what rays are expected to cost in it.
// Statistics (zkd/statistics.hpp) is about the build; this is about the tree, whoever built it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <zkd/config.hpp>
#include <zkd/tree.hpp>

namespace zkd {

/// Bins of TreeStatistics::leaves_of_size: one for each size from 0 to 8, then one for each
/// doubling: 9 to 16, 17 to 32, ...
struct LeafSizeBins {
  static constexpr std::size_t single = 9;
  static constexpr std::size_t count = 37;  ///< the last ends at 2^31

  /// The bin of leaves that list `references` triangles.
  [[nodiscard]] static constexpr std::size_t of(std::uint64_t references) {
    if (references < single) return static_cast<std::size_t>(references);
    std::size_t bin = single;
    while (references > last(bin)) ++bin;
    return bin;
  }
  /// The sizes that fall into a bin, both ends included.
  [[nodiscard]] static constexpr std::uint64_t first(std::size_t bin) {
    return bin < single ? bin : last(bin - 1) + 1;
  }
  [[nodiscard]] static constexpr std::uint64_t last(std::size_t bin) {
    return bin < single ? bin : std::uint64_t{8} << (bin - single + 1);
  }
};

/// Expected counts are those of a random line that meets the box of the scene: sums of area(box) /
/// area(box of the scene) over tight boxes (MacDonald and Booth, Heuristics for Ray Tracing using
/// Space Subdivision, 1990). Lines do not stop at hits, so real rays cost less.
struct TreeStatistics {
  std::uint64_t nodes = 0;  ///< inner nodes
  std::uint64_t leaves = 0;
  std::uint64_t empty_leaves = 0;  ///< leaves that list nothing (Builder::sah and wu2011 have them)
  std::uint64_t references = 0;
  std::uint64_t largest_leaf = 0;  ///< references
  double mean_leaf = 0.0;          ///< references in a leaf that lists something

  std::uint32_t depth = 0;  ///< edges from the root to the deepest leaf; 0 for a single leaf
  double mean_depth = 0.0;  ///< of leaves
  std::array<std::uint64_t, max_depth + 1> leaves_at_depth{};
  std::array<std::uint64_t, LeafSizeBins::count> leaves_of_size{};

  double expected_node_visits = 0.0;
  double expected_leaf_visits = 0.0;  ///< of leaves that list something
  double expected_triangle_tests = 0.0;

  /// Cost of a random line: expected node visits times `visit_cost` and triangle tests times
  /// `test_cost`. With 1 and 1 Statistics::sah_cost.
  [[nodiscard]] double sah_cost(double visit_cost = 1.0, double test_cost = 1.0) const {
    return visit_cost * expected_node_visits + test_cost * expected_triangle_tests;
  }
};

/// Looks at every node once, on the calling thread; allocates nothing. `tree` is in host memory,
/// and of any builder. O(nodes).
[[nodiscard]] ZKD_API TreeStatistics measure_tree(const TreeView& tree) noexcept;

}  // namespace zkd
