// SPDX-License-Identifier: Apache-2.0
//
// Builder::sah: its trees against brute force, their properties, extremes of size, options.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/caught.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/sah_brute_force.hpp"
#include "support/sah_cases.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using verify::tree_hash;

BuildOptions options_for(const SahOptions& sah = {}) {
  return test::sah_options(Builder::sah, sah);
}

std::string text_of(const SahOptions& sah) {
  return std::string(to_string(sah.areas)) + ", visit " + std::to_string(sah.visit_cost) +
         ", test " + std::to_string(sah.test_cost) + ", bonus " + std::to_string(sah.empty_bonus);
}

void expect_properties(const Tree& tree, const scene::Mesh& mesh) {
  for (const std::string& violation : verify::check_tree(tree, mesh.view()))
    ADD_FAILURE() << violation;
}

class SahTree : public testing::TestWithParam<test::MeshKind> {};

// ---- Against brute force ------------------------------------------------------------------------

bool same_box(const Box& a, const Node& node, int which) {
  for (int axis = 0; axis < 3; ++axis)
    if (a.lo[axis] != node.lo(which, axis) || a.hi[axis] != node.hi(which, axis)) return false;
  return true;
}

TEST_P(SahTree, IsThatOfBruteForce) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    for (const SahOptions& sah : test::sah_weights()) {
      SCOPED_TRACE(m.name + ", seed " + std::to_string(seed) + ", " + text_of(sah));
      const Tree tree = build(cpu::Executor{}, m.mesh.view(), options_for(sah));
      const test::PlainTree want = test::PlainSah(m.mesh, sah, tree.view().bounds()).tree;
      ASSERT_EQ(tree.nodes().size(), want.nodes.size());
      ASSERT_EQ(tree.view().leaf_count(), want.leaves.size());
      for (std::size_t i = 0; i < want.nodes.size(); ++i) {
        const Node& node = tree.nodes()[i];
        ASSERT_EQ(node.axis, want.nodes[i].axis) << "node " << i;
        ASSERT_EQ(node.plane, want.nodes[i].plane) << "node " << i;
        for (int which = 0; which < 2; ++which)
          ASSERT_TRUE(same_box(want.nodes[i].boxes[which], node, which))
              << "child " << which << " of node " << i;
      }
      for (std::uint32_t leaf = 0; leaf < want.leaves.size(); ++leaf)
        ASSERT_TRUE(std::equal(want.leaves[leaf].begin(), want.leaves[leaf].end(),
                               tree.leaf(leaf).begin(), tree.leaf(leaf).end()))
            << "leaf " << leaf;
    }
  }
}

// ---- Properties ---------------------------------------------------------------------------------

TEST_P(SahTree, HasItsProperties) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    for (const SahOptions& sah : test::sah_weights()) {
      SCOPED_TRACE(m.name + ", seed " + std::to_string(seed) + ", " + text_of(sah));
      const Tree tree = build(cpu::Executor{}, m.mesh.view(), options_for(sah));
      expect_properties(tree, m.mesh);
      const Statistics& s = tree.statistics();
      EXPECT_EQ(s.triangles, m.mesh.faces.size());
      EXPECT_EQ(s.leaves, tree.view().leaf_count());
      EXPECT_EQ(s.nodes, tree.view().node_count());
      EXPECT_EQ(s.references, tree.view().reference_count());
      EXPECT_EQ(s.depth, verify::tree_depth(tree.view()));
      EXPECT_LE(s.depth, max_depth);
      if (HasFailure()) return;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, SahTree, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

TEST(SahBuild, LargeScenesHaveTheirProperties) {
  for (const test::NamedMesh& m : test::large_sah_meshes()) {
    SCOPED_TRACE(m.name);
    expect_properties(build(cpu::Executor{.threads = 2}, m.mesh.view(), options_for()), m.mesh);
  }
}

// ---- The same tree ------------------------------------------------------------------------------

TEST(SahBuild, OneTreeForAnyThreadsAndInstructions) {
  for (const test::NamedMesh& m : test::large_sah_meshes()) {
    SCOPED_TRACE(m.name);
    const std::string want = tree_hash(build({.threads = 1}, m.mesh.view(), options_for()).view());
    for (const int threads : {1, 2, 3, 8})
      for (const auto set : {cpu::InstructionSet::portable, cpu::InstructionSet::avx2})
        EXPECT_EQ(
            tree_hash(build({.threads = threads, .instructions = set}, m.mesh.view(), options_for())
                          .view()),
            want)
            << threads << " threads";
  }
}

void expect_same_tree_permuted(const scene::Mesh& mesh, const BuildOptions& options,
                               std::uint64_t seed) {
  std::vector<std::uint32_t> old_ids;
  const scene::Mesh shuffled = scene::shuffled(mesh, seed, &old_ids);
  const Tree tree = build(cpu::Executor{.threads = 2}, mesh.view(), options);
  const Tree other = build(cpu::Executor{.threads = 2}, shuffled.view(), options);
  EXPECT_EQ(verify::tree_hash_mapped(other.view(), old_ids),
            verify::tree_hash_mapped(tree.view(), {}));
}

TEST_P(SahTree, IsTheSameForPermutedTriangles) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed)
    for (const SahOptions& sah : test::sah_weights())
      expect_same_tree_permuted(test::small_mesh(GetParam().number, seed).mesh, options_for(sah),
                                seed);
}

