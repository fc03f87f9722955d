// SPDX-License-Identifier: Apache-2.0
//
// References::budget, ::automatic and ::all, Quality::balanced: what each promises beyond what
// every tree does.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/tree_kinds.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using verify::tree_hash;

// Two finely tessellated things within nested boxes of a few large triangles.
scene::Mesh room() {
  scene::Mesh mesh = scene::joined(scene::sphere(4), scene::offset(scene::sphere(4), {9, 1, 3}));
  for (int shell = 0; shell < 10; ++shell) {
    const float size = 20.0F + static_cast<float>(shell);
    for (std::uint32_t side = 0; side < 6; ++side) {
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      const float w = side % 2 == 0 ? -1.0F : 1.0F;
      for (const auto& [u, v] :
           {std::pair{-1.0F, -1.0F}, {1.0F, -1.0F}, {1.0F, 1.0F}, {-1.0F, 1.0F}}) {
        const glm::vec3 at = side / 2 == 0   ? glm::vec3(w, u, v)
                             : side / 2 == 1 ? glm::vec3(u, w, v)
                                             : glm::vec3(u, v, w);
        mesh.positions.push_back(size * glm::vec3(1.0F, 0.6F, 0.8F) * at);
      }
      mesh.faces.emplace_back(first, first + 1, first + 2);
      mesh.faces.emplace_back(first, first + 2, first + 3);
    }
  }
  return mesh;
}

// Small things here and there.
scene::Mesh heap() {
  scene::Mesh mesh;
  for (const glm::vec3& at :
       {glm::vec3(0, 0, 0), {17, 3, 1}, {5, 29, 2}, {31, 31, 4}, {2, 9, 40}}) {
    mesh = scene::joined(std::move(mesh), scene::offset(scene::sphere(3), at));
  }
  return mesh;
}

