// SPDX-License-Identifier: Apache-2.0
//
// The walk as kernels take it, with the box test of zkd/cuda/device.hpp, run on the host against a
// loop over all triangles: no box leaves out what is hit.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include <zkd/cuda/device.hpp>
#include <zkd/zkd.hpp>

#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/rays.hpp"

namespace zkd {
namespace {

using test::print;
using test::same_bits;

class QueryDeviceBox : public testing::TestWithParam<test::MeshKind> {};

TEST_P(QueryDeviceBox, LeavesOutNoHit) {
  std::uint64_t node_visits = 0;
  std::uint64_t plain_node_visits = 0;
  for (std::uint64_t seed = 100; seed < 106; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    const TriangleView triangles = m.mesh.view();
    for (const References references : {References::once, References::all}) {
      BuildOptions options;
      options.references = references;
      options.leaf_size = seed % 2 == 0 ? 1 : 4;
      options.invalid_triangles = InvalidTriangles::skip;
      const Tree tree = build(triangles, options);
      const std::vector<Ray> rays = test::RayMaker(m.mesh, tree.view(), seed).all_kinds(720);
      const std::vector<Hit> want = test::brute_force(tree.view(), triangles, rays);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        TraversalCost cost;
        const core::Candidate closest = core::trace<false, core::FusedBoxTest, core::Watertight>(
            tree.view(), triangles, rays[i], &cost);
        const core::Candidate any = core::trace<true, core::FusedBoxTest, core::Watertight>(
            tree.view(), triangles, rays[i], nullptr);
        const Hit hit = core::to_hit(closest);
        ASSERT_TRUE(same_bits(hit, want[i]))
            << "seed " << seed << ", " << to_string(references) << ", ray " << i << " "
            << print(rays[i]) << ": " << print(hit) << " instead of " << print(want[i]);
        ASSERT_EQ(any.found(), test::is_hit(want[i])) << "any hit, ray " << print(rays[i]);
        node_visits += cost.node_visits;
        (void)core::trace<false, core::BoxTest, core::Watertight>(tree.view(), triangles, rays[i],
                                                                  &cost);
        plain_node_visits += cost.node_visits;
      }
    }
  }
  // And it leaves out as much as the other one, but for rounding.
  EXPECT_LE(node_visits, plain_node_visits + plain_node_visits / 100);
}

INSTANTIATE_TEST_SUITE_P(Every, QueryDeviceBox, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

}  // namespace
}  // namespace zkd
