// SPDX-License-Identifier: Apache-2.0
//
// The walk that reports all hits in order, with hardly any memory: however few hits it keeps and
// however few boxes it takes in order, the list is the same.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <zkd/cuda/device.hpp>
#include <zkd/traversal/all_hits.hpp>
#include <zkd/zkd.hpp>

#include "core/exact/intersect.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/rays.hpp"

namespace zkd {
namespace {

using test::print;
using test::same_bits;

template <std::uint32_t size, std::uint32_t ordered, class Boxes, class Intersect>
std::vector<Hit> all_hits(const Tree& tree, const TriangleView& triangles, const Ray& ray,
                          core::AllHitsCost* cost = nullptr) {
  std::vector<Hit> hits;
  const auto visit = [&](const auto& found) {
    hits.push_back(core::to_hit(found));
    return true;
  };
  const core::AllHitsCost spent =
      core::for_each_hit<size, ordered, Boxes, Intersect>(tree.view(), triangles, ray, visit);
  if (cost != nullptr) *cost = spent;
  return hits;
}

// With each size, against the library's own walk, which keeps many; the Intersector is the one that
// `Intersect` is the code of.
template <class Boxes, class Intersect>
void expect_same_lists(const Tree& tree, const TriangleView& triangles, std::span<const Ray> rays,
                       Intersector intersector) {
  SCOPED_TRACE(to_string(intersector));
  for (const Ray& ray : rays) {
    std::vector<Hit> want;
    for_each_hit(
        tree.view(), triangles, ray, [&](const Hit& hit) { want.push_back(hit); }, intersector);
    // A few dozen fill the few places many times over; each more is another loop over the scene.
    if (intersector == Intersector::exact && want.size() > 40) continue;
    const auto expect_same = [&](const char* sizes, const std::vector<Hit>& got) {
      ASSERT_EQ(got.size(), want.size()) << sizes << ", " << print(ray);
      for (std::size_t i = 0; i < want.size(); ++i) {
        ASSERT_TRUE(same_bits(got[i], want[i]))
            << sizes << ", hit " << i << " of " << print(ray) << ": " << print(got[i])
            << " instead of " << print(want[i]);
      }
    };
    expect_same("1, 1", all_hits<1, 1, Boxes, Intersect>(tree, triangles, ray));
    expect_same("1, 32", all_hits<1, 32, Boxes, Intersect>(tree, triangles, ray));
    expect_same("2, 2", all_hits<2, 2, Boxes, Intersect>(tree, triangles, ray));
    expect_same("3, 8", all_hits<3, 8, Boxes, Intersect>(tree, triangles, ray));
    expect_same("8, 16", all_hits<8, 16, Boxes, Intersect>(tree, triangles, ray));
    expect_same("8, 1", all_hits<8, 1, Boxes, Intersect>(tree, triangles, ray));
    expect_same("64, 4", all_hits<64, 4, Boxes, Intersect>(tree, triangles, ray));
    if (testing::Test::HasFatalFailure()) return;
  }
}

class HitsKept : public testing::TestWithParam<test::MeshKind> {};

TEST_P(HitsKept, DoNotChangeTheList) {
  for (std::uint64_t seed = 30; seed < 32; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    const TriangleView triangles = m.mesh.view();
    for (const References references : {References::once, References::all}) {
      for (const std::uint32_t leaf_size : {1u, 4u, 1024u}) {
        if ((seed == 30) != (leaf_size < 1024)) continue;
        SCOPED_TRACE(m.name + ", seed " + std::to_string(seed) + ", " + to_string(references) +
                     ", leaf size " + std::to_string(leaf_size));
        BuildOptions options{.references = references, .leaf_size = leaf_size};
        options.invalid_triangles = InvalidTriangles::skip;
        const Tree tree = build(triangles, options);
        const std::vector<Ray> rays = scene::hard_rays(m.mesh, tree.view(), 32, seed);
        const std::span few = std::span(rays).first(8);  // exact arithmetic is slow
        expect_same_lists<core::BoxTest, core::Watertight>(tree, triangles, rays,
                                                           Intersector::watertight);
        expect_same_lists<core::FusedBoxTest, core::Fast>(tree, triangles, rays, Intersector::fast);
        if (seed == 30 && leaf_size == 4)
          expect_same_lists<core::BoxTest, core::ExactIntersect>(tree, triangles, few,
                                                                 Intersector::exact);
        if (HasFatalFailure()) return;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, HitsKept, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

// ---- What it costs ------------------------------------------------------------------------------

// A walk begins again only where hits are crowded, and reports as many as it keeps.
TEST(HitsKeptCost, WalksAreAsManyAsSaid) {
  const scene::Mesh mesh = scene::identical(1000);
  const Tree tree = build(mesh.view());
  Ray ray;
  const glm::uvec3 face = mesh.faces[0];
  const glm::vec3 middle =
      (mesh.positions[face.x] + mesh.positions[face.y] + mesh.positions[face.z]) / 3.0F;
  ray = scene::ray_between(middle + glm::vec3(0.5F, 0.75F, 1.0F), middle);
  core::AllHitsCost cost;
  EXPECT_EQ(
      (all_hits<64, 8, core::BoxTest, core::Watertight>(tree, mesh.view(), ray, &cost)).size(),
      1000u);
  EXPECT_EQ(cost.walks, 16u);
  EXPECT_EQ(cost.triangle_tests, 16000u);
  EXPECT_EQ(
      (all_hits<1000, 8, core::BoxTest, core::Watertight>(tree, mesh.view(), ray, &cost)).size(),
      1000u);
  EXPECT_EQ(cost.walks, 1u) << "nothing was dropped";
  EXPECT_EQ(
      (all_hits<999, 8, core::BoxTest, core::Watertight>(tree, mesh.view(), ray, &cost)).size(),
      1000u);
  EXPECT_EQ(cost.walks, 2u);
}

// Hits far behind each other need no room: each is reported when the ray has come past it.
TEST(HitsKeptCost, OneWalkThroughSheetsThatAreApart) {
  const scene::Mesh mesh = scene::grid(12);
  for (const References references : {References::once, References::all}) {
    const Tree tree = build(mesh.view(), {.references = references});
    Ray ray;
    ray.origin = {-0.04F, 0.31F, 0.3F};
    ray.direction = {1.0F, 0.01F, 0.02F};
    core::AllHitsCost cost;
    const auto hits =
        all_hits<8, 16, core::BoxTest, core::Watertight>(tree, mesh.view(), ray, &cost);
    EXPECT_GE(hits.size(), 13u);
    EXPECT_EQ(cost.walks, 1u) << to_string(references);
  }
}

// The first hit alone costs about what closest_hit costs, through trees whose boxes overlap too.
TEST(HitsKeptCost, TheFirstHitCostsWhatClosestHitCosts) {
  for (const scene::Mesh& mesh : {scene::soup(5000, 41), scene::needles(400, 41), scene::grid(6)}) {
    for (const References references : {References::once, References::all}) {
      const Tree tree = build(mesh.view(), {.references = references});
      std::uint64_t closest = 0;
      std::uint64_t first = 0;
      for (const Ray& ray : scene::random_rays(tree.view().bounds(), 2000, 42)) {
        TraversalCost cost;
        (void)core::trace<false, core::BoxTest, core::Watertight>(tree.view(), mesh.view(), ray,
                                                                  &cost);
        closest += cost.node_visits + cost.triangle_tests;
        const auto visit = [](const core::Candidate&) { return false; };
        const core::AllHitsCost spent =
            core::for_each_hit<256, 32, core::BoxTest, core::Watertight>(tree.view(), mesh.view(),
                                                                         ray, visit);
        first += spent.node_visits + spent.triangle_tests;
      }
      EXPECT_LE(first, closest + closest / 4) << to_string(references);
    }
  }
}

}  // namespace
}  // namespace zkd
