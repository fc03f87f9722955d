// SPDX-License-Identifier: Apache-2.0
//
// Finished trees: the properties of every scene, extremes of size, statistics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <zkd/stages.hpp>
#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using verify::tree_hash;

// ---- Properties ---------------------------------------------------------------------------------

class TreeProperties : public testing::TestWithParam<test::MeshKind> {};

TEST_P(TreeProperties, HoldForEveryOption) {
  // One in three: the options that are passed by come with the next mesh or policy.
  const std::uint32_t thinning = std::max(3u, test::build_thinning());
  std::uint32_t number = static_cast<std::uint32_t>(GetParam().number);
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    for (const References references : {References::once, References::budget, References::all}) {
      for (const std::uint32_t leaf_size : {1u, 2u, 4u, 16u}) {
        for (const std::uint32_t code_bits : {3u, 16u, 32u, 64u}) {
          for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
            for (const bool recode : {true, false}) {
              if (number++ % thinning != 0) continue;
              const Quality quality =
                  number / thinning % 2 == 0 ? Quality::balanced : Quality::fast;
              const Tree tree =
                  test::build(m.mesh.view(), {.quality = quality,
                                              .references = references,
                                              .leaf_size = leaf_size,
                                              .code_bits = code_bits,
                                              .axis_order = order,
                                              .recode_crowded = recode,
                                              .invalid_triangles = InvalidTriangles::skip});
              for (const std::string& violation : verify::check_tree(tree, m.mesh.view())) {
                ADD_FAILURE() << m.name << ", seed " << seed << ", " << to_string(references)
                              << ", leaf size " << leaf_size << ", " << code_bits << " bits, "
                              << to_string(order) << (recode ? "" : ", not coded again") << ", "
                              << to_string(quality) << ": " << violation;
              }
              if (testing::Test::HasFailure()) return;
            }
          }
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, TreeProperties, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

TEST(TreeBuild, LargerScenesKeepTheirProperties) {
  for (const References references : {References::once, References::budget, References::all}) {
    for (const scene::Mesh& mesh : {scene::soup(20000, 3), scene::sphere(5),
                                    scene::small_in_large(5000, 1e3F, 3), scene::grid(10)}) {
      const Tree tree = test::build(mesh.view(), {.references = references});
      for (const std::string& violation : verify::check_tree(tree, mesh.view())) {
        ADD_FAILURE() << to_string(references) << ": " << violation;
      }
    }
  }
}

// ---- Sizes at the ends --------------------------------------------------------------------------

TEST(TreeBuild, NothingToBuild) {
  const scene::Mesh vertices_only{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}};
  scene::Mesh zero_area = scene::identical(5);
  for (glm::uvec3& face : zero_area.faces) face = {0, 1, 1};
  const scene::Mesh no_mesh;
  for (const References references : {References::once, References::budget, References::all}) {
    for (const scene::Mesh* mesh : {&no_mesh, &vertices_only, &std::as_const(zero_area)}) {
      const test::PlatformTree there(mesh->view(),
                                     {.references = references, .measure_quality = true});
      const Tree& tree = there.host();
      EXPECT_TRUE(tree.view().empty());
      EXPECT_TRUE(tree.view().root().is_none());
      EXPECT_TRUE(tree.view().bounds().empty());
      EXPECT_EQ(tree.view().node_count(), 0u);
      EXPECT_EQ(tree.view().reference_count(), 0u);
      EXPECT_EQ(tree.nodes().size(), 0u);
      EXPECT_EQ(tree.references().size(), 0u);
      EXPECT_EQ(tree.statistics().leaves, 0u);
      EXPECT_EQ(tree.statistics().skipped_zero_area, mesh->faces.size());
      EXPECT_EQ(tree_hash(tree.view()), tree_hash(Tree().view()));
      EXPECT_TRUE(verify::check_tree(tree, mesh->view()).empty());
      const std::vector<Ray> ray = {{{0, 0, -5}}};
      EXPECT_FALSE(test::is_hit(there.closest_hits(ray)[0]));
      EXPECT_EQ(there.any_hits(ray)[0], 0);
    }
  }
}

TEST(TreeBuild, AllVerticesNaNIsAsEmpty) {
  scene::Mesh mesh = scene::soup(100, 4);
  for (glm::vec3& p : mesh.positions) p = glm::vec3(std::nanf(""));
  const Tree tree = test::build(mesh.view(), {.invalid_triangles = InvalidTriangles::skip});
  EXPECT_TRUE(tree.view().empty());
  EXPECT_EQ(tree.statistics().skipped_non_finite, 100u);
  EXPECT_EQ(tree_hash(tree.view()), tree_hash(Tree().view()));
}

TEST(TreeBuild, OneAndTwoTriangles) {
  const std::vector<glm::vec3> corners = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1},
                                          {8, 0, 2}, {9, 0, 2}, {8, 1, 2}};
  for (const References references : {References::once, References::budget, References::all}) {
    const TriangleView one{std::span(corners).first(3)};
    const test::PlatformTree alone(one, {.references = references, .measure_quality = true});
    const Tree& first = alone.host();
    EXPECT_TRUE(first.view().root() == Link::leaf(0));
    EXPECT_EQ(first.view().leaf_count(), 1u);
    EXPECT_EQ(first.view().node_count(), 0u);
    EXPECT_EQ(first.leaf(0)[0], 0u);
    EXPECT_EQ(first.statistics().depth, 0u);
    EXPECT_EQ(first.statistics().sah_cost, 1.0);
    const std::vector<Ray> ray = {{{0.25F, 0.25F, 0}}};
    const Hit hit = alone.closest_hits(ray)[0];
    EXPECT_EQ(hit.t, 1.0F);
    EXPECT_EQ(hit.u, 0.25F);
    EXPECT_EQ(hit.v, 0.25F);
    EXPECT_EQ(hit.triangle, 0u);

    const TriangleView two{std::span(corners)};
    const test::PlatformTree together(two, {.references = references, .leaf_size = 2});
    EXPECT_EQ(together.host().view().leaf_count(), 1u);
    EXPECT_EQ(together.host().view().reference_count(), 2u);
    const test::PlatformTree apart(two, {.references = references, .leaf_size = 1});
    EXPECT_EQ(apart.host().view().leaf_count(), 2u);
    EXPECT_EQ(apart.host().view().node_count(), 1u);
    EXPECT_TRUE(apart.host().view().root() == Link::node(0));
    EXPECT_EQ(apart.host().nodes()[0].axis, 0u);
    EXPECT_GT(apart.host().nodes()[0].plane, 0.5F);
    EXPECT_LE(apart.host().nodes()[0].plane, 8.5F);
    const std::vector<Ray> far = {{{8.25F, 0.25F, 0}}};
    for (const test::PlatformTree* tree : {&together, &apart}) {
      EXPECT_EQ(tree->closest_hits(far)[0].triangle, 1u);
      EXPECT_EQ(tree->closest_hits(far)[0].t, 2.0F);
    }
  }
}

