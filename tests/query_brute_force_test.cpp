// SPDX-License-Identifier: Apache-2.0
//
// The tree never changes an answer: every query against a loop over all triangles, bit for bit, on
// many small meshes and every kind of ray.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/rays.hpp"

namespace zkd {
namespace {

using test::or_miss;
using test::print;
using test::same_bits;

struct Count {
  std::uint64_t rays = 0;
  std::uint64_t hits = 0;
};

// Every form of a query, where the tree is and in host memory, against brute force there.
void expect_same_answers(const test::PlatformTree& tree, const TriangleView& triangles,
                         const std::vector<Ray>& rays, Count& count,
                         Intersector intersector = Intersector::watertight) {
  SCOPED_TRACE(to_string(intersector));
  const TreeView& on_host = tree.host().view();
  std::vector<Hit> want(rays.size());
  closest_hit_brute_force(
      cpu::Executor{.threads = 1, .instructions = cpu::InstructionSet::portable}, on_host,
      triangles, rays, want, intersector);
  count.rays += rays.size();
  for (const test::Walk walk : test::walks()) {
    const std::vector<Hit> loop = tree.brute_force_hits(rays, walk, intersector);
    std::vector<TraversalCost> costs;
    const std::vector<Hit> hits = tree.closest_hits(rays, walk, &costs, intersector);
    const std::vector<std::uint8_t> occluded = tree.any_hits(rays, walk, intersector);
    const char* name = test::name(walk);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_TRUE(same_bits(loop[i], want[i]))
          << "brute force itself, " << name << ", ray " << i << " " << print(rays[i]) << ": "
          << print(loop[i]) << " instead of " << print(want[i]);
      ASSERT_TRUE(same_bits(hits[i], want[i]))
          << name << ", ray " << i << " " << print(rays[i]) << ": " << print(hits[i])
          << " instead of " << print(want[i]);
      ASSERT_EQ(occluded[i], test::is_hit(want[i]) ? 1 : 0)
          << name << ", any hit, ray " << i << " " << print(rays[i]);
      ASSERT_TRUE(!test::is_hit(want[i]) || costs[i].triangle_tests > 0);
    }
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit hit = or_miss(closest_hit(on_host, triangles, rays[i], intersector));
    ASSERT_TRUE(same_bits(hit, want[i])) << "single ray " << i << " " << print(rays[i]) << ": "
                                         << print(hit) << " instead of " << print(want[i]);
    ASSERT_EQ(any_hit(on_host, triangles, rays[i], intersector), test::is_hit(want[i]))
        << "single any hit, ray " << i << " " << print(rays[i]);
    count.hits += test::is_hit(want[i]) ? 1 : 0;
  }
}

BuildOptions options_for(References references, std::uint64_t seed) {
  BuildOptions options;
  options.references = references;
  options.quality = seed % 2 == 1 ? Quality::balanced : Quality::fast;
  options.budget = 1.0F + 0.5F * static_cast<float>(seed % 5);
  options.leaf_size = seed % 3 == 0 ? 1 : seed % 3 == 1 ? 4 : 9;
  options.code_bits = seed % 4 == 0 ? 64 : seed % 4 == 1 ? 12 : 0;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

class QueryBruteForce : public testing::TestWithParam<test::MeshKind> {};

TEST_P(QueryBruteForce, EveryAnswerIsTheSame) {
  Count count;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    for (const References references : {References::once, References::budget, References::all}) {
      SCOPED_TRACE(m.name + ", seed " + std::to_string(seed) + ", " + to_string(references));
      const test::PlatformTree tree(m.mesh.view(), options_for(references, seed));
      test::RayMaker maker(m.mesh, tree.host().view(), seed);
      std::vector<Ray> rays = maker.all_kinds(360);
      for (const std::vector<Ray>& more :
           {scene::random_rays(tree.host().view().bounds(), 60, seed),
            scene::rays_at_features(m.mesh, 60, seed), scene::axis_rays(m.mesh, 60, seed)}) {
        rays.insert(rays.end(), more.begin(), more.end());
      }
      for (const Intersector intersector : test::intersectors()) {
        // The one that most will use has the most tries.
        if (seed != 0 && intersector != Intersector::watertight) continue;
        expect_same_answers(tree, m.mesh.view(), rays, count, intersector);
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  }
  RecordProperty("rays", std::to_string(count.rays));
  RecordProperty("hits", std::to_string(count.hits));
}

// Rays whose ends are at a hit exactly, or an ulp beside it.
TEST_P(QueryBruteForce, EndsOfTheIntervalAtTheHit) {
  Count count;
  const test::NamedMesh m = test::small_mesh(GetParam().number, 50);
  for (const References references : {References::once, References::budget, References::all}) {
    SCOPED_TRACE(m.name + ", " + to_string(references));
    const test::PlatformTree tree(m.mesh.view(), options_for(references, 50));
    const std::vector<Ray> whole = test::RayMaker(m.mesh, tree.host().view(), 50).all_kinds(400);
    const std::vector<Hit> hits = tree.closest_hits(whole);
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      if (!test::is_hit(hits[i])) continue;
      Ray ray = whole[i];
      for (int end = 0; end < 2; ++end) {
        for (int step = -1; step <= 1; ++step) {
          Ray cut = ray;
          (end == 0 ? cut.t_min : cut.t_max) = test::ulps(hits[i].t, step);
          rays.push_back(cut);
        }
      }
      ray.t_min = ray.t_max = hits[i].t;
      rays.push_back(ray);
    }
    expect_same_answers(tree, m.mesh.view(), rays, count);
    if (testing::Test::HasFatalFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(Every, QueryBruteForce, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

TEST(QueryBruteForce, LargerScenes) {
  Count count;
  for (const References references : {References::once, References::budget, References::all}) {
    for (const scene::Mesh& mesh : {scene::soup(5000, 60), scene::sphere(4), scene::grid(7),
                                    scene::small_in_large(3000, 1e6F, 60), scene::fan(5000)}) {
      const test::PlatformTree tree(mesh.view(), {.references = references});
      expect_same_answers(tree, mesh.view(),
                          test::RayMaker(mesh, tree.host().view(), 61).all_kinds(480), count);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
  EXPECT_GT(count.hits, count.rays / 4) << "the rays miss too often to say much";
}

}  // namespace
}  // namespace zkd
