// SPDX-License-Identifier: Apache-2.0
//
// Rays through trees of Builder::sah: every answer is that of a loop over all triangles.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/rays.hpp"

namespace zkd {
namespace {

constexpr Intersector intersectors[] = {Intersector::watertight, Intersector::fast,
                                        Intersector::single_precision,
                                        Intersector::double_precision, Intersector::exact};

BuildOptions options_for(std::uint64_t seed) {
  BuildOptions options;
  options.builder = Builder::sah;
  options.invalid_triangles = InvalidTriangles::skip;
  options.sah.areas = seed % 3 == 1 ? SahAreas::cells : SahAreas::tight;
  options.sah.test_cost = seed % 2 == 0 ? 1.0F : 8.0F;
  return options;
}

void expect_same_answers(const Tree& tree, const scene::Mesh& mesh, const std::vector<Ray>& rays,
                         Intersector intersector) {
  const std::vector<Hit> want =
      test::brute_force(tree.view(), mesh.view(), rays, {.threads = 1}, intersector);
  for (const auto set : {cpu::InstructionSet::portable, cpu::InstructionSet::avx2}) {
    const cpu::Executor executor{.threads = 1, .instructions = set};
    const std::vector<Hit> hits =
        test::closest(tree.view(), mesh.view(), rays, executor, intersector);
    std::vector<std::uint8_t> occluded(rays.size());
    any_hit(executor, tree.view(), mesh.view(), rays, occluded, {}, intersector);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_TRUE(test::same_bits(hits[i], want[i]))
          << to_string(intersector) << ", ray " << i << " " << test::print(rays[i]) << ": "
          << test::print(hits[i]) << " instead of " << test::print(want[i]);
      ASSERT_EQ(occluded[i], test::is_hit(want[i]) ? 1 : 0)
          << to_string(intersector) << ", any hit, ray " << i << " " << test::print(rays[i]);
    }
  }
}

class SahQuery : public testing::TestWithParam<test::MeshKind> {};

TEST_P(SahQuery, EveryAnswerIsThatOfBruteForce) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    SCOPED_TRACE(m.name + ", seed " + std::to_string(seed));
    const Tree tree = build(cpu::Executor{}, m.mesh.view(), options_for(seed));
    // Random bits make large trees, and rays that meet most of their leaves.
    const std::uint32_t count = tree.view().reference_count() < 50000 ? 720 : 72;
    const std::vector<Ray> rays = scene::hard_rays(m.mesh, tree.view(), count, seed);
    for (const Intersector intersector : intersectors) {
      if (intersector != Intersector::watertight && seed % 5 != 0) continue;
      expect_same_answers(tree, m.mesh, rays, intersector);
      if (HasFatalFailure()) return;
    }
  }
}

TEST_P(SahQuery, EndsOfTheIntervalAtTheHit) {
  const test::NamedMesh m = test::small_mesh(GetParam().number, 50);
  const Tree tree = build(cpu::Executor{}, m.mesh.view(), options_for(50));
  const std::vector<Ray> whole = scene::hard_rays(m.mesh, tree.view(), 360, 50);
  const std::vector<Hit> hits = test::closest(tree.view(), m.mesh.view(), whole);
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (!test::is_hit(hits[i])) continue;
    for (int step = -1; step <= 1; ++step) {
      rays.push_back(whole[i]);
      rays.back().t_min = test::ulps(hits[i].t, step);
      rays.push_back(whole[i]);
      rays.back().t_max = test::ulps(hits[i].t, step);
    }
  }
  expect_same_answers(tree, m.mesh, rays, Intersector::watertight);
}

INSTANTIATE_TEST_SUITE_P(Every, SahQuery, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

// No ray leaves a closed mesh.
TEST(SahQuery, Watertight) {
  const scene::Mesh mesh = scene::sphere(5);
  BuildOptions options;
  options.builder = Builder::sah;
  const Tree tree = build(cpu::Executor{}, mesh.view(), options);
  test::RayMaker maker(mesh, tree.view(), 11);
  std::vector<Ray> rays;
  for (int i = 0; i < 40000; ++i)
    rays.push_back(
        scene::ray_between(0.3F * maker.inside(), i % 2 == 0 ? maker.vertex() : maker.on_edge()));
  for (const Hit& hit : test::closest(tree.view(), mesh.view(), rays))
    ASSERT_TRUE(test::is_hit(hit));
}

}  // namespace
}  // namespace zkd
