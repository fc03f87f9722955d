// SPDX-License-Identifier: Apache-2.0
//
// The rules that zkd/query.hpp states: ends of the ray, ties, degenerate and coplanar rays, both
// sides, lengths of directions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
using test::ulps;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

class QueryRules : public testing::TestWithParam<References> {
 protected:
  [[nodiscard]] static test::PlatformTree tree_of(const TriangleView& triangles) {
    return test::PlatformTree(
        triangles,
        {.references = GetParam(), .leaf_size = 1, .invalid_triangles = InvalidTriangles::skip});
  }

  // Every query where the tree is, and those of zkd/query.hpp for a single ray.
  static Hit shoot(const test::PlatformTree& tree, const TriangleView& triangles, const Ray& ray) {
    const TreeView& on_host = tree.host().view();
    const Hit hit = or_miss(closest_hit(on_host, triangles, ray));
    const std::vector<Ray> one = {ray};
    EXPECT_TRUE(same_bits(tree.closest_hits(one)[0], hit)) << print(ray);
    EXPECT_TRUE(same_bits(tree.brute_force_hits(one)[0], hit)) << print(ray);
    EXPECT_EQ(tree.any_hits(one)[0], test::is_hit(hit) ? 1 : 0) << print(ray);
    EXPECT_EQ(any_hit(on_host, triangles, ray), test::is_hit(hit)) << print(ray);
    return hit;
  }
};

INSTANTIATE_TEST_SUITE_P(Every, QueryRules,
                         testing::Values(References::once, References::budget, References::all),
                         [](const auto& policy) { return std::string(to_string(policy.param)); });

// Four walls across the z axis at 1, 2, 3, 4.
std::vector<glm::vec3> walls() {
  std::vector<glm::vec3> corners;
  for (int i = 1; i <= 4; ++i) {
    const auto z = static_cast<float>(i);
    corners.insert(corners.end(), {{-4, -4, z}, {4, -4, z}, {0, 8, z}});
  }
  return corners;
}

// ---- Ends of the ray ----------------------------------------------------------------------------

TEST_P(QueryRules, EndsAreIncluded) {
  const std::vector<glm::vec3> corners = walls();
  const TriangleView view{std::span(corners)};
  const test::PlatformTree tree = tree_of(view);
  const auto nearest = [&](float t_min, float t_max) {
    return shoot(tree, view, {{0.25F, 0.5F, 0}, t_min, {0, 0, 1}, t_max}).triangle;
  };
  EXPECT_EQ(nearest(0, infinity), 0u);
  EXPECT_EQ(nearest(1, infinity), 0u);
  EXPECT_EQ(nearest(ulps(1, 1), infinity), 1u);
  EXPECT_EQ(nearest(0, 1), 0u);
  EXPECT_EQ(nearest(0, ulps(1, -1)), no_triangle);
  EXPECT_EQ(nearest(3, 3), 2u);
  EXPECT_EQ(nearest(ulps(3, 1), ulps(3, 1)), no_triangle);
  EXPECT_EQ(nearest(4, 1), no_triangle);
  EXPECT_EQ(nearest(ulps(3, 1), 3), no_triangle);
  EXPECT_EQ(nearest(4, infinity), 3u);
  EXPECT_EQ(nearest(ulps(4, 1), infinity), no_triangle);
  EXPECT_EQ(nearest(-infinity, infinity), 0u);
  EXPECT_EQ(nearest(infinity, infinity), no_triangle);
  EXPECT_EQ(nearest(-infinity, -infinity), no_triangle);
  EXPECT_EQ(nearest(-5, -1), no_triangle);
}

TEST_P(QueryRules, NegativeTIsBehindTheOriginAndAllowed) {
  const std::vector<glm::vec3> corners = walls();
  const TriangleView view{std::span(corners)};
  const test::PlatformTree tree = tree_of(view);
  const Hit behind = shoot(tree, view, {{0.25F, 0.5F, 5}, -infinity, {0, 0, 1}, infinity});
  EXPECT_EQ(behind.triangle, 0u) << "the smallest t wins, whatever its sign";
  EXPECT_EQ(behind.t, -4.0F);
  const Hit some = shoot(tree, view, {{0.25F, 0.5F, 5}, -2.5F, {0, 0, 1}, infinity});
  EXPECT_EQ(some.triangle, 2u);
  EXPECT_EQ(some.t, -2.0F);
}