BuildOptions with_budget(float budget) {
  BuildOptions options;
  options.references = References::budget;
  options.budget = budget;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

class TreeKinds : public testing::TestWithParam<test::MeshKind> {};

TEST_P(TreeKinds, KeepTheirProperties) {
  for (std::uint64_t seed = 60; seed < 63; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    for (BuildOptions options : test::tree_kinds()) {
      options.leaf_size = 1 + static_cast<std::uint32_t>(seed % 4);
      options.budget = 1.2F + static_cast<float>(seed - 60);
      const Tree tree = test::build(m.mesh.view(), options);
      for (const std::string& violation : verify::check_tree(tree, m.mesh.view())) {
        ADD_FAILURE() << m.name << ", seed " << seed << ", " << test::name_of(options) << ": "
                      << violation;
      }
    }
  }
}

TEST_P(TreeKinds, BudgetIsKept) {
  const test::NamedMesh m = test::small_mesh(GetParam().number, 63);
  std::uint64_t valid = 0;
  {
    const Tree once = test::build(m.mesh.view(), with_budget(1.0F));
    valid = once.view().reference_count();
    BuildOptions options = with_budget(1.0F);
    options.references = References::once;
    EXPECT_EQ(tree_hash(once.view()), tree_hash(test::build(m.mesh.view(), options).view()))
        << m.name << ": nothing may be split";
  }
  for (const float budget : {1.01F, 1.3F, 2.0F, 7.5F}) {
    const Tree tree = test::build(m.mesh.view(), with_budget(budget));
    EXPECT_LE(static_cast<double>(tree.view().reference_count()),
              static_cast<double>(budget) * static_cast<double>(valid))
        << m.name << ", budget " << budget;
    EXPECT_GE(tree.view().reference_count(), valid) << m.name << ", budget " << budget;
  }
}

INSTANTIATE_TEST_SUITE_P(Every, TreeKinds, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

TEST(TreeBudget, IsUsedWhereTrianglesAreLarge) {
  const scene::Mesh needles = scene::needles(2000, 64);
  for (const float budget : {2.0F, 4.0F, 8.0F}) {
    const Tree tree = test::build(needles.view(), with_budget(budget));
    EXPECT_GT(tree.view().reference_count(), 2000 + 0.5 * (static_cast<double>(budget) - 1) * 2000)
        << budget;
  }
}

TEST(TreeBudget, MakesTestsFewer) {
  const scene::Mesh needles = scene::needles(2000, 65);
  double before = 1e300;
  for (const float budget : {1.0F, 4.0F, 8.0F}) {
    BuildOptions options = with_budget(budget);
    options.leaf_size = 1;
    const Tree tree = test::build(needles.view(), options);
    const double tests = measure_tree(tree.view()).expected_triangle_tests;
    EXPECT_LT(tests, 0.95 * before) << budget;
    before = tests;
  }
}

// ---- Automatic ----------------------------------------------------------------------------------

TEST(TreeAutomatic, SplitsUnevenScenesOnly) {
  struct Scene {
    std::string name;
    scene::Mesh mesh;
    References want;
  };
  for (const Scene& s : {Scene{"sphere", scene::sphere(5), References::once},
                         Scene{"soup", scene::soup(5000, 66), References::once},
                         Scene{"heap", heap(), References::once},
                         Scene{"needles", scene::needles(2000, 66), References::budget},
                         Scene{"room", room(), References::budget}}) {
    BuildOptions options = with_budget(1.4F);
    options.references = References::automatic;
    const Tree tree = test::build(s.mesh.view(), options);
    EXPECT_EQ(tree.options().references, s.want)
        << s.name << ": " << to_string(tree.options().references);
    options.references = tree.options().references;
    EXPECT_EQ(tree_hash(tree.view()), tree_hash(test::build(s.mesh.view(), options).view()))
        << s.name;
  }
}

// Whatever the size of the scene and where it is.
TEST(TreeAutomatic, DoesNotDependOnScale) {
  for (const int exponent : {-100, -3, 0, 5, 90}) {
    BuildOptions options;
    options.references = References::automatic;
    for (const bool even : {true, false}) {
      const scene::Mesh mesh = scene::scaled(even ? scene::sphere(4) : room(), exponent);
      EXPECT_EQ(test::build(mesh.view(), options).options().references,
                even ? References::once : References::budget)
          << "2^" << exponent;
    }
  }
}

// The scene grows while its triangles are measured, and small ones are left out by what was seen of
// it: the largest first, last, and anywhere must lead to the same.
TEST(TreeAutomatic, DoesNotDependOnOrder) {
  BuildOptions options;
  options.references = References::automatic;
  std::uint32_t split = 0;
  constexpr std::uint32_t scenes = 24;
  for (std::uint32_t n = 1; n <= scenes; ++n) {
    const scene::Mesh needles = scene::scaled(scene::needles(n, n), 5);
    const scene::Mesh spheres = scene::joined(scene::offset(scene::sphere(4), {20, 3, 8}),
                                              scene::offset(scene::sphere(4), {9, 9, 9}));
    const References first =
        test::build(scene::joined(needles, spheres).view(), options).options().references;
    const scene::Mesh last = scene::joined(spheres, needles);
    EXPECT_EQ(test::build(last.view(), options).options().references, first) << n;
    for (std::uint64_t seed = 0; seed < 4; ++seed)
      EXPECT_EQ(test::build(scene::shuffled(last, seed).view(), options).options().references,
                first)
          << n << ", seed " << seed;
    split += first == References::budget ? 1 : 0;
  }
  EXPECT_GT(split, 0u);
  EXPECT_LT(split, scenes);
}

// ---- Balanced -----------------------------------------------------------------------------------

TEST(TreeBalanced, IsCheaperToTrace) {
  for (const scene::Mesh& mesh : {heap(), scene::sphere(5), scene::soup(5000, 67)}) {
    BuildOptions options;
    options.measure_quality = true;
    const double fast = test::build(mesh.view(), options).statistics().sah_cost;
    options.quality = Quality::balanced;
    const Tree tree = test::build(mesh.view(), options);
    EXPECT_LT(tree.statistics().sah_cost, fast);
    EXPECT_EQ(tree.options().quality, Quality::balanced);
  }
}

TEST(TreeBalanced, IsNoDeeperThanAWalkAllows) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    for (const scene::Mesh& mesh :
         {scene::staircase(300), scene::joined(scene::staircase(200), scene::identical(3000)),
          scene::joined(scene::staircase(100), scene::same_centre(3000, seed)),
          scene::small_in_large(4000, 1e7F, seed), scene::random_bits(4000, seed)}) {
      for (const std::uint32_t code_bits : {0u, 18u, 64u}) {
        BuildOptions options;
        options.quality = Quality::balanced;
        options.leaf_size = 1;
        options.code_bits = code_bits;
        options.measure_quality = true;
        options.invalid_triangles = InvalidTriangles::skip;
        const Tree tree = test::build(mesh.view(), options);
        EXPECT_LE(tree.statistics().depth, max_depth);
        for (const std::string& violation : verify::check_tree(tree, mesh.view())) {
          ADD_FAILURE() << violation;
        }
      }
    }
  }
}

// Triangles in one plane, each nearly as large as all of them: every cell holds nearly all, and
// splitting a leaf again would list all of them once more for each of its cells.
TEST(TreeAll, LeavesThatSplittingWouldNotThinStayWhole) {
  constexpr std::uint32_t n = 600;
  scene::Mesh mesh;
  for (std::uint32_t i = 0; i < n; ++i) {
    const float d = static_cast<float>(i) * 0x1p-20F;
    mesh.positions.emplace_back(-16.0F + d, -16.0F, 0.0F);
    mesh.positions.emplace_back(16.0F + d, -16.0F + d, 0.0F);
    mesh.positions.emplace_back(d, 16.0F - d, 0.0F);
    mesh.faces.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  const Tree tree = test::build(mesh.view(), {.references = References::all});
  EXPECT_GT(tree.statistics().crowded_leaves, 0u);
  // A leaf of the first round for every few triangles: n / 4 of them at most.
  EXPECT_LE(tree.statistics().references, std::uint64_t{n} * n / 4);

  // What splitting thins is split: the same, each a hundredth of the size.
  for (std::uint32_t i = 0; i < n; ++i) {
    const glm::vec3 at(static_cast<float>(i % 25), static_cast<float>(i / 25), 0.0F);
    for (std::uint32_t c = 0; c < 3; ++c)
      mesh.positions[3 * i + c] = at + 0.01F * mesh.positions[3 * i + c];
  }
  const Tree spread = test::build(mesh.view(), {.references = References::all});
  EXPECT_LE(spread.statistics().references, 3u * n);
}

}  // namespace
}  // namespace zkd
