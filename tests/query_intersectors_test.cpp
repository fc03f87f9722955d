// SPDX-License-Identifier: Apache-2.0
//
// The choice of the intersector: that each is what it says. Each against brute force is in
// query_brute_force_test.cpp, each against exact arithmetic in query_oracle_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include <zkd/zkd.hpp>

#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"

namespace zkd {
namespace {

using test::print;
using test::same_bits;

BuildOptions skipping() {
  BuildOptions options;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

class QueryIntersectors : public testing::TestWithParam<test::MeshKind> {};

// The filter in single precision never rejects what double precision would accept.
TEST_P(QueryIntersectors, WatertightIsDoublePrecision) {
  for (std::uint64_t seed = 200; seed < 206; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    const test::PlatformTree tree(m.mesh.view(), skipping());
    const std::vector<Ray> rays = test::RayMaker(m.mesh, tree.host().view(), seed).all_kinds(2400);
    const std::vector<Hit> filtered = tree.closest_hits(rays);
    const std::vector<Hit> all =
        tree.closest_hits(rays, test::Walk::automatic, nullptr, Intersector::double_precision);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_TRUE(same_bits(filtered[i], all[i]))
          << "seed " << seed << ", ray " << i << " " << print(rays[i]) << ": " << print(filtered[i])
          << " instead of " << print(all[i]);
    }
  }
}

// The point of a hit, in double.
glm::dvec3 point_of(const TriangleView& triangles, const Hit& hit) {
  const auto corner = [&](int c) {
    const float* p = triangles.position(triangles.index(hit.triangle, c));
    return glm::dvec3(p[0], p[1], p[2]);
  };
  const auto u = static_cast<double>(hit.u);
  const auto v = static_cast<double>(hit.v);
  return corner(0) + u * (corner(1) - corner(0)) + v * (corner(2) - corner(0));
}

double largest_coordinate(const TriangleView& triangles, std::uint32_t triangle) {
  double largest = 0.0;
  for (int c = 0; c < 3; ++c) {
    const float* p = triangles.position(triangles.index(triangle, c));
    for (int a = 0; a < 3; ++a) largest = std::max(largest, std::abs(static_cast<double>(p[a])));
  }
  return largest;
}

// Any direction, and those next to the triangle's plane that rounding can turn to either side.
glm::vec3 leaving(const TriangleView& triangles, std::uint32_t triangle, test::Random& random) {
  const auto corner = [&](int c) {
    const float* p = triangles.position(triangles.index(triangle, c));
    return glm::vec3(p[0], p[1], p[2]);
  };
  glm::vec3 direction = random.in_cube();
  if (random.one_in(2)) {
    const float along = 2.0F * random.unit() - 1.0F;
    direction = (corner(1) - corner(0)) * along + (corner(2) - corner(0)) * random.unit();
    for (int a = 0; a < 3; ++a) direction[a] = test::ulps(direction[a], random.integer(-2, 2));
  }
  if (direction == glm::vec3(0.0F)) direction.x = 1.0F;
  return direction;
}

TEST_P(QueryIntersectors, RaysThatLeaveATriangleDoNotHitItAgain) {
  std::uint64_t spawned = 0;
  for (std::uint64_t seed = 210; seed < 214; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    const TriangleView triangles = m.mesh.view();
    const test::PlatformTree tree(triangles, skipping());
    const std::vector<Ray> rays = test::RayMaker(m.mesh, tree.host().view(), seed).all_kinds(1200);
    test::Random random(seed);
    for (const Intersector intersector : test::intersectors()) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", " + to_string(intersector));
      const std::vector<Hit> hits =
          tree.closest_hits(rays, test::Walk::automatic, nullptr, intersector);
      for (const Hit& hit : hits) {
        if (!test::is_hit(hit)) continue;
        Ray ray;
        ray.direction = leaving(triangles, hit.triangle, random);
        ray.origin = offset_origin(triangles, hit, ray.direction, intersector);
        // Against this triangle alone, so that no other one hides it.
        const glm::uvec3 face{triangles.index(hit.triangle, 0), triangles.index(hit.triangle, 1),
                              triangles.index(hit.triangle, 2)};
        const TriangleView alone(m.mesh.positions, std::span(&face, 1));
        std::vector<Hit> again(1);
        closest_hit_brute_force(cpu::Executor{.threads = 1}, tree.host().view(), alone,
                                std::span(&ray, 1), again, intersector);
        ASSERT_FALSE(test::is_hit(again[0]))
            << print(hit) << " is hit again at t " << again[0].t << " by " << print(ray);
        ++spawned;

        const double margin =
            intersector == Intersector::fast || intersector == Intersector::single_precision
                ? 0x1p-16
                : 0x1p-46;
        const double largest = largest_coordinate(triangles, hit.triangle);
        const glm::dvec3 point = point_of(triangles, hit);
        for (int a = 0; a < 3; ++a) {
          const auto at = static_cast<double>(ray.origin[a]);
          const auto gap = [at](float next) { return std::abs(static_cast<double>(next) - at); };
          const double next =
              std::max(gap(test::ulps(ray.origin[a], 1)), gap(test::ulps(ray.origin[a], -1)));
          if (std::isfinite(next)) {
            ASSERT_LE(std::abs(at - point[a]), 1.001 * (margin * largest + next))
                << print(hit) << ", axis " << a;
          }
        }
      }
    }
  }
  RecordProperty("spawned", std::to_string(spawned));
}