TEST_P(QueryRules, OriginOnASurfaceHitsAtZero) {
  const std::vector<glm::vec3> corners = walls();
  const TriangleView view{std::span(corners)};
  const test::PlatformTree tree = tree_of(view);
  const Hit at = shoot(tree, view, {{0.25F, 0.5F, 2}, 0, {0, 0, 1}, infinity});
  EXPECT_EQ(at.triangle, 1u);
  EXPECT_EQ(at.t, 0.0F);
  const Hit next =
      shoot(tree, view, {{0.25F, 0.5F, 2}, std::numeric_limits<float>::denorm_min(), {0, 0, 1}});
  EXPECT_EQ(next.triangle, 2u);
}

// ---- Sides, edges, barycentrics -----------------------------------------------------------------

TEST_P(QueryRules, BothSidesAndTheBoundaryAreHit) {
  const std::vector<glm::vec3> corners = {{0, 0, 1}, {4, 0, 1}, {0, 4, 1}};
  const TriangleView view{std::span(corners)};
  const test::PlatformTree tree = tree_of(view);
  const struct {
    float x, y, u, v;
    bool hit;
  } points[] = {
      {1, 1, 0.25F, 0.25F, true}, {0, 0, 0, 0, true},          {4, 0, 1, 0, true},
      {0, 4, 0, 1, true},         {2, 0, 0.5F, 0, true},       {0, 2, 0, 0.5F, true},
      {2, 2, 0.5F, 0.5F, true},   {-0x1p-20F, 1, 0, 0, false}, {1, -0x1p-20F, 0, 0, false},
      {2.001F, 2, 0, 0, false},   {5, 0, 0, 0, false}};
  for (const auto& p : points) {
    for (const float side : {1.0F, -1.0F}) {
      const Ray ray{{p.x, p.y, 1 - side}, 0, {0, 0, side}, infinity};
      const Hit hit = shoot(tree, view, ray);
      ASSERT_EQ(test::is_hit(hit), p.hit) << print(ray);
      if (!p.hit) continue;
      EXPECT_EQ(hit.t, 1.0F);
      EXPECT_EQ(hit.u, p.u);
      EXPECT_EQ(hit.v, p.v);
    }
  }
}

TEST_P(QueryRules, BarycentricsAndTNameTheSamePoint) {
  const scene::Mesh mesh = scene::soup(300, 70);
  const TriangleView view = mesh.view();
  const test::PlatformTree tree = tree_of(view);
  int hits = 0;
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 2000, 70);
  const std::vector<Hit> all = tree.closest_hits(rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    const Hit& hit = all[i];
    if (!test::is_hit(hit)) continue;
    ++hits;
    EXPECT_GE(hit.u, 0.0F);
    EXPECT_GE(hit.v, 0.0F);
    EXPECT_LE(hit.u + hit.v, 1.0F + 0x1p-22F);
    const glm::uvec3& f = mesh.faces[hit.triangle];
    const glm::vec3 a = mesh.positions[f.x];
    const glm::vec3 on = a + hit.u * (mesh.positions[f.y] - a) + hit.v * (mesh.positions[f.z] - a);
    const glm::vec3 along = ray.origin + hit.t * ray.direction;
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(on[axis], along[axis], 1e-4F) << print(ray);
  }
  EXPECT_GT(hits, 1000);
}

// ---- Ties ---------------------------------------------------------------------------------------

TEST_P(QueryRules, TheLowestIdWinsTies) {
  const scene::Mesh one = scene::soup(60, 71);
  scene::Mesh mesh = one;
  for (int i = 0; i < 9; ++i) mesh = scene::joined(std::move(mesh), one);
  for (std::uint64_t shuffle = 0; shuffle < 4; ++shuffle) {
    std::vector<std::uint32_t> permutation;
    const scene::Mesh shuffled = scene::shuffled(mesh, shuffle, &permutation);
    const TriangleView view = shuffled.view();
    const test::PlatformTree tree = tree_of(view);
    std::vector<std::uint32_t> lowest(60, no_triangle);
    for (std::uint32_t i = 0; i < permutation.size(); ++i) {
      lowest[permutation[i] % 60] = std::min(lowest[permutation[i] % 60], i);
    }
    int hits = 0;
    for (const Ray& ray : scene::rays_at_features(one, 500, shuffle)) {
      const Hit hit = shoot(tree, view, ray);
      if (!test::is_hit(hit)) continue;
      ++hits;
      ASSERT_EQ(hit.triangle, lowest[permutation[hit.triangle] % 60]) << print(ray);
    }
    EXPECT_GT(hits, 250);
  }
}