TEST(SahBuild, LargeScenesAreTheSameForPermutedTriangles) {
  for (const test::NamedMesh& m : test::large_sah_meshes()) {
    SCOPED_TRACE(m.name);
    expect_same_tree_permuted(m.mesh, options_for(), 7);
  }
}

// Powers of two change nothing but the planes and boxes.
TEST_P(SahTree, IsTheSameForScaledTriangles) {
  const test::NamedMesh m = test::small_mesh(GetParam().number, 5);
  const Tree tree = build(cpu::Executor{}, m.mesh.view(), options_for());
  for (const int e : {-60, -3, 1, 40}) {
    const scene::Mesh scaled = scene::scaled(m.mesh, e);
    if (scene::scaled(scaled, -e).positions != m.mesh.positions) continue;  // out of the floats
    const Tree other = build(cpu::Executor{}, scaled.view(), options_for());
    ASSERT_EQ(other.nodes().size(), tree.nodes().size()) << "times 2^" << e;
    EXPECT_TRUE(std::equal(tree.references().begin(), tree.references().end(),
                           other.references().begin(), other.references().end()));
    for (std::size_t i = 0; i < tree.nodes().size(); ++i)
      ASSERT_EQ(
          static_cast<double>(other.nodes()[i].plane) / static_cast<double>(other.view().scale()),
          std::ldexp(
              static_cast<double>(tree.nodes()[i].plane) / static_cast<double>(tree.view().scale()),
              e));
  }
}

// ---- Sizes at the ends --------------------------------------------------------------------------

TEST(SahBuild, NothingToBuild) {
  scene::Mesh zero_area = scene::identical(5);
  for (glm::uvec3& face : zero_area.faces) face = {0, 1, 1};
  scene::Mesh not_finite = scene::soup(100, 4);
  for (glm::vec3& p : not_finite.positions) p = glm::vec3(std::nanf(""));
  for (const scene::Mesh& mesh : {scene::Mesh{}, zero_area, not_finite}) {
    const Tree tree = build(cpu::Executor{}, mesh.view(), options_for());
    EXPECT_TRUE(tree.view().empty());
    EXPECT_TRUE(tree.view().root().is_none());
    EXPECT_TRUE(tree.view().bounds().empty());
    EXPECT_EQ(tree_hash(tree.view()), tree_hash(Tree().view()));
    EXPECT_EQ(tree.statistics().skipped_zero_area + tree.statistics().skipped_non_finite,
              mesh.faces.size());
    expect_properties(tree, mesh);
    EXPECT_FALSE(closest_hit(tree.view(), mesh.view(), {{0, 0, -5}}).has_value());
  }
}

TEST(SahBuild, OneTriangleIsALeaf) {
  const scene::Mesh mesh{{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, {{0, 1, 2}}};
  const Tree tree = build(cpu::Executor{}, mesh.view(), options_for());
  EXPECT_TRUE(tree.view().root() == Link::leaf(0));
  EXPECT_EQ(tree.view().leaf_count(), 1u);
  EXPECT_EQ(tree.leaf(0)[0], 0u);
  EXPECT_EQ(tree.statistics().sah_cost, 1.0);
  const auto hit = closest_hit(tree.view(), mesh.view(), {{0.25F, 0.25F, 0}});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->t, 1.0F);
}