// Bounded: a quadratic build would take hours, and CTest would end it.
TEST(TreeBuild, AMillionAlike) {
  for (const References references : {References::once, References::budget, References::all}) {
    const scene::Mesh identical = scene::identical(1000000);
    const test::PlatformTree tree(identical.view(),
                                  {.references = references, .measure_quality = true});
    EXPECT_EQ(tree.host().view().leaf_count(), 1u);
    EXPECT_EQ(tree.host().statistics().largest_leaf, 1000000u);
    Ray ray;
    ray.origin = (identical.positions[0] + identical.positions[1] + identical.positions[2]) / 3.0F;
    ray.origin += glm::vec3(3, 4, 5);
    ray.direction = glm::vec3(-3, -4, -5);
    const std::vector<Ray> rays = {ray};
    EXPECT_EQ(tree.closest_hits(rays)[0].triangle, 0u);

    const scene::Mesh centres = scene::same_centre(1000000, 5);
    const Tree same = test::build(centres.view(), {.references = references});
    if (references == References::budget) continue;  // fragments have centres of their own
    EXPECT_EQ(same.view().leaf_count(), 1u)
        << "equal codes that cannot be told apart stay together";
    EXPECT_EQ(same.view().reference_count() + same.statistics().skipped_zero_area, 1000000u);
  }
}

