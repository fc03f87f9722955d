// SPDX-License-Identifier: Apache-2.0
//
// The stages one after the other, called as anybody may call them, give the bytes of a build, with
// every option.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/composition.hpp"
#include "support/meshes.hpp"
#include "support/platform.hpp"
#include "support/platform_tree.hpp"

namespace zkd {
namespace {

void expect_equals_composition(const TriangleView& triangles, const BuildOptions& options) {
  const test::Composition want = test::compose(test::executor(2), triangles, options);
  const Tree tree = test::build(triangles, options);
  const TreeView& view = tree.view();
  ASSERT_EQ(view.leaf_count() + std::size_t{1}, want.leaf_offsets.size());
  EXPECT_TRUE(view.root() == want.root);
  EXPECT_EQ(tree.statistics().crowded_trunks, want.crowded);
  for (std::uint32_t leaf = 0; leaf <= view.leaf_count(); ++leaf) {
    ASSERT_EQ(view.leaf_offsets[leaf], want.leaf_offsets[leaf]) << "leaf " << leaf;
    if (options.references == References::once) {
      ASSERT_EQ(view.leaf_offsets[leaf],
                leaf < view.leaf_count() ? want.first[leaf] : view.reference_count())
          << "leaf " << leaf;
    }
  }
  ASSERT_EQ(view.reference_count(), want.references.size());
  for (std::uint32_t i = 0; i < view.reference_count(); ++i) {
    ASSERT_EQ(view.references[i], want.references[i]) << "reference " << i;
  }
  for (std::uint32_t j = 0; j < view.node_count(); ++j) {
    ASSERT_EQ(std::memcmp(&view.nodes[j], &want.nodes[j], sizeof(Node)), 0) << "node " << j;
  }
  // What is said of trunks holds of the leaves of `all` where none of these is crowded.
  const bool of_trunks = view.leaf_count() == want.first.size();
  ASSERT_TRUE(of_trunks || options.references == References::all);
  for (std::uint32_t j = 0; of_trunks && j < view.node_count(); ++j) {
    const Node& node = view.nodes[j];
    ASSERT_TRUE(node.child[0] == want.children[2 * j]) << "node " << j;
    ASSERT_TRUE(node.child[1] == want.children[2 * j + 1]) << "node " << j;
    ASSERT_EQ(node.axis, want.axes[j]) << "node " << j;
    ASSERT_EQ(node.plane, want.planes[j] * view.scale()) << "node " << j;
  }
  EXPECT_EQ(tree.lattice().code_bits, want.lattice.code_bits);
  EXPECT_TRUE(std::equal(want.lattice.axis, want.lattice.axis + 64, tree.lattice().axis));
  EXPECT_EQ(view.bounds().empty(), want.bounds.empty());
  if (want.bounds.empty()) return;
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(view.bounds().lo[a], want.bounds.lo[a]);
    EXPECT_EQ(view.bounds().hi[a], want.bounds.hi[a]);
    EXPECT_EQ(tree.lattice().exponent[a], want.lattice.exponent[a]);
    EXPECT_EQ(tree.lattice().origin[a], want.lattice.origin[a]);
    EXPECT_EQ(tree.lattice().bits[a], want.lattice.bits[a]);
  }
}

TEST(TreeStages, GiveTheBytesOfABuild) {
  std::uint32_t number = 0;
  for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
    const test::NamedMesh m = test::small_mesh(kind, 1);
    for (const std::uint32_t code_bits : {0u, 6u, 16u, 64u}) {
      for (const std::uint32_t leaf_size : {1u, 4u}) {
        for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
          for (const bool recode : {true, false}) {
            if (number++ % test::thinning != 0) continue;
            SCOPED_TRACE(m.name + ", " + std::to_string(code_bits) + " bits, leaf size " +
                         std::to_string(leaf_size) + ", " + to_string(order) +
                         (recode ? "" : ", not coded again"));
            const References policies[] = {number % 3 != 0 ? References::once : References::budget,
                                           References::all};
            for (const References references : policies)
              expect_equals_composition(m.mesh.view(),
                                        {.references = references,
                                         .leaf_size = leaf_size,
                                         .code_bits = code_bits,
                                         .axis_order = order,
                                         .recode_crowded = recode,
                                         .invalid_triangles = InvalidTriangles::skip});
            if (testing::Test::HasFailure()) return;
          }
        }
      }
    }
  }
}

// Crowds of some ten to 20,000 triangles each: the CPU takes them trunk by trunk in a build, and
// sorts few, some and many in different ways.
TEST(TreeStages, GiveTheBytesOfABuildOfCrowdedScenes) {
  for (const std::uint32_t code_bits : {1u, 3u, 6u, 8u, 10u, 12u}) {
    SCOPED_TRACE(std::to_string(code_bits) + " bits");
    expect_equals_composition(scene::soup(40000, 3).view(), {.code_bits = code_bits});
    expect_equals_composition(scene::flat(3000, 1, 3).view(), {.code_bits = code_bits});
    expect_equals_composition(scene::sphere(4).view(), {.leaf_size = 1, .code_bits = code_bits});
  }
  expect_equals_composition(scene::joined(scene::identical(500), scene::identical(40)).view(), {});
}

TEST(TreeStages, GiveTheBytesOfABuildOfLargerScenes) {
  expect_equals_composition(scene::soup(50000, 2).view(), {});
  expect_equals_composition(scene::soup(50000, 2).view(), {.references = References::all});
  expect_equals_composition(scene::small_in_large(20000, 1e4F, 2).view(),
                            {.references = References::all});
  expect_equals_composition(scene::small_in_large(20000, 1e4F, 2).view(), {});
  expect_equals_composition(scene::sphere(6).view(), {.code_bits = 64});
}

}  // namespace
}  // namespace zkd
