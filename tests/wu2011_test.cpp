// SPDX-License-Identifier: Apache-2.0
//
// Builder::wu2011: the very tree of Builder::sah, on every platform and in every way of building.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "scene/hard_rays.hpp"
#include "support/caught.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/sah_cases.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using verify::tree_hash;

BuildOptions options_for(const SahOptions& sah = {}) {
  return test::sah_options(Builder::wu2011, sah);
}

std::string sah_hash(const scene::Mesh& mesh, const SahOptions& sah = {}) {
  return tree_hash(
      build(cpu::Executor{}, mesh.view(), test::sah_options(Builder::sah, sah)).view());
}

void expect_the_tree_of_sah(const scene::Mesh& mesh, const SahOptions& sah = {}) {
  const std::string want = sah_hash(mesh, sah);
  for (const test::WayToBuild& way : test::ways_to_build()) {
    const Tree tree = way.build(mesh.view(), options_for(sah));
    ASSERT_EQ(tree_hash(tree.view()), want)
        << way.name << ", " << to_string(sah.areas) << ", test cost " << sah.test_cost;
  }
}

std::vector<test::NamedMesh> large_meshes() {
  std::vector<test::NamedMesh> all = test::large_sah_meshes();
  all.push_back({"needles", scene::needles(1000, 5)});
  if (test::build_thinning() > 1) all.resize(2);
  return all;
}

class Wu2011 : public testing::TestWithParam<test::MeshKind> {};

// The builders share what a plane costs and how triangles are clipped, nothing else.
TEST_P(Wu2011, IsTheTreeOfSah) {
  const std::uint64_t seeds = test::build_thinning() > 1 ? 1 : 2;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed)
    for (const SahOptions& sah : test::sah_weights()) {
      const scene::Mesh mesh = test::small_mesh(GetParam().number, seed).mesh;
      ASSERT_EQ(tree_hash(test::build(mesh.view(), options_for(sah)).view()), sah_hash(mesh, sah))
          << "seed " << seed << ", " << to_string(sah.areas) << ", test cost " << sah.test_cost;
    }
}