// At the corner of the stadium, where floats are fine enough for the model at any ratio.
TEST(TreeBuild, SmallModelInALargeSceneComesApart) {
  for (const float ratio : {1e3F, 1e5F, 1e7F}) {
    const scene::Mesh mesh =
        scene::joined(scene::small_in_large(0, ratio, 6), scene::soup(20000, 6));
    for (const References references : {References::once, References::budget, References::all}) {
      BuildOptions options{.references = references, .leaf_size = 4, .measure_quality = true};
      const Tree tree = test::build(mesh.view(), options);
      EXPECT_LE(tree.statistics().largest_leaf, 128u) << "ratio " << ratio;
      EXPECT_GT(tree.statistics().leaves, 5000u) << "ratio " << ratio;
      for (const std::string& violation : verify::check_tree(tree, mesh.view())) {
        ADD_FAILURE() << "ratio " << ratio << ", " << to_string(references) << ": " << violation;
      }
      if (ratio < 1e5F) continue;
      EXPECT_GE(tree.statistics().crowded_trunks, 1u);
      EXPECT_FALSE(tree.statistics().skip(Skip::recoding).taken);
      options.recode_crowded = false;
      EXPECT_GT(test::build(mesh.view(), options).statistics().largest_leaf, 1000u)
          << "the scene is not hard";
    }
  }
}

// ---- What a build reports -----------------------------------------------------------------------

struct Quality {
  std::uint32_t depth = 0;
  double cost = 0.0;
  std::uint64_t largest_leaf = 0;
};

double area(const double size[3]) {
  return 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
}

void measure(const Tree& tree, Link link, const double size[3], std::uint32_t depth,
             double root_area, Quality& quality) {
  if (link.is_leaf()) {
    const std::size_t references = tree.leaf(link.index()).size();
    quality.depth = std::max(quality.depth, depth);
    quality.largest_leaf = std::max<std::uint64_t>(quality.largest_leaf, references);
    quality.cost += static_cast<double>(references) * area(size) / root_area;
    return;
  }
  quality.cost += area(size) / root_area;
  const Node& node = tree.nodes()[link.index()];
  for (int c = 0; c < 2; ++c) {
    double child[3];
    for (int a = 0; a < 3; ++a) {
      child[a] =
          std::max(0.0, static_cast<double>(node.hi(c, a)) - static_cast<double>(node.lo(c, a)));
    }
    measure(tree, node.child[c], child, depth + 1, root_area, quality);
  }
}

TEST(TreeBuild, StatisticsAreTrue) {
  for (const References references : {References::once, References::budget, References::all}) {
    for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
      const test::NamedMesh m = test::small_mesh(kind, 7);
      SCOPED_TRACE(m.name + ", " + to_string(references));
      const BuildOptions options{.references = references,
                                 .invalid_triangles = InvalidTriangles::skip,
                                 .measure_quality = true};
      const Tree tree = test::build(m.mesh.view(), options);
      const Statistics& s = tree.statistics();
      std::vector<Box> boxes(m.mesh.faces.size());
      const stages::SceneSummary scene =
          stages::triangle_boxes(cpu::Executor{}, m.mesh.view(), InvalidTriangles::skip, boxes);
      EXPECT_EQ(s.triangles, m.mesh.faces.size());
      EXPECT_EQ(s.skipped_zero_area, scene.zero_area);
      EXPECT_EQ(s.skipped_non_finite, scene.non_finite);
      EXPECT_EQ(s.nodes, tree.view().node_count());
      EXPECT_EQ(s.leaves, tree.view().leaf_count());
      EXPECT_EQ(s.references, tree.view().reference_count());
      EXPECT_EQ(s.code_bits, tree.lattice().code_bits);
      const bool split = stages::pays_to_split(cpu::Executor{}, boxes, references);
      EXPECT_EQ(s.skip(Skip::compaction).taken, scene.valid == m.mesh.faces.size() && !split);
      EXPECT_GE(s.tree_bytes, 64 * s.nodes + 4 * (s.leaves + s.references));
      EXPECT_GE(s.total_ms, 0.0);
      double stages_ms = 0.0;
      for (const double ms : s.stage_ms) {
        EXPECT_GE(ms, 0.0);
        stages_ms += ms;
      }
      EXPECT_LE(stages_ms, s.total_ms * 1.001 + 0.001);
      if (tree.view().empty()) continue;

      double size[3];
      for (int a = 0; a < 3; ++a) {
        size[a] = (static_cast<double>(tree.view().bounds().hi[a]) -
                   static_cast<double>(tree.view().bounds().lo[a])) *
                  static_cast<double>(tree.view().scale());
      }
      if (area(size) == 0.0) continue;
      Quality quality;
      measure(tree, tree.view().root(), size, 0, area(size), quality);
      EXPECT_EQ(s.depth, quality.depth);
      EXPECT_EQ(s.largest_leaf, quality.largest_leaf);
      EXPECT_NEAR(s.sah_cost, quality.cost, 1e-5 * quality.cost);
    }
  }
}

