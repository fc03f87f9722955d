// SPDX-License-Identifier: Apache-2.0
//
// Plane trees: every answer has the bits of the tree's and of a loop over all triangles, whatever
// the mesh, the ray, the intersector and the builder; they are the tree's planes and references,
// the same bytes from any number of threads; what cannot be made is one error.
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <zkd/cpu/plane_tree.hpp>
#include <zkd/zkd.hpp>

#include "scene/hard_rays.hpp"
#include "support/caught.hpp"
#include "support/memory.hpp"
#include "support/meshes.hpp"
#include "support/rays.hpp"
#include "support/tree_forms.hpp"

namespace zkd {
namespace {

using cpu::PlaneNode;
using cpu::PlaneTree;
using cpu::PlaneTreeView;
using test::Caught;
using test::same_bits;

BuildOptions strict(std::uint32_t leaf_size, Quality quality = Quality::fast) {
  BuildOptions options;
  options.quality = quality;
  options.references = References::all;
  options.leaf_size = leaf_size;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

// Strict trees of every builder.
std::vector<BuildOptions> kinds() {
  BuildOptions cells = strict(0, Quality::high);
  cells.sah.areas = SahAreas::cells;
  cells.sah.empty_bonus = 0.2F;
  return {strict(4), strict(1), strict(64), strict(8, Quality::balanced), strict(0, Quality::high),
          cells};
}

// ---- Answers ------------------------------------------------------------------------------------

class PlaneTreeAnswers : public testing::TestWithParam<test::MeshKind> {};

TEST_P(PlaneTreeAnswers, AreThoseOfTheTree) {
  const test::NamedMesh m = test::small_mesh(GetParam().number, 210);
  int kind = 0;
  for (const BuildOptions& options : kinds()) {
    SCOPED_TRACE(m.name + ", kind " + std::to_string(kind));
    const Tree tree = build(cpu::Executor{}, m.mesh.view(), options);
    const PlaneTree planes = cpu::strip_boxes({.threads = 2}, tree);
    const std::vector<Ray> rays = scene::hard_rays(m.mesh, tree.view(), 90, 210);
    // All of them on one kind of tree, two on the others.
    for (const Intersector intersector :
         std::span(test::all_intersectors)
             .first(kind++ == 0 ? std::size(test::all_intersectors) : 2)) {
      test::expect_same_answers(tree, test::PlaneForm{planes.view(), m.mesh.view()}, m.mesh.view(),
                                rays, intersector);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EveryKindOfMesh, PlaneTreeAnswers,
                         testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

// Along the planes themselves, through where they meet, and with ends on them.
TEST(PlaneTree, RaysInThePlanes) {
  for (const int exponent : {0, -100, 100}) {
    const scene::Mesh mesh = scene::scaled(scene::grid(12), exponent);
    for (const BuildOptions& options : kinds()) {
      const Tree tree = build(cpu::Executor{}, mesh.view(), options);
      const PlaneTree planes = cpu::strip_boxes({}, tree);
      test::RayMaker maker(mesh, tree.view(), 12);
      const float to_caller = 1.0F / tree.view().scale();
      std::vector<Ray> rays;
      for (std::uint32_t i = 0; i < tree.view().node_count() && rays.size() < 600; i += 3) {
        const Node& node = tree.nodes()[i];
        Ray ray = scene::ray_between(maker.around(), maker.on_face());
        const auto axis = static_cast<int>(node.axis);
        ray.origin[axis] = node.plane * to_caller;
        rays.push_back(ray);
        ray.direction[axis] = 0.0F;
        rays.push_back(ray);
        ray.direction = {0, 0, 0};
        ray.direction[(axis + 1) % 3] = i % 2 == 0 ? 1.0F : -1.0F;
        rays.push_back(ray);
      }
      for (const Intersector intersector : {Intersector::watertight, Intersector::fast}) {
        test::expect_same_answers(tree, test::PlaneForm{planes.view(), mesh.view()}, mesh.view(),
                                  rays, intersector);
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  }
}

// Shells about each other: behind the first hit there is nothing to look for.
TEST(PlaneTree, NothingBehindTheHitIsTested) {
  const scene::Mesh mesh = test::nested_shells(30, 300000);
  const Tree tree = build(mesh.view(), strict(4));
  const PlaneTree planes = cpu::strip_boxes({}, tree);
  test::RayMaker maker(mesh, tree.view(), 13);
  std::vector<Ray> rays;
  for (int i = 0; i < 300; ++i) rays.push_back(scene::ray_between(maker.around(), {0, 0, 0}));
  std::vector<Hit> hits(rays.size());
  std::vector<TraversalCost> boxes(rays.size());
  std::vector<TraversalCost> stripped(rays.size());
  closest_hit({}, tree.view(), mesh.view(), rays, hits, boxes);
  cpu::closest_hit({}, planes.view(), mesh.view(), rays, hits, stripped);
  std::uint64_t tests[2] = {0, 0};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    tests[0] += boxes[i].triangle_tests;
    tests[1] += stripped[i].triangle_tests;
  }
  EXPECT_LE(tests[1], 3 * tests[0]);
}

TEST(PlaneTree, OfNothingMissesEverything) {
  const scene::Mesh none;
  const PlaneTree planes = cpu::strip_boxes({}, build(none.view(), strict(4)));
  EXPECT_EQ(planes.bytes(), 0u);
  test::expect_misses(test::PlaneForm{planes.view(), none.view()});
  test::expect_misses(test::PlaneForm{});
}

TEST(PlaneTree, ShorterSpansEndTheWork) {
  const scene::Mesh mesh = scene::sphere(2);
  const Tree tree = build(mesh.view(), strict(4));
  const PlaneTree planes = cpu::strip_boxes({}, tree);
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 100, 75);
  test::expect_shorter_spans_end_the_work(test::PlaneForm{planes.view(), mesh.view()}, rays,
                                          test::closest(tree.view(), mesh.view(), rays));
}

// ---- What it is made of -------------------------------------------------------------------------

// Counts nodes on the way; the tree's node or leaf is what stands there.
void look_at(const Tree& tree, Link link, const PlaneTreeView& planes, std::uint32_t place,
             std::uint32_t& count) {
  ASSERT_EQ(place, count++) << "depth first";
  const PlaneNode& node = planes.nodes[place];
  ASSERT_EQ(node.is_leaf(), link.is_leaf());
  if (link.is_leaf()) {
    const auto leaf = tree.leaf(link.index());
    ASSERT_EQ(node.above_or_count(), leaf.size());
    for (std::uint32_t i = 0; i < leaf.size(); ++i)
      ASSERT_EQ(planes.references[node.value + i], leaf[i]);
    return;
  }
  const Node& want = tree.nodes()[link.index()];
  ASSERT_EQ(std::bit_cast<float>(node.value), want.plane);
  ASSERT_EQ(node.axis(), want.axis);
  look_at(tree, want.child[0], planes, place + 1, count);
  if (testing::Test::HasFatalFailure()) return;
  look_at(tree, want.child[1], planes, node.above_or_count(), count);
}

TEST(PlaneTree, IsThePlanesOfTheTreeFromAnyThreads) {
  const scene::Mesh mesh =
      scene::joined(scene::soup(40'000, 9), scene::small_in_large(10'000, 1e4F, 4));
  for (const BuildOptions& options : {strict(4), strict(1), strict(0, Quality::high)}) {
    const Tree tree = build(cpu::Executor{}, mesh.view(), options);
    const PlaneTree want = cpu::strip_boxes({.threads = 1}, tree);
    std::uint32_t count = 0;
    look_at(tree, tree.view().root(), want.view(), 0, count);
    if (testing::Test::HasFatalFailure()) return;
    EXPECT_EQ(count, want.view().node_count());
    EXPECT_LE(want.bytes(), 16u * tree.view().leaf_count() + 4u * tree.references().size() + 256);
    for (const int threads : {2, 3, 7}) {
      const PlaneTree got = cpu::strip_boxes({.threads = threads}, tree);
      ASSERT_EQ(got.bytes(), want.bytes());
      EXPECT_EQ(std::memcmp(got.view().nodes, want.view().nodes, count * sizeof(PlaneNode)), 0);
      EXPECT_EQ(
          std::memcmp(got.view().references, want.view().references, 4 * tree.references().size()),
          0);
    }
  }
}

TEST(PlaneTree, NeedsNoTreeAndMoves) {
  const scene::Mesh mesh = scene::sphere(3);
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 300, 8);
  std::vector<Hit> want;
  PlaneTree planes;
  {
    const Tree tree = build(mesh.view(), strict(4));
    want = test::closest(tree.view(), mesh.view(), rays);
    planes = cpu::strip_boxes({}, tree);
  }
  const PlaneTree moved = std::move(planes);
  EXPECT_FALSE(
      cpu::any_hit(planes.view(), mesh.view(), rays[0]));  // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(planes.bytes(), 0u);
  std::vector<Hit> hits(rays.size());
  cpu::closest_hit({}, moved.view(), mesh.view(), rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_TRUE(same_bits(hits[i], want[i]));
}

// ---- Memory and errors --------------------------------------------------------------------------

TEST(PlaneTree, MemoryIsTheExecutorsAndGoesBack) {
  const scene::Mesh mesh = scene::soup(30'000, 6);
  const Tree tree = build(mesh.view(), strict(4));
  std::size_t allocations = 0;
  {
    test::CountingResource memory;
    {
      const PlaneTree planes = cpu::strip_boxes({.threads = 2, .memory = &memory}, tree);
      EXPECT_EQ(memory.live_bytes(), planes.bytes());
      EXPECT_LE(memory.peak_bytes(), planes.bytes() + 512 * 1024);
      allocations = memory.allocations();
      EXPECT_GT(allocations, 0u);
    }
    EXPECT_EQ(memory.live_bytes(), 0u);
    EXPECT_FALSE(memory.misused());
  }
  for (std::size_t at = 1; at <= allocations; ++at) {
    test::CountingResource memory;
    memory.refuse_at = at;
    const Caught error =
        test::caught([&] { (void)cpu::strip_boxes({.threads = 2, .memory = &memory}, tree); });
    ASSERT_TRUE(error.thrown) << at;
    EXPECT_EQ(error.code, ErrorCode::out_of_memory);
    EXPECT_EQ(memory.live_blocks(), 0u);
  }
}

TEST(PlaneTree, RefusesTreesWhoseCellsDoNotHoldTheirTriangles) {
  const scene::Mesh mesh = scene::soup(3000, 6);
  for (const References references : {References::once, References::budget}) {
    const Tree tree = build(mesh.view(), {.references = references});
    const Caught error = test::caught([&] { (void)cpu::strip_boxes({}, tree); });
    ASSERT_TRUE(error.thrown);
    EXPECT_EQ(error.code, ErrorCode::unsupported_option);
  }
  const Tree tree = build(mesh.view(), strict(4));
  const Caught threads = test::caught([&] { (void)cpu::strip_boxes({.threads = -1}, tree); });
  EXPECT_TRUE(threads.thrown && threads.code == ErrorCode::invalid_option);
}

}  // namespace
}  // namespace zkd
