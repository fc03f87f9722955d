// SPDX-License-Identifier: Apache-2.0
//
// A tree built on either side is used on the other: the CPU's tree and the device's are the same
// bytes, and each, traced on each side, gives the same answers. For platforms that are not the CPU.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/rays.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using test::print;
using test::same_bits;

void expect_same(const std::vector<Hit>& got, const std::vector<Hit>& want,
                 const std::vector<Ray>& rays, const char* what) {
  ASSERT_EQ(got.size(), want.size());
  for (std::size_t i = 0; i < rays.size(); ++i)
    ASSERT_TRUE(same_bits(got[i], want[i]))
        << what << ", ray " << i << " " << print(rays[i]) << ": " << print(got[i]) << " instead of "
        << print(want[i]);
}

// Returns how many rays hit.
std::size_t expect_same_on_both_sides(const scene::Mesh& mesh, const BuildOptions& options,
                                      std::uint64_t seed) {
  const TriangleView triangles = mesh.view();
  const Tree on_cpu = build(cpu::Executor{.threads = 2}, triangles, options);
  const test::PlatformTree built_there(triangles, options);
  const test::PlatformTree brought_there(on_cpu, triangles);
  EXPECT_EQ(verify::tree_hash(built_there.host().view()), verify::tree_hash(on_cpu.view()));

  std::vector<Ray> rays = test::RayMaker(mesh, on_cpu.view(), seed).all_kinds(720);
  for (const std::vector<Ray>& more :
       {scene::random_rays(on_cpu.view().bounds(), 100, seed),
        scene::rays_at_features(mesh, 100, seed), scene::axis_rays(mesh, 100, seed)}) {
    rays.insert(rays.end(), more.begin(), more.end());
  }
  const std::vector<Hit> want = test::closest(on_cpu.view(), triangles, rays);
  expect_same(built_there.closest_hits(rays), want, rays, "built there, traced there");
  expect_same(brought_there.closest_hits(rays), want, rays, "built here, traced there");
  expect_same(test::closest(built_there.host().view(), triangles, rays), want, rays,
              "built there, traced here");
  expect_same(built_there.brute_force_hits(rays), want, rays, "brute force there");
  const std::vector<std::uint8_t> built_occluded = built_there.any_hits(rays);
  const std::vector<std::uint8_t> brought_occluded = brought_there.any_hits(rays);
  std::size_t hits = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const std::uint8_t hit = test::is_hit(want[i]) ? 1 : 0;
    EXPECT_EQ(built_occluded[i], hit) << print(rays[i]);
    EXPECT_EQ(brought_occluded[i], hit) << print(rays[i]);
    hits += hit;
  }
  return hits;
}

class QueryBothSides : public testing::TestWithParam<test::MeshKind> {};

TEST_P(QueryBothSides, GiveTheSameAnswers) {
  for (std::uint64_t seed = 200; seed < 204; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    for (const References references : {References::once, References::budget, References::all}) {
      SCOPED_TRACE(m.name + ", seed " + std::to_string(seed) + ", " + to_string(references));
      BuildOptions options;
      options.references = references;
      options.leaf_size = seed % 2 == 0 ? 1 : 4;
      options.invalid_triangles = InvalidTriangles::skip;
      (void)expect_same_on_both_sides(m.mesh, options, seed);
      if (testing::Test::HasFailure()) return;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, QueryBothSides, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

TEST(QueryBothSides, GiveTheSameAnswersForLargerScenes) {
  for (const References references : {References::once, References::budget, References::all}) {
    for (const scene::Mesh& mesh :
         {scene::soup(5000, 210), scene::sphere(4), scene::small_in_large(3000, 1e6F, 211)}) {
      EXPECT_GT(expect_same_on_both_sides(mesh, {.references = references}, 212), 200u)
          << "the rays miss too often to say much";
      if (testing::Test::HasFailure()) return;
    }
  }
}

// What a device says of a tree is what the CPU says of it.
TEST(QueryBothSides, KnowTheSameOfATree) {
  for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
    const test::NamedMesh m = test::small_mesh(kind, 213);
    for (const References references : {References::once, References::budget, References::all}) {
      SCOPED_TRACE(m.name + ", " + to_string(references));
      const BuildOptions options{.references = references,
                                 .invalid_triangles = InvalidTriangles::skip,
                                 .measure_quality = true};
      const Tree on_cpu = build(cpu::Executor{.threads = 2}, m.mesh.view(), options);
      const Tree there = test::build(m.mesh.view(), options);
      const Statistics& want = on_cpu.statistics();
      const Statistics& got = there.statistics();
      EXPECT_EQ(got.triangles, want.triangles);
      EXPECT_EQ(got.skipped_zero_area, want.skipped_zero_area);
      EXPECT_EQ(got.skipped_non_finite, want.skipped_non_finite);
      EXPECT_EQ(got.code_bits, want.code_bits);
      EXPECT_EQ(got.crowded_trunks, want.crowded_trunks);
      EXPECT_EQ(got.crowded_triangles, want.crowded_triangles);
      EXPECT_EQ(got.crowded_leaves, want.crowded_leaves);
      EXPECT_EQ(got.crowded_references, want.crowded_references);
      EXPECT_EQ(got.nodes, want.nodes);
      EXPECT_EQ(got.leaves, want.leaves);
      EXPECT_EQ(got.references, want.references);
      EXPECT_EQ(got.largest_leaf, want.largest_leaf);
      EXPECT_EQ(got.depth, want.depth);
      EXPECT_EQ(got.sah_cost, want.sah_cost);
      for (const Skip skip :
           {Skip::flat_axes, Skip::wide_codes, Skip::recoding, Skip::compaction, Skip::subtrees}) {
        EXPECT_EQ(got.skip(skip).taken, want.skip(skip).taken) << to_string(skip);
        EXPECT_EQ(got.skip(skip).amount, want.skip(skip).amount) << to_string(skip);
      }
      EXPECT_EQ(there.options().code_bits, on_cpu.options().code_bits);
      EXPECT_EQ(there.options().backend, test::backend());
    }
  }
}

}  // namespace
}  // namespace zkd