TEST(TreeBuild, QualityIsMeasuredOnlyOnRequest) {
  const scene::Mesh mesh = scene::soup(1000, 8);
  const Tree plain = test::build(mesh.view());
  EXPECT_EQ(plain.statistics().depth, 0u);
  EXPECT_EQ(plain.statistics().sah_cost, 0.0);
  EXPECT_EQ(plain.statistics().largest_leaf, 0u);
  const Tree measured = test::build(mesh.view(), {.measure_quality = true});
  EXPECT_GT(measured.statistics().depth, 7u);
  EXPECT_GT(measured.statistics().sah_cost, 1.0);
  EXPECT_EQ(tree_hash(measured.view()), tree_hash(plain.view()));
}

TEST(TreeBuild, SkipsAreReported) {
  const Tree flat = test::build(scene::flat(1000, 2, 9).view());
  EXPECT_TRUE(flat.statistics().skip(Skip::flat_axes).taken);
  EXPECT_EQ(flat.statistics().skip(Skip::flat_axes).amount, 1u);
  const Tree soup = test::build(scene::soup(1000, 9).view());
  EXPECT_FALSE(soup.statistics().skip(Skip::flat_axes).taken);
  EXPECT_TRUE(soup.statistics().skip(Skip::recoding).taken);
  EXPECT_TRUE(soup.statistics().skip(Skip::wide_codes).taken);
  EXPECT_TRUE(soup.statistics().skip(Skip::compaction).taken);
}

// Of cells that are made of fragments, `all` has fewer that large triangles cross; where all boxes
// are alike, or all lie in each other, it makes none.
TEST(TreeBuild, CellsOfAllAreThoseOfFragmentsWhereThatPays) {
  const auto build_all = [](const scene::Mesh& mesh, float budget) {
    return test::build(mesh.view(),
                       {.references = References::all, .budget = budget, .measure_quality = true});
  };
  const scene::Mesh uneven = test::room(5000, 10);
  const Tree of_triangles = build_all(uneven, 1.0F);
  const Tree of_fragments = build_all(uneven, 1.3F);
  EXPECT_TRUE(of_fragments.statistics().skip(Skip::splitting).considered);
  EXPECT_FALSE(of_fragments.statistics().skip(Skip::splitting).taken);
  EXPECT_LT(of_fragments.statistics().sah_cost, 0.95 * of_triangles.statistics().sah_cost);
  for (const scene::Mesh& mesh : {scene::soup(5000, 2), scene::same_centre(5000, 2)}) {
    const Tree tree = build_all(mesh, 1.3F);
    EXPECT_TRUE(tree.statistics().skip(Skip::splitting).considered);
    EXPECT_TRUE(tree.statistics().skip(Skip::splitting).taken);
    EXPECT_EQ(tree_hash(tree.view()), tree_hash(build_all(mesh, 2.0F).view()));
  }
}