TEST_P(QueryRules, SharedVertexBelongsToTheLowestId) {
  const scene::Mesh mesh = scene::fan(64);
  const TriangleView view = mesh.view();
  const test::PlatformTree tree = tree_of(view);
  for (const glm::vec3& vertex : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) {
      Ray ray;
      ray.origin = vertex;
      ray.origin[axis] = 4.0F;  // near: t is compared as it is returned
      ray.direction = glm::vec3(0);
      ray.direction[axis] = -1.0F;
      const Hit hit = shoot(tree, view, ray);
      if (!test::is_hit(hit)) continue;
      // Every triangle that is hit at the same t comes later.
      for (std::uint32_t id = 0; id < hit.triangle; ++id) {
        const glm::uvec3& f = mesh.faces[id];
        const std::vector<glm::vec3> alone = {mesh.positions[f.x], mesh.positions[f.y],
                                              mesh.positions[f.z]};
        const std::vector<Ray> rays = {ray};
        const Hit other =
            test::brute_force(tree.host().view(), TriangleView{std::span(alone)}, rays)[0];
        ASSERT_GT(other.t, hit.t) << "triangle " << id << " ties with " << hit.triangle;
      }
    }
  }
}

// ---- Rays that miss at once ---------------------------------------------------------------------

TEST_P(QueryRules, DegenerateRaysMiss) {
  const std::vector<glm::vec3> corners = walls();
  const TriangleView view{std::span(corners)};
  const test::PlatformTree tree = tree_of(view);
  const Ray good{{0.25F, 0.5F, 0}, 0, {0, 0, 1}, infinity};
  ASSERT_TRUE(test::is_hit(shoot(tree, view, good)));
  std::vector<Ray> bad;
  for (const float value : {nan_value, -nan_value, infinity, -infinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      bad.push_back(good);
      bad.back().origin[axis] = value;
      bad.push_back(good);
      bad.back().direction[axis] = value;
    }
  }
  bad.push_back(good);
  bad.back().t_min = nan_value;
  bad.push_back(good);
  bad.back().t_max = nan_value;
  bad.push_back(good);
  bad.back().direction = {0.0F, -0.0F, 0.0F};
  bad.push_back(good);
  bad.back().t_min = 5.0F;
  bad.back().t_max = 1.0F;
  std::vector<TraversalCost> costs;
  const std::vector<Hit> hits = tree.closest_hits(bad, test::Walk::automatic, &costs);
  for (std::size_t i = 0; i < bad.size(); ++i) {
    EXPECT_TRUE(same_bits(hits[i], Hit{})) << print(bad[i]) << ": " << print(hits[i]);
    EXPECT_EQ(costs[i].node_visits, 0u) << "not at once: " << print(bad[i]);
    EXPECT_EQ(costs[i].triangle_tests, 0u) << "not at once: " << print(bad[i]);
    EXPECT_FALSE(test::is_hit(shoot(tree, view, bad[i]))) << print(bad[i]);
  }
}

TEST_P(QueryRules, CoplanarRaysMiss) {
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<glm::vec3> corners = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0},
                                      {4, 4, 0}, {4, 0, 0}, {0, 4, 0}};
    for (glm::vec3& p : corners) {
      glm::vec3 q;
      q[axis] = 2.0F;
      q[(axis + 1) % 3] = p.x;
      q[(axis + 2) % 3] = p.y;
      p = q;
    }
    const TriangleView view{std::span(std::as_const(corners))};
    const test::PlatformTree tree = tree_of(view);
    test::Random random(72);
    for (int i = 0; i < 500; ++i) {
      Ray ray;
      ray.origin[axis] = 2.0F;
      ray.direction[axis] = random.one_in(2) ? 0.0F : -0.0F;
      for (int other = 1; other <= 2; ++other) {
        ray.origin[(axis + other) % 3] = static_cast<float>(random.integer(-6, 6));
        ray.direction[(axis + other) % 3] = static_cast<float>(random.integer(-3, 3));
      }
      EXPECT_FALSE(test::is_hit(shoot(tree, view, ray))) << print(ray);
    }
  }
}