INSTANTIATE_TEST_SUITE_P(Every, QueryIntersectors, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

TEST(OffsetOrigin, GoesToTheSideOfTheDirection) {
  const std::vector<glm::vec3> corners = {{0, 0, 3}, {1, 0, 3}, {0, 1, 3}};
  const TriangleView triangles{corners};
  const Hit hit{1.0F, 0.25F, 0.25F, 0};
  EXPECT_EQ(offset_origin(triangles, hit, {1, 0, 1}), glm::vec3(0.25F, 0.25F, test::ulps(3, 1)));
  EXPECT_EQ(offset_origin(triangles, hit, {1, 0, -1}), glm::vec3(0.25F, 0.25F, test::ulps(3, -1)));
}

TEST(OffsetOrigin, AFloorAtZeroMovesByLessThanAnUlpOfTheRoom) {
  const std::vector<glm::vec3> corners = {{-8, 0, -8}, {8, 0, -8}, {0, 0, 8}};
  const glm::vec3 up = offset_origin(TriangleView{corners}, {1.0F, 0.3F, 0.3F, 0}, {0, 1, 0});
  EXPECT_GT(up.y, 0.0F);
  EXPECT_LE(up.y, 8.0F * 0x1p-45F);
}

// An origin so far away that a double cannot tell two points of the scene apart.
TEST(QueryFarOrigins, BeyondWhatADoubleResolves) {
  const scene::Mesh mesh = scene::sphere(3);
  const test::PlatformTree tree(mesh.view());
  std::vector<Ray> near;
  std::vector<Ray> far;
  for (const float distance : {1e8F, 1e17F, 1e25F, 1e35F}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < 20; ++i) {
        Ray ray;
        // Through the inside of triangles: an edge may be anybody's.
        ray.origin = {0.0213F * static_cast<float>(i) + 0.0071F,
                      -0.0137F * static_cast<float>(i) - 0.0053F, 0.11F};
        ray.origin[axis] = -4.0F;
        ray.direction = glm::vec3(0.0F);
        ray.direction[axis] = 1.0F;
        near.push_back(ray);
        ray.origin[axis] = -distance;
        far.push_back(ray);
      }
    }
    // Through the centre, by an origin that is a multiple of the direction.
    Ray ray;
    ray.direction = {0.3F, -0.7F, 0.2F};
    ray.origin = ray.direction * -8.0F;
    near.push_back(ray);
    ray.origin = ray.direction * -std::ldexp(1.0F, static_cast<int>(std::log2(distance)));
    far.push_back(ray);
  }
  for (const Intersector intersector : test::intersectors()) {
    SCOPED_TRACE(to_string(intersector));
    const auto closest = [&](const std::vector<Ray>& rays) {
      return tree.closest_hits(rays, test::Walk::automatic, nullptr, intersector);
    };
    const std::vector<Hit> want = closest(near);
    const std::vector<Hit> hits = closest(far);
    for (std::size_t i = 0; i < far.size(); ++i) {
      ASSERT_TRUE(test::is_hit(want[i]));
      EXPECT_EQ(hits[i].triangle, want[i].triangle) << print(far[i]);
      EXPECT_NEAR(hits[i].u, want[i].u, 1e-4) << print(far[i]);
      EXPECT_NEAR(hits[i].v, want[i].v, 1e-4) << print(far[i]);
    }
  }
}

