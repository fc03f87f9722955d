// SPDX-License-Identifier: Apache-2.0
//
// Finished trees: the bytes of the stages' composition, the properties of every scene, extremes of
// size, statistics.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include <zkd/stages.hpp>
#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using verify::tree_hash;

// ---- Composition of the stages ------------------------------------------------------------------

struct Composition {
  Lattice lattice;
  std::vector<Box> boxes;
  Box bounds;
  std::vector<std::uint32_t> ids;
  std::vector<std::uint32_t> first;  // of each trunk, and the end
  Link root;
  std::vector<Link> children;
  std::vector<std::uint32_t> axes;
  std::vector<float> planes;
  std::uint32_t crowded = 0;
  std::vector<std::uint32_t> leaf_offsets;
  std::vector<std::uint32_t> references;
  std::vector<Node> nodes;
};

Composition compose(const TriangleView& triangles, const BuildOptions& options) {
  Composition out;
  const cpu::Executor executor{.threads = 2};
  out.boxes.resize(triangles.triangle_count);
  const stages::SceneSummary scene =
      stages::triangle_boxes(executor, triangles, options.invalid_triangles, out.boxes);
  out.bounds = scene.bounds;
  std::uint32_t width = options.code_bits;
  if (width == 0) width = scene.valid < (1u << 22) ? 32 : 64;
  out.lattice = stages::make_lattice(scene.bounds, width, options.axis_order);

  std::vector<std::uint64_t> codes(scene.valid);
  out.ids.resize(scene.valid);
  stages::morton_encode(executor, out.boxes, out.lattice, std::span(codes), out.ids);
  (void)stages::radix_sort(executor, std::span(codes), out.ids, 64);

  std::vector<stages::TrunkKey> keys(scene.valid);
  std::vector<std::uint32_t> crowd(scene.valid);
  std::vector<Lattice> lattices(scene.valid);
  out.crowded =
      stages::recode_crowded(executor, out.boxes, out.lattice, codes, out.ids, options.leaf_size,
                             options.axis_order, options.recode_crowded, keys, crowd, lattices);
  out.first.resize(scene.valid);
  out.first.resize(stages::find_trunks(executor, keys, options.leaf_size, out.first));

  std::vector<stages::TrunkKey> trunk_keys;
  std::vector<std::uint32_t> trunk_crowd;
  for (const std::uint32_t at : out.first) {
    trunk_keys.push_back(keys[at]);
    trunk_crowd.push_back(crowd[at]);
  }
  out.first.push_back(scene.valid);
  out.leaf_offsets.assign(1, 0);
  if (trunk_keys.empty()) return out;

  const std::size_t nodes = trunk_keys.size() - 1;
  std::vector<std::uint8_t> levels(nodes);
  stages::essential_nodes(executor, trunk_keys, levels);
  out.children.resize(2 * nodes);
  out.root = stages::path_compression(executor, trunk_keys, levels, out.children);
  out.axes.resize(nodes);
  out.planes.resize(nodes);
  stages::split_planes(executor, trunk_keys, levels, trunk_crowd, out.lattice, lattices, out.axes,
                       out.planes);

  const stages::Skeleton skeleton{
      out.ids,   std::span(out.first).first(nodes + 1), levels, out.children, out.root, out.axes,
      out.planes};
  out.leaf_offsets.resize(nodes + 2);
  const std::uint64_t references =
      stages::list_references(executor, triangles, out.boxes, skeleton, out.lattice,
                              options.references, out.leaf_offsets, {});
  out.references.resize(references);
  EXPECT_EQ(stages::list_references(executor, triangles, out.boxes, skeleton, out.lattice,
                                    options.references, out.leaf_offsets, out.references),
            references);
  out.nodes.resize(nodes);
  stages::tight_boxes(executor, out.boxes, skeleton, options.references, out.leaf_offsets,
                      out.references, out.nodes);
  return out;
}