TEST(SahBuild, FlatScenesAlongEachAxis) {
  for (int axis = 0; axis < 3; ++axis) {
    const scene::Mesh mesh = scene::flat(400, axis, 6);
    const Tree tree = build(cpu::Executor{}, mesh.view(), options_for());
    expect_properties(tree, mesh);
    EXPECT_GT(tree.view().leaf_count(), 50u);
    for (const Node& node : tree.nodes()) EXPECT_NE(node.axis, static_cast<std::uint32_t>(axis));
  }
}

// Bounded: a quadratic build would take hours, and CTest would end it.
TEST(SahBuild, AMillionAlike) {
  const scene::Mesh mesh = scene::identical(1000000);
  const Tree tree = build(cpu::Executor{}, mesh.view(), options_for());
  EXPECT_EQ(tree.view().reference_count(), 1000000u);
  EXPECT_EQ(tree.view().leaf_count(), 1u);
}

// Triangles of all sizes that floats have, one inside the other.
TEST(SahBuild, NoDeeperThanAWalkCanGo) {
  const scene::Mesh mesh = test::small_mesh(28, 1).mesh;
  const Tree tree = build(cpu::Executor{}, mesh.view(), options_for());
  EXPECT_EQ(tree.statistics().depth, max_depth);
  EXPECT_EQ(verify::tree_depth(tree.view()), max_depth);
}

// Walls in the faces of a room get flat cells of their own.
TEST(SahBuild, WallsInTheFacesOfTheScene) {
  scene::Mesh mesh = scene::soup(300, 8);
  const Box box = build(cpu::Executor{}, mesh.view(), options_for()).view().bounds();
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {{box.lo[0], box.lo[1], box.lo[2]},
                                               {box.lo[0], box.hi[1], box.lo[2]},
                                               {box.lo[0], box.lo[1], box.hi[2]},
                                               {box.lo[0], box.hi[1], box.hi[2]}});
  mesh.faces.insert(mesh.faces.end(),
                    {{first, first + 1, first + 2}, {first + 1, first + 2, first + 3}});
  const Tree tree = build(cpu::Executor{}, mesh.view(), options_for());
  expect_properties(tree, mesh);
  const auto nodes = tree.nodes();
  EXPECT_TRUE(std::any_of(nodes.begin(), nodes.end(), [&](const Node& node) {
    return node.axis == 0 && node.plane == box.lo[0];
  }));
}

// ---- Options ------------------------------------------------------------------------------------

TEST(SahBuild, SaysWhatItUsed) {
  const scene::Mesh mesh = scene::soup(500, 9);
  BuildOptions options = options_for({.test_cost = 2.0F});
  const Tree tree = build(mesh.view(), options);
  EXPECT_EQ(tree.options().builder, Builder::sah);
  EXPECT_EQ(tree.options().references, References::all);
  EXPECT_EQ(tree.options().backend, Backend::cpu);
  EXPECT_EQ(tree.options().sah.test_cost, 2.0F);
  EXPECT_GT(tree.statistics().total_ms, 0.0);
  options.references = References::budget;  // not looked at, like the other options of morton
  options.leaf_size = 1;
  options.code_bits = 3;
  options.axis_order = AxisOrder::cyclic;
  EXPECT_EQ(tree_hash(build(mesh.view(), options).view()), tree_hash(tree.view()));
}

TEST(SahBuild, QualityHighHandsOverToIt) {
  const scene::Mesh mesh = scene::soup(500, 9);
  const BuildOptions high{.quality = Quality::high};
  const Tree trees[] = {build(mesh.view(), high), build(cpu::Executor{}, mesh.view(), high)};
  for (const Tree& tree : trees) {
    EXPECT_EQ(tree.options().builder, Builder::sah);
    EXPECT_EQ(tree.options().quality, Quality::high);
    EXPECT_EQ(tree_hash(tree.view()),
              tree_hash(build(mesh.view(), {.builder = Builder::sah}).view()));
  }
  try {
    (void)memory_requirement(cpu::Executor{}, 500, high);
    FAIL() << "what it takes is not known beforehand";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported_option);
  }
}