TEST_P(QueryRules, LeftOutTrianglesAreNeverHit) {
  const std::vector<glm::vec3> corners = {
      {0, 0, 1},         {4, 0, 1},         {8, 0, 1},   // a line
      {0, 0, 2},         {0, 0, 2},         {0, 4, 2},   // two corners alike
      {nan_value, 0, 3}, {4, 0, 3},         {0, 4, 3},   // no number
      {-8, -8, 4},       {infinity, -8, 4}, {0, 8, 4},   // no end
      {-8, -8, 5},       {8, -8, 5},        {0, 8, 5}};  // a triangle
  const TriangleView view{std::span(corners)};
  const test::PlatformTree tree = tree_of(view);
  for (int i = 0; i <= 16; ++i) {
    const Ray ray{{static_cast<float>(i) / 4, 0, 0}, 0, {0, 0, 1}, infinity};
    EXPECT_EQ(shoot(tree, view, ray).triangle, 4u) << print(ray);
  }
}

// ---- Lengths of directions ----------------------------------------------------------------------

TEST_P(QueryRules, TScalesExactlyWithPowersOfTwoOfTheDirection) {
  const scene::Mesh mesh = scene::soup(300, 73);
  const TriangleView view = mesh.view();
  const test::PlatformTree tree = tree_of(view);
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 500, 73);
  const std::vector<Hit> at_one = tree.closest_hits(rays);
  EXPECT_GT(std::count_if(at_one.begin(), at_one.end(), test::is_hit), 250);
  for (const int e : {-66, -20, -1, 1, 10, 60}) {
    std::vector<Ray> scaled = rays;
    for (Ray& ray : scaled) ray.direction *= std::ldexp(1.0F, e);
    const std::vector<Hit> hits = tree.closest_hits(scaled);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      Hit want = at_one[i];
      want.t = std::ldexp(want.t, -e);
      ASSERT_TRUE(same_bits(hits[i], want)) << "2^" << e << ": " << print(hits[i]) << " instead of "
                                            << print(want) << ", " << print(rays[i]);
    }
  }
}

TEST_P(QueryRules, DirectionsOfAnyLengthHit) {
  const std::vector<glm::vec3> corners = walls();
  const TriangleView view{std::span(corners)};
  const test::PlatformTree tree = tree_of(view);
  for (const float length : {1e-30F, 1e-20F, 1e-10F, 3.0F, 1e10F, 1e18F, 1e30F, 1e38F}) {
    const Hit hit = shoot(tree, view, {{0.25F, 0.5F, 0}, 0, {0, 0, length}, infinity});
    EXPECT_EQ(hit.triangle, 0u) << length;
    EXPECT_NEAR(hit.t * length, 1.0F, 1e-6F) << length;
  }
}

// ---- Trees and triangles
// -------------------------------------------------------------------------

TEST_P(QueryRules, EmptyTreeMissesEverything) {
  const test::PlatformTree built = tree_of(TriangleView{});
  const test::PlatformTree brought(Tree(), TriangleView{});
  const std::vector<Ray> rays = scene::random_rays(Box{}, 100, 75);
  for (const test::PlatformTree* empty : {&built, &brought}) {
    for (const Hit& hit : empty->closest_hits(rays)) EXPECT_TRUE(same_bits(hit, Hit{}));
    for (const Hit& hit : empty->brute_force_hits(rays)) EXPECT_TRUE(same_bits(hit, Hit{}));
    for (const std::uint8_t occluded : empty->any_hits(rays)) EXPECT_EQ(occluded, 0);
  }
}

TEST_P(QueryRules, TrianglesAtOtherAddressesGiveTheSameAnswers) {
  const scene::Mesh mesh = scene::soup(300, 76);
  const test::PlatformTree tree = tree_of(mesh.view());
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 500, 76);
  const std::vector<Hit> want = tree.closest_hits(rays);
  const scene::Mesh copy = mesh;
  std::vector<float> wide(mesh.positions.size() * 5);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (int a = 0; a < 3; ++a) wide[5 * i + static_cast<std::size_t>(a)] = mesh.positions[i][a];
  }
  const TriangleView strided =
      TriangleView::strided(wide.data(), mesh.positions.size(), 20, mesh.faces);
  for (const TriangleView& view : {copy.view(), strided}) {
    const std::vector<Hit> got = test::PlatformTree(tree.host(), view).closest_hits(rays);
    for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_TRUE(same_bits(got[i], want[i]));
  }
}

}  // namespace
}  // namespace zkd