void expect_equals_composition(const TriangleView& triangles, const BuildOptions& options) {
  const Composition want = compose(triangles, options);
  const Tree tree = build({.threads = 2}, triangles, options);
  const TreeView& view = tree.view();
  ASSERT_EQ(view.leaf_count(), want.first.size() - 1);
  EXPECT_TRUE(view.root() == want.root);
  EXPECT_EQ(tree.statistics().crowded_trunks, want.crowded);
  for (std::uint32_t leaf = 0; leaf <= view.leaf_count(); ++leaf) {
    ASSERT_EQ(view.leaf_offsets[leaf], want.leaf_offsets[leaf]) << "leaf " << leaf;
    if (options.references == References::once) {
      ASSERT_EQ(view.leaf_offsets[leaf], want.first[leaf]) << "leaf " << leaf;
    }
  }
  ASSERT_EQ(view.reference_count(), want.references.size());
  for (std::uint32_t i = 0; i < view.reference_count(); ++i) {
    ASSERT_EQ(view.references[i], want.references[i]) << "reference " << i;
  }
  for (std::uint32_t j = 0; j < view.node_count(); ++j) {
    ASSERT_EQ(std::memcmp(&view.nodes[j], &want.nodes[j], sizeof(Node)), 0) << "node " << j;
  }
  for (std::uint32_t j = 0; j < view.node_count(); ++j) {
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

TEST(TreeBuild, GivesTheBytesOfTheStages) {
  for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
    const test::NamedMesh m = test::small_mesh(kind, 1);
    for (const std::uint32_t code_bits : {0u, 6u, 16u, 64u}) {
      for (const std::uint32_t leaf_size : {1u, 4u}) {
        for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
          for (const bool recode : {true, false}) {
            SCOPED_TRACE(m.name + ", " + std::to_string(code_bits) + " bits, leaf size " +
                         std::to_string(leaf_size) + ", " + to_string(order) +
                         (recode ? "" : ", not coded again"));
            for (const References references : {References::once, References::all})
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

TEST(TreeBuild, GivesTheBytesOfTheStagesOnLargerScenes) {
  expect_equals_composition(scene::soup(50000, 2).view(), {});
  expect_equals_composition(scene::soup(50000, 2).view(), {.references = References::all});
  expect_equals_composition(scene::small_in_large(20000, 1e4F, 2).view(), {});
  expect_equals_composition(scene::sphere(6).view(), {.code_bits = 64});
}

// ---- Properties ---------------------------------------------------------------------------------

class TreeProperties : public testing::TestWithParam<test::MeshKind> {};

TEST_P(TreeProperties, HoldForEveryOption) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    for (const References references : {References::once, References::all}) {
      for (const std::uint32_t leaf_size : {1u, 2u, 4u, 16u}) {
        for (const std::uint32_t code_bits : {3u, 16u, 32u, 64u}) {
          for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
            for (const bool recode : {true, false}) {
              const Tree tree = build({.threads = 2}, m.mesh.view(),
                                      {.references = references,
                                       .leaf_size = leaf_size,
                                       .code_bits = code_bits,
                                       .axis_order = order,
                                       .recode_crowded = recode,
                                       .invalid_triangles = InvalidTriangles::skip});
              for (const std::string& violation : verify::check_tree(tree, m.mesh.view())) {
                ADD_FAILURE() << m.name << ", seed " << seed << ", " << to_string(references)
                              << ", leaf size " << leaf_size << ", " << code_bits << " bits, "
                              << to_string(order) << (recode ? "" : ", not coded again") << ": "
                              << violation;
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
  for (const References references : {References::once, References::all}) {
    for (const scene::Mesh& mesh : {scene::soup(20000, 3), scene::sphere(5),
                                    scene::small_in_large(5000, 1e3F, 3), scene::grid(10)}) {
      const Tree tree = build(mesh.view(), {.references = references});
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
  for (const References references : {References::once, References::all}) {
    for (const scene::Mesh* mesh : {&no_mesh, &vertices_only, &std::as_const(zero_area)}) {
      const Tree tree = build(mesh->view(), {.references = references, .measure_quality = true});
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
      EXPECT_FALSE(closest_hit(tree.view(), mesh->view(), {{0, 0, -5}}).has_value());
      EXPECT_FALSE(any_hit(tree.view(), mesh->view(), {{0, 0, -5}}));
    }
  }
}

TEST(TreeBuild, AllVerticesNaNIsAsEmpty) {
  scene::Mesh mesh = scene::soup(100, 4);
  for (glm::vec3& p : mesh.positions) p = glm::vec3(std::nanf(""));
  const Tree tree = build(mesh.view(), {.invalid_triangles = InvalidTriangles::skip});
  EXPECT_TRUE(tree.view().empty());
  EXPECT_EQ(tree.statistics().skipped_non_finite, 100u);
  EXPECT_EQ(tree_hash(tree.view()), tree_hash(Tree().view()));
}

TEST(TreeBuild, OneAndTwoTriangles) {
  const std::vector<glm::vec3> corners = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1},
                                          {8, 0, 2}, {9, 0, 2}, {8, 1, 2}};
  for (const References references : {References::once, References::all}) {
    const TriangleView one{std::span(corners).first(3)};
    const Tree first = build(one, {.references = references, .measure_quality = true});
    EXPECT_TRUE(first.view().root() == Link::leaf(0));
    EXPECT_EQ(first.view().leaf_count(), 1u);
    EXPECT_EQ(first.view().node_count(), 0u);
    EXPECT_EQ(first.leaf(0)[0], 0u);
    EXPECT_EQ(first.statistics().depth, 0u);
    EXPECT_EQ(first.statistics().sah_cost, 1.0);
    const auto hit = closest_hit(first.view(), one, {{0.25F, 0.25F, 0}});
    ASSERT_TRUE(hit.has_value());
    EXPECT_EQ(hit->t, 1.0F);
    EXPECT_EQ(hit->u, 0.25F);
    EXPECT_EQ(hit->v, 0.25F);
    EXPECT_EQ(hit->triangle, 0u);

    const TriangleView two{std::span(corners)};
    const Tree together = build(two, {.references = references, .leaf_size = 2});
    EXPECT_EQ(together.view().leaf_count(), 1u);
    EXPECT_EQ(together.view().reference_count(), 2u);
    const Tree apart = build(two, {.references = references, .leaf_size = 1});
    EXPECT_EQ(apart.view().leaf_count(), 2u);
    EXPECT_EQ(apart.view().node_count(), 1u);
    EXPECT_TRUE(apart.view().root() == Link::node(0));
    EXPECT_EQ(apart.nodes()[0].axis, 0u);
    EXPECT_GT(apart.nodes()[0].plane, 0.5F);
    EXPECT_LE(apart.nodes()[0].plane, 8.5F);
    for (const Tree* tree : {&together, &apart}) {
      const auto far = closest_hit(tree->view(), two, {{8.25F, 0.25F, 0}});
      ASSERT_TRUE(far.has_value());
      EXPECT_EQ(far->triangle, 1u);
      EXPECT_EQ(far->t, 2.0F);
    }
  }
}

// Bounded: a quadratic build would take hours.
TEST(TreeBuild, AMillionAlike) {
  const auto start = std::chrono::steady_clock::now();
  for (const References references : {References::once, References::all}) {
    const scene::Mesh identical = scene::identical(1000000);
    const Tree tree = build(identical.view(), {.references = references, .measure_quality = true});
    EXPECT_EQ(tree.view().leaf_count(), 1u);
    EXPECT_EQ(tree.statistics().largest_leaf, 1000000u);
    Ray ray;
    ray.origin = (identical.positions[0] + identical.positions[1] + identical.positions[2]) / 3.0F;
    ray.origin += glm::vec3(3, 4, 5);
    ray.direction = glm::vec3(-3, -4, -5);
    const auto hit = closest_hit(tree.view(), identical.view(), ray);
    ASSERT_TRUE(hit.has_value());
    EXPECT_EQ(hit->triangle, 0u);

    const scene::Mesh centres = scene::same_centre(1000000, 5);
    const Tree same = build(centres.view(), {.references = references});
    EXPECT_EQ(same.view().leaf_count(), 1u)
        << "equal codes that cannot be told apart stay together";
    EXPECT_EQ(same.view().reference_count() + same.statistics().skipped_zero_area, 1000000u);
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  EXPECT_LT(seconds.count(), 60.0);
}

// At the corner of the stadium, where floats are fine enough for the model at any ratio.
TEST(TreeBuild, SmallModelInALargeSceneComesApart) {
  for (const float ratio : {1e3F, 1e5F, 1e7F}) {
    const scene::Mesh mesh =
        scene::joined(scene::small_in_large(0, ratio, 6), scene::soup(20000, 6));
    for (const References references : {References::once, References::all}) {
      BuildOptions options{.references = references, .measure_quality = true};
      const Tree tree = build(mesh.view(), options);
      EXPECT_LE(tree.statistics().largest_leaf, 128u) << "ratio " << ratio;
      EXPECT_GT(tree.statistics().leaves, 5000u) << "ratio " << ratio;
      for (const std::string& violation : verify::check_tree(tree, mesh.view())) {
        ADD_FAILURE() << "ratio " << ratio << ", " << to_string(references) << ": " << violation;
      }
      if (ratio < 1e5F) continue;
      EXPECT_GE(tree.statistics().crowded_trunks, 1u);
      EXPECT_FALSE(tree.statistics().skip(Skip::recoding).taken);
      options.recode_crowded = false;
      EXPECT_GT(build(mesh.view(), options).statistics().largest_leaf, 1000u)
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
  for (const References references : {References::once, References::all}) {
    for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
      const test::NamedMesh m = test::small_mesh(kind, 7);
      SCOPED_TRACE(m.name + ", " + to_string(references));
      const BuildOptions options{.references = references,
                                 .invalid_triangles = InvalidTriangles::skip,
                                 .measure_quality = true};
      const Tree tree = build({.threads = 2}, m.mesh.view(), options);
      const Statistics& s = tree.statistics();
      std::vector<Box> boxes(m.mesh.faces.size());
      const stages::SceneSummary scene =
          stages::triangle_boxes({}, m.mesh.view(), InvalidTriangles::skip, boxes);
      EXPECT_EQ(s.triangles, m.mesh.faces.size());
      EXPECT_EQ(s.skipped_zero_area, scene.zero_area);
      EXPECT_EQ(s.skipped_non_finite, scene.non_finite);
      EXPECT_EQ(s.nodes, tree.view().node_count());
      EXPECT_EQ(s.leaves, tree.view().leaf_count());
      EXPECT_EQ(s.references, tree.view().reference_count());
      EXPECT_EQ(s.code_bits, tree.lattice().code_bits);
      EXPECT_EQ(s.skip(Skip::compaction).taken, scene.valid == m.mesh.faces.size());
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
  const Tree plain = build(mesh.view());
  EXPECT_EQ(plain.statistics().depth, 0u);
  EXPECT_EQ(plain.statistics().sah_cost, 0.0);
  EXPECT_EQ(plain.statistics().largest_leaf, 0u);
  const Tree measured = build(mesh.view(), {.measure_quality = true});
  EXPECT_GT(measured.statistics().depth, 7u);
  EXPECT_GT(measured.statistics().sah_cost, 1.0);
  EXPECT_EQ(tree_hash(measured.view()), tree_hash(plain.view()));
}

TEST(TreeBuild, SkipsAreReported) {
  const Tree flat = build(scene::flat(1000, 2, 9).view());
  EXPECT_TRUE(flat.statistics().skip(Skip::flat_axes).taken);
  EXPECT_EQ(flat.statistics().skip(Skip::flat_axes).amount, 1u);
  const Tree soup = build(scene::soup(1000, 9).view());
  EXPECT_FALSE(soup.statistics().skip(Skip::flat_axes).taken);
  EXPECT_TRUE(soup.statistics().skip(Skip::recoding).taken);
  EXPECT_TRUE(soup.statistics().skip(Skip::wide_codes).taken);
  EXPECT_TRUE(soup.statistics().skip(Skip::compaction).taken);
}

TEST(TreeBuild, OptionsAreRecordedAsChosen) {
  const Tree tree = build(scene::soup(100, 10).view(), {.leaf_size = 7});
  EXPECT_EQ(tree.options().leaf_size, 7u);
  EXPECT_EQ(tree.options().backend, Backend::cpu);
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
  const Tree below = build(mesh.view());
  ASSERT_EQ(below.view().reference_count(), threshold - 1);
  EXPECT_EQ(below.options().code_bits, 32u);

  mesh.faces.insert(mesh.faces.end(), 10, glm::uvec3(3, 3, 3));
  const Tree with_invalid = build(mesh.view());
  EXPECT_EQ(with_invalid.options().code_bits, 32u);
  EXPECT_EQ(tree_hash(with_invalid.view()), tree_hash(below.view()));

  mesh.faces.back() = shapes[0];
  EXPECT_EQ(build(mesh.view()).options().code_bits, 64u);
}

}  // namespace
}  // namespace zkd