INSTANTIATE_TEST_SUITE_P(Every, Wu2011, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

TEST(Wu2011Build, LargeScenesAreTheTreesOfSah) {
  for (const test::NamedMesh& m : large_meshes()) {
    SCOPED_TRACE(m.name);
    expect_the_tree_of_sah(m.mesh);
  }
  expect_the_tree_of_sah(scene::soup(3000, 4), {.areas = SahAreas::cells, .empty_bonus = 0.2F});
}

TEST(Wu2011Build, HasItsProperties) {
  const scene::Mesh mesh = scene::soup(2000, 5);
  const Tree tree = test::build(mesh.view(), options_for());
  for (const std::string& violation : verify::check_tree(tree, mesh.view()))
    ADD_FAILURE() << violation;
}

TEST(Wu2011Build, IsTheSameForPermutedTriangles) {
  for (const test::NamedMesh& m : large_meshes()) {
    std::vector<std::uint32_t> old_ids;
    const scene::Mesh shuffled = scene::shuffled(m.mesh, 7, &old_ids);
    EXPECT_EQ(verify::tree_hash_mapped(test::build(shuffled.view(), options_for()).view(), old_ids),
              verify::tree_hash_mapped(test::build(m.mesh.view(), options_for()).view(), {}))
        << m.name;
  }
}

TEST(Wu2011Build, AnswersRays) {
  const scene::Mesh mesh = scene::soup(500, 6);
  const test::PlatformTree tree(mesh.view(), options_for());
  const std::vector<Ray> rays = scene::hard_rays(mesh, tree.host().view(), 500, 8);
  const std::vector<Hit> want = tree.brute_force_hits(rays);
  const std::vector<Hit> got = tree.closest_hits(rays);
  ASSERT_EQ(got.size(), want.size());
  for (std::size_t i = 0; i < got.size(); ++i)
    EXPECT_TRUE(test::same_bits(got[i], want[i])) << "ray " << i;
}

// ---- Sizes at the ends --------------------------------------------------------------------------

TEST(Wu2011Build, NothingToBuild) {
  scene::Mesh zero_area = scene::identical(5);
  for (glm::uvec3& face : zero_area.faces) face = {0, 1, 1};
  scene::Mesh not_finite = scene::soup(100, 4);
  for (glm::vec3& p : not_finite.positions) p = glm::vec3(std::nanf(""));
  for (const scene::Mesh& mesh : {scene::Mesh{}, zero_area, not_finite})
    for (const test::WayToBuild& way : test::ways_to_build()) {
      const Tree tree = way.build(mesh.view(), options_for());
      EXPECT_TRUE(tree.view().empty());
      EXPECT_TRUE(tree.view().root().is_none());
      EXPECT_EQ(tree_hash(tree.view()), tree_hash(Tree().view()));
      EXPECT_EQ(tree.statistics().skipped_zero_area + tree.statistics().skipped_non_finite,
                mesh.faces.size());
    }
}

TEST(Wu2011Build, ARootThatIsALeaf) {
  const scene::Mesh one{{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, {{0, 1, 2}}};
  expect_the_tree_of_sah(one);
  EXPECT_TRUE(test::build(one.view(), options_for()).view().root() == Link::leaf(0));
  // A split may pay here, and none does.
  const scene::Mesh alike = scene::identical(5000);
  expect_the_tree_of_sah(alike);
  EXPECT_EQ(test::build(alike.view(), options_for()).view().leaf_count(), 1u);
}

TEST(Wu2011Build, NoDeeperThanAWalkCanGo) {
  const scene::Mesh mesh = test::small_mesh(28, 1).mesh;
  EXPECT_EQ(test::build(mesh.view(), options_for()).statistics().depth, max_depth);
}

// ---- Options, statistics, errors ----------------------------------------------------------------

TEST(Wu2011Build, SaysWhatItUsedAndMade) {
  const scene::Mesh mesh = scene::soup(500, 9);
  BuildOptions options = options_for({.test_cost = 2.0F});
  const Tree tree = test::build(mesh.view(), options);
  EXPECT_EQ(tree.options().builder, Builder::wu2011);
  EXPECT_EQ(tree.options().references, References::all);
  EXPECT_EQ(tree.options().backend, test::backend());
  EXPECT_EQ(tree.options().sah.test_cost, 2.0F);
  EXPECT_EQ(tree.lattice().code_bits, 0u);
  const Statistics& s = tree.statistics();
  EXPECT_EQ(s.triangles, 500u);
  EXPECT_EQ(s.leaves, tree.view().leaf_count());
  EXPECT_EQ(s.nodes, tree.view().node_count());
  EXPECT_EQ(s.references, tree.view().reference_count());
  EXPECT_EQ(s.depth, verify::tree_depth(tree.view()));
  EXPECT_GT(s.workspace_bytes, 0u);
  options.references = References::budget;  // not looked at, like the other options of morton
  options.leaf_size = 1;
  options.code_bits = 3;
  options.axis_order = AxisOrder::cyclic;
  options.quality = Quality::high;
  EXPECT_EQ(tree_hash(test::build(mesh.view(), options).view()), tree_hash(tree.view()));
}

TEST(Wu2011Build, ItsMemoryIsNotKnownBeforehand) {
  const test::Caught error =
      test::caught([] { (void)memory_requirement(cpu::Executor{}, 10, options_for()); });
  EXPECT_EQ(error.code, ErrorCode::unsupported_option);
  EXPECT_NE(error.message.find("wu2011"), std::string::npos) << error.message;
}

TEST(Wu2011Build, WrongInput) {
  scene::Mesh mesh = scene::soup(10, 9);
  mesh.positions[3 * 4].y = std::nanf("");
  BuildOptions options = options_for();
  options.invalid_triangles = InvalidTriangles::error;
  const auto error = [&] { return test::caught([&] { (void)test::build(mesh.view(), options); }); };
  const test::Caught not_finite = error();
  EXPECT_EQ(not_finite.code, ErrorCode::non_finite_vertex);
  EXPECT_EQ(not_finite.offender, 4u);
  expect_the_tree_of_sah(mesh);
  mesh.faces[6].z = 1000;
  const test::Caught outside = error();
  EXPECT_EQ(outside.code, ErrorCode::index_out_of_range);
  EXPECT_EQ(outside.offender, 6u);
  options.sah.visit_cost = 0.0F;
  EXPECT_EQ(error().code, ErrorCode::invalid_option);
}

}  // namespace
}  // namespace zkd