// The answer of Intersector::exact has no part in the rounding of a moved origin.
TEST(QueryExact, FromAMovedOrigin) {
  const std::vector<glm::vec3> corners = {{0.75F, -1.0F, -0x1p-44F}, {0.75F, 1.0F, -0x1p-44F},
                                          {0.75F, 0.0F, 0x1p-44F},   {0.75F, -1.0F, 0x1p-41F},
                                          {0.75F, -1.0F, 0.0F},      {0.75F, -0.9F, 0.0F}};
  const TriangleView triangles{corners};
  const Tree tree = build(triangles);
  Ray ray;
  ray.origin = {0.75F - 0x1p-9F, 0.1F, -16.0F};
  ray.direction = {0x1p-13F, 0.0F, 1.0F};
  const auto hit = closest_hit(tree.view(), triangles, ray, Intersector::exact);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->triangle, 0u);
  EXPECT_EQ(hit->t, 16.0F);
}

// A small triangle whose products single precision loses and a large one that shares its edge must
// be told apart by the same points.
TEST(QuerySinglePrecision, SmallAndLargeNeighboursDoNotLeak) {
  const glm::vec3 p = {-0x1.8b6ceap-42F, -0x1.3fa1a2p-42F, 0.0F};
  const glm::vec3 q = {0x1.d78fa8p-42F, 0x1.16f4d2p-42F, 0.0F};
  const std::vector<glm::vec3> corners = {p, q, {-1, 0, 0}, q, p, {3 * 0x1p-41F, 0, 0}};
  const TriangleView triangles{corners};
  const Tree tree = build(triangles);
  test::Random random(7);
  std::vector<Ray> rays;
  for (int i = 0; i < 200000; ++i) {
    Ray ray;
    ray.origin = random.in_cube() * 0x1p-40F;
    ray.origin.z = -1.0F;
    const glm::vec3 target = p + random.unit() * (q - p);
    ray.direction = {target.x - ray.origin.x, target.y - ray.origin.y, 1.0F};
    rays.push_back(ray);
  }
  std::vector<Hit> hits(rays.size());
  for (const Intersector intersector : {Intersector::watertight, Intersector::single_precision}) {
    closest_hit(cpu::Executor{}, tree.view(), triangles, rays, hits, {}, intersector);
    EXPECT_EQ(
        std::count_if(hits.begin(), hits.end(), [](const Hit& hit) { return !test::is_hit(hit); }),
        0)
        << to_string(intersector);
  }
}

// What a scene of large coordinates is scaled by takes digits off small ones. Found by fuzzing.
TEST(OffsetOrigin, TrianglesMuchSmallerThanTheirScene) {
  for (const int exponent : {-26, -16, 0, 32, 33, 127}) {
    const float scene = std::ldexp(1.0F, exponent);
    const float m = 0x1p-100F * scene;
    const std::vector<glm::vec3> corners = {{m, 0, 0},     {0, m, 0},     {0, 0, m},
                                            {scene, 0, 0}, {0, scene, 0}, {0, 0, scene}};
    const Tree tree = build(TriangleView{corners});
    const TriangleView small{std::span(corners).first(3)};
    for (const Intersector intersector : test::intersectors()) {
      for (const glm::vec3& at : {glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, 1)}) {
        for (const glm::vec3& direction : {glm::vec3(m), glm::vec3(-m), glm::vec3(m, 2 * m, -m)}) {
          Ray ray;
          ray.direction = direction;
          ray.origin = offset_origin(small, {0.0F, at.y, at.z, 0}, direction, intersector);
          std::vector<Hit> again(1);
          closest_hit_brute_force({.threads = 1}, tree.view(), small, std::span(&ray, 1), again,
                                  intersector);
          EXPECT_FALSE(test::is_hit(again[0]))
              << to_string(intersector) << ", scene 2^" << exponent << ", " << print(ray);
        }
      }
    }
  }
}

TEST(OffsetOrigin, StaysAFloatAtTheEndOfFloats) {
  constexpr float most = std::numeric_limits<float>::max();
  const std::vector<glm::vec3> corners = {{most, 0, 0}, {most, 1e38F, 0}, {most, 0, 1e38F}};
  const glm::vec3 at = offset_origin(TriangleView{corners}, {1.0F, 0.25F, 0.25F, 0}, {1, 0, 0});
  EXPECT_EQ(at.x, most);
}

}  // namespace
}  // namespace zkd