// One that does nothing would not be one.
TEST(SahBuild, EveryOptionChangesTheTree) {
  const scene::Mesh mesh = scene::soup(500, 9);
  const auto hash = [&](const SahOptions& sah) {
    return tree_hash(build(mesh.view(), options_for(sah)).view());
  };
  std::vector<std::string> hashes = {hash({}), hash({.visit_cost = 2.0F}),
                                     hash({.test_cost = 3.0F}), hash({.areas = SahAreas::cells}),
                                     hash({.areas = SahAreas::cells, .empty_bonus = 0.5F})};
  std::sort(hashes.begin(), hashes.end());
  EXPECT_EQ(std::adjacent_find(hashes.begin(), hashes.end()), hashes.end());
}

// Only ratios of costs count.
TEST(SahBuild, CostsHaveNoUnit) {
  const scene::Mesh mesh = scene::soup(500, 9);
  EXPECT_EQ(
      tree_hash(build(mesh.view(), options_for()).view()),
      tree_hash(build(mesh.view(), options_for({.visit_cost = 8.0F, .test_cost = 4.0F})).view()));
}

TEST(SahBuild, BetterThanMorton) {
  for (const test::NamedMesh& m : test::large_sah_meshes()) {
    SCOPED_TRACE(m.name);
    const double cost = build(cpu::Executor{}, m.mesh.view(), options_for({.test_cost = 1.0F}))
                            .statistics()
                            .sah_cost;
    for (const References references : {References::once, References::all}) {
      BuildOptions morton = options_for();
      morton.builder = Builder::morton;
      morton.references = references;
      EXPECT_LT(cost, build(cpu::Executor{}, m.mesh.view(), morton).statistics().sah_cost);
    }
  }
}

TEST(SahBuild, WrongOptions) {
  const scene::Mesh mesh = scene::soup(10, 9);
  const float nan = std::nanf("");
  for (const SahOptions& wrong : std::vector<SahOptions>{{.visit_cost = 0.0F},
                                                         {.visit_cost = nan},
                                                         {.test_cost = -1.0F},
                                                         {.test_cost = 2000.0F},
                                                         {.empty_bonus = 1.0F},
                                                         {.empty_bonus = -0.1F},
                                                         {.empty_bonus = nan},
                                                         {.areas = static_cast<SahAreas>(7)}}) {
    const test::Caught error = test::caught([&] { (void)build(mesh.view(), options_for(wrong)); });
    ASSERT_TRUE(error.thrown) << text_of(wrong);
    EXPECT_EQ(error.code, ErrorCode::invalid_option) << error.message;
    EXPECT_NE(error.message.find("sah."), std::string::npos) << error.message;
  }
  BuildOptions options = options_for();
  EXPECT_EQ(test::caught([&] { (void)memory_requirement(cpu::Executor{}, 10, options); }).code,
            ErrorCode::unsupported_option);
  options.backend = Backend::cuda;
  EXPECT_EQ(test::caught([&] { (void)build(mesh.view(), options); }).code,
            ErrorCode::unsupported_option);
}

TEST(SahBuild, WrongInput) {
  scene::Mesh mesh = scene::soup(10, 9);
  mesh.positions[3 * 4].y = std::nanf("");
  BuildOptions options = options_for();
  options.invalid_triangles = InvalidTriangles::error;
  const test::Caught not_finite = test::caught([&] { (void)build(mesh.view(), options); });
  EXPECT_EQ(not_finite.code, ErrorCode::non_finite_vertex);
  EXPECT_EQ(not_finite.offender, 4u);
  EXPECT_EQ(build(mesh.view(), options_for()).statistics().skipped_non_finite, 1u);
  mesh.faces[6].z = 1000;
  const test::Caught outside = test::caught([&] { (void)build(mesh.view(), options_for()); });
  EXPECT_EQ(outside.code, ErrorCode::index_out_of_range);
  EXPECT_EQ(outside.offender, 6u);
}

}  // namespace
}  // namespace zkd
