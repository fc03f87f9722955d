// SPDX-License-Identifier: Apache-2.0
//
// measure_tree against counts made another way, and on trees made by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include <zkd/build.hpp>
#include <zkd/tree_statistics.hpp>

#include "scene/generate.hpp"
#include "support/meshes.hpp"

namespace zkd {
namespace {

TEST(TreeStatistics, BinsOfSizesFollowEachOther) {
  EXPECT_EQ(LeafSizeBins::first(0), 0u);
  for (std::size_t bin = 0; bin < LeafSizeBins::count; ++bin) {
    EXPECT_LE(LeafSizeBins::first(bin), LeafSizeBins::last(bin));
    EXPECT_EQ(LeafSizeBins::of(LeafSizeBins::first(bin)), bin);
    EXPECT_EQ(LeafSizeBins::of(LeafSizeBins::last(bin)), bin);
    if (bin > 0) {
      EXPECT_EQ(LeafSizeBins::first(bin), LeafSizeBins::last(bin - 1) + 1);
    }
  }
  EXPECT_EQ(LeafSizeBins::of(max_count), LeafSizeBins::count - 1);
}

TEST(TreeStatistics, OfNothing) {
  const TreeStatistics s = measure_tree(TreeView{});
  EXPECT_EQ(s.leaves, 0u);
  EXPECT_EQ(s.sah_cost(), 0.0);
  EXPECT_EQ(s.mean_leaf, 0.0);
}

TEST(TreeStatistics, OfATreeMadeByHand) {
  // A box of 4 x 2 x 2 whose halves are 1 x 2 x 2, with three triangles, and 2 x 2 x 2, with none.
  Node node{};
  const float lo[2][3] = {{0, 0, 0}, {2, 0, 0}};
  const float hi[2][3] = {{1, 2, 2}, {4, 2, 2}};
  for (int child = 0; child < 2; ++child) {
    for (int a = 0; a < 3; ++a) {
      node.bounds[a][child] = lo[child][a];
      node.bounds[a][2 + child] = hi[child][a];
    }
    node.child[child] = Link::leaf(static_cast<std::uint32_t>(child));
  }
  const std::uint32_t offsets[] = {0, 3, 3};
  const std::uint32_t references[] = {0, 1, 2};
  TreeHeader header;
  header.bounds = {{0, 0, 0}, {4, 2, 2}};
  header.root = Link::node(0);
  header.leaf_count = 2;
  header.reference_count = 3;
  const TreeStatistics s = measure_tree({&header, &node, offsets, references});

  EXPECT_EQ(s.nodes, 1u);
  EXPECT_EQ(s.leaves, 2u);
  EXPECT_EQ(s.empty_leaves, 1u);
  EXPECT_EQ(s.references, 3u);
  EXPECT_EQ(s.largest_leaf, 3u);
  EXPECT_EQ(s.mean_leaf, 3.0);
  EXPECT_EQ(s.depth, 1u);
  EXPECT_EQ(s.mean_depth, 1.0);
  EXPECT_EQ(s.leaves_at_depth[1], 2u);
  EXPECT_EQ(s.leaves_of_size[0], 1u);
  EXPECT_EQ(s.leaves_of_size[3], 1u);
  // Half areas: 20 the whole, 8 the half with triangles.
  EXPECT_EQ(s.expected_node_visits, 1.0);
  EXPECT_EQ(s.expected_leaf_visits, 0.4);
  EXPECT_DOUBLE_EQ(s.expected_triangle_tests, 1.2);
  EXPECT_DOUBLE_EQ(s.sah_cost(), 2.2);
  EXPECT_DOUBLE_EQ(s.sah_cost(2.0, 0.5), 2.6);
}

TEST(TreeStatistics, HistogramsAddUp) {
  for (const References references : {References::once, References::all}) {
    for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
      const test::NamedMesh m = test::small_mesh(kind, 5);
      SCOPED_TRACE(m.name + ", " + to_string(references));
      BuildOptions options;
      options.references = references;
      options.invalid_triangles = InvalidTriangles::skip;
      options.measure_quality = true;
      const Tree tree = build(cpu::Executor{}, m.mesh.view(), options);
      const TreeStatistics s = measure_tree(tree.view());
      EXPECT_EQ(s.nodes, tree.statistics().nodes);
      EXPECT_EQ(s.leaves, tree.statistics().leaves);
      EXPECT_EQ(s.references, tree.statistics().references);
      EXPECT_EQ(s.largest_leaf, tree.statistics().largest_leaf);
      EXPECT_EQ(s.depth, tree.statistics().depth);
      EXPECT_EQ(s.sah_cost(), tree.statistics().sah_cost);
      const auto sum = [](const auto& bins) {
        return std::accumulate(bins.begin(), bins.end(), std::uint64_t{0});
      };
      EXPECT_EQ(sum(s.leaves_at_depth), s.leaves);
      EXPECT_EQ(sum(s.leaves_of_size), s.leaves);
      std::vector<std::uint64_t> of_size(LeafSizeBins::count, 0);
      for (std::uint32_t leaf = 0; leaf < tree.view().leaf_count(); ++leaf) {
        ++of_size[LeafSizeBins::of(tree.leaf(leaf).size())];
      }
      EXPECT_TRUE(std::equal(of_size.begin(), of_size.end(), s.leaves_of_size.begin()));
      if (s.leaves == 0) continue;
      EXPECT_GT(s.leaves_at_depth[s.depth], 0u);
      EXPECT_LE(s.mean_depth, s.depth);
    }
  }
}

}  // namespace
}  // namespace zkd