// A leaf of `all` is crowded by what it lists: with 1, by more than eight.
TEST(TreeBuild, CrowdedLeavesAreCounted) {
  const scene::Mesh fan = scene::fan(100);  // all of them touch the cell round the tip
  const Statistics crowded =
      test::build(fan.view(), {.references = References::all, .leaf_size = 1}).statistics();
  EXPECT_GE(crowded.crowded_leaves, 1u);
  EXPECT_GT(crowded.crowded_references, 8 * crowded.crowded_leaves);
  EXPECT_TRUE(crowded.skip(Skip::subtrees).considered);
  EXPECT_FALSE(crowded.skip(Skip::subtrees).taken);

  const Statistics roomy =
      test::build(fan.view(), {.references = References::all, .leaf_size = 100}).statistics();
  EXPECT_EQ(roomy.crowded_leaves, 0u);
  EXPECT_EQ(roomy.crowded_references, 0u);
  EXPECT_TRUE(roomy.skip(Skip::subtrees).taken);

  const Statistics once = test::build(fan.view(), {.leaf_size = 1}).statistics();
  EXPECT_EQ(once.crowded_leaves, 0u);
  EXPECT_FALSE(once.skip(Skip::subtrees).considered);
}

TEST(TreeBuild, SkipsAreLookedForWhereTheyCanBe) {
  const scene::Mesh mesh = scene::joined(scene::soup(300, 9), scene::identical(30));
  const Statistics plain = test::build(mesh.view(), {.code_bits = 32}).statistics();
  EXPECT_FALSE(plain.skip(Skip::wide_codes).considered);
  EXPECT_TRUE(plain.skip(Skip::recoding).considered);
  EXPECT_FALSE(plain.skip(Skip::recoding).taken) << "thirty alike are a crowd";
  EXPECT_TRUE(plain.skip(Skip::compaction).considered);
  const Statistics without = test::build(mesh.view(), {.recode_crowded = false}).statistics();
  EXPECT_TRUE(without.skip(Skip::wide_codes).considered);
  EXPECT_FALSE(without.skip(Skip::recoding).considered);
  EXPECT_FALSE(without.skip(Skip::recoding).taken);
  for (std::size_t i = 0; i < static_cast<std::size_t>(Skip::count); ++i) {
    const auto skip = static_cast<Skip>(i);
    EXPECT_STRNE(reason(skip, true), reason(skip, false));
    EXPECT_STRNE(reason(skip, true), "unknown");
    EXPECT_STRNE(reason(skip, false), "unknown");
    if (skip != Skip::radix_passes) {
      EXPECT_FALSE(plain.skip(skip).saved_ms.has_value());
    }
  }
}

TEST(TreeBuild, OptionsAreRecordedAsChosen) {
  const scene::Mesh soup = scene::soup(100, 10);
  const Tree tree = test::build(soup.view(), {.leaf_size = 7});
  EXPECT_EQ(tree.options().leaf_size, 7u);
  EXPECT_EQ(test::build(soup.view()).options().leaf_size, 4u);
  EXPECT_EQ(test::build(soup.view(), {.references = References::all}).options().leaf_size, 12u);
  EXPECT_EQ(tree.options().backend, test::backend());
  EXPECT_EQ(tree.options().code_bits, 32u);
}

// Three in four million triangles of one small grid: only the count matters. The width follows the
// valid ones: what is left out changes nothing.
TEST(TreeBuild, CodeWidthFollowsTheNumberOfValidTriangles) {
  constexpr std::uint32_t threshold = 1u << 22;
  scene::Mesh mesh;
  for (std::uint32_t i = 0; i < 30; ++i) {
    const auto x = static_cast<float>(i % 10);
    mesh.positions.emplace_back(x, static_cast<float>(i / 10) + 0.125F * x * x, x * 0.5F);
  }
  const std::vector<glm::uvec3> shapes = {{0, 1, 12}, {3, 4, 25}, {5, 16, 27}, {8, 9, 18}};
  mesh.faces.resize(threshold - 1);
  for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) mesh.faces[i] = shapes[i % 4];
  const Tree below = test::build(mesh.view());
  ASSERT_EQ(below.view().reference_count(), threshold - 1);
  EXPECT_EQ(below.options().code_bits, 32u);

  mesh.faces.insert(mesh.faces.end(), 10, glm::uvec3(3, 3, 3));
  const Tree with_invalid = test::build(mesh.view());
  EXPECT_EQ(with_invalid.options().code_bits, 32u);
  EXPECT_EQ(tree_hash(with_invalid.view()), tree_hash(below.view()));

  mesh.faces.back() = shapes[0];
  EXPECT_EQ(test::build(mesh.view()).options().code_bits, 64u);
}

}  // namespace
}  // namespace zkd
