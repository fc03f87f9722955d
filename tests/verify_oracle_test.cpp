// SPDX-License-Identifier: Apache-2.0
//
// The oracle itself: against Cramer's rule in integers, its box tree against its loop, and answers
// known beforehand.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "scene/generate.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include "verify/oracle.hpp"

namespace zkd::verify {
namespace {

using Ids = std::vector<std::uint32_t>;
using Vector = std::array<std::int64_t, 3>;

constexpr float float_infinity = std::numeric_limits<float>::infinity();

Vector integers(const glm::vec3& v) {
  return {static_cast<std::int64_t>(v.x), static_cast<std::int64_t>(v.y),
          static_cast<std::int64_t>(v.z)};
}

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

// Determinant of three columns, by the rule of Sarrus.
std::int64_t columns(const Vector& a, const Vector& b, const Vector& c) {
  return a[0] * b[1] * c[2] + b[0] * c[1] * a[2] + c[0] * a[1] * b[2] - c[0] * b[1] * a[2] -
         b[0] * a[1] * c[2] - a[0] * c[1] * b[2];
}

// The nearest hit by Cramer's rule: o + t d = a + u (b - a) + v (c - a), all in integers.
struct Plain {
  bool hit = false;
  std::int64_t n = 0;  // t = n / d, d > 0
  std::int64_t d = 1;
  Ids ties;
  bool interior = false;
  bool vertex = false;
};

Plain cramer(const scene::Mesh& mesh, const Ray& ray) {
  Plain nearest;
  const Vector o = integers(ray.origin);
  const Vector d = integers(ray.direction);
  for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) {
    const Vector a = integers(mesh.positions[mesh.faces[i].x]);
    const Vector ab = minus(integers(mesh.positions[mesh.faces[i].y]), a);
    const Vector ac = minus(integers(mesh.positions[mesh.faces[i].z]), a);
    const Vector back = {-d[0], -d[1], -d[2]};
    const Vector ao = minus(o, a);
    std::int64_t whole = columns(ab, ac, back);
    std::int64_t u = columns(ao, ac, back);
    std::int64_t v = columns(ab, ao, back);
    std::int64_t t = columns(ab, ac, ao);
    if (whole == 0) continue;
    if (whole < 0) {
      whole = -whole;
      u = -u;
      v = -v;
      t = -t;
    }
    if (u < 0 || v < 0 || u + v > whole) continue;
    const auto [t_min, t_max] = std::pair(ray.t_min, ray.t_max);
    // The ends are integers or infinite here.
    if (std::isfinite(t_min) && t < static_cast<std::int64_t>(t_min) * whole) continue;
    if (std::isfinite(t_max) && t > static_cast<std::int64_t>(t_max) * whole) continue;
    const std::int64_t order = nearest.hit ? t * nearest.d - nearest.n * whole : -1;
    if (order > 0) continue;
    if (order < 0) nearest = {true, t, whole, {}, false, false};
    nearest.ties.push_back(i);
    const int zeros = (u == 0) + (v == 0) + (u + v == whole);
    nearest.interior = nearest.interior || zeros == 0;
    nearest.vertex = nearest.vertex || zeros == 2;
  }
  return nearest;
}

TEST(VerifyOracle, EqualsCramersRuleOnSmallIntegers) {
  test::Random random(11);
  std::uint64_t classes[4] = {};
  for (std::uint64_t round = 0; round < 60; ++round) {
    const int width = 1 + static_cast<int>(round % 4);
    const scene::Mesh mesh =
        test::integer_mesh(10 + 5 * static_cast<std::uint32_t>(round % 6), width, 100 + round);
    const Oracle loop(mesh.view(), Oracle::Search::brute_force);
    const Oracle tree(mesh.view(), Oracle::Search::box_tree);
    for (int i = 0; i < 400; ++i) {
      Ray ray;
      for (int axis = 0; axis < 3; ++axis) {
        ray.origin[axis] = static_cast<float>(random.integer(-2 * width, 2 * width));
        ray.direction[axis] = static_cast<float>(random.integer(-3, 3));
      }
      ray.t_min = random.one_in(3) ? static_cast<float>(random.integer(-2, 1)) : 0.0F;
      if (random.one_in(3)) ray.t_max = ray.t_min + static_cast<float>(random.integer(0, 2));
      if (random.one_in(9)) ray.t_min = -float_infinity;
      const Plain want = cramer(mesh, ray);
      for (const Oracle* oracle : {&loop, &tree}) {
        const ExactHit got = oracle->closest_hit(ray);
        ASSERT_EQ(got.hit, want.hit) << round << ", " << i;
        ASSERT_EQ(got.ties, want.ties) << round << ", " << i;
        ASSERT_EQ(oracle->any_hit(ray), want.hit);
        if (!want.hit) continue;
        ASSERT_EQ(got.t, static_cast<double>(want.n) / static_cast<double>(want.d));
        const HitClass kind =
            want.interior ? (want.ties.size() > 1 ? HitClass::duplicate : HitClass::interior)
            : want.vertex ? HitClass::vertex
                          : HitClass::edge;
        ASSERT_EQ(got.hit_class, kind);
        ++classes[static_cast<std::size_t>(kind)];
      }
    }
  }
  for (const std::uint64_t count : classes) EXPECT_GT(count, 100u);
}

// All the hard meshes and rays there are, far, tiny, huge and flat.
TEST(VerifyOracle, TheBoxTreeLosesNothing) {
  std::uint64_t hits = 0;
  for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
    const test::NamedMesh named = test::small_mesh(kind, 7);
    TreeHeader header;
    header.bounds = scene::bounds(named.mesh);
    test::RayMaker maker(named.mesh, TreeView{&header}, static_cast<std::uint64_t>(kind));
    const Oracle loop(named.mesh.view(), Oracle::Search::brute_force);
    const Oracle tree(named.mesh.view(), Oracle::Search::box_tree);
    for (const Ray& ray : maker.all_kinds(240)) {
      const ExactHit want = loop.closest_hit(ray);
      const ExactHit got = tree.closest_hit(ray);
      ASSERT_EQ(got.ties, want.ties) << named.name;
      ASSERT_EQ(got.t, want.t) << named.name;
      ASSERT_EQ(got.hit_class, want.hit_class) << named.name;
      ASSERT_EQ(tree.any_hit(ray), want.hit) << named.name;
      ASSERT_EQ(tree.all_hits(ray), loop.all_hits(ray)) << named.name;
      hits += want.hit;
    }
  }
  EXPECT_GT(hits, 2000u);
}

TEST(VerifyOracle, ALargeSceneEqualsItsLoopOnSamples) {
  const scene::Mesh mesh = scene::sphere(5);
  ASSERT_GT(mesh.faces.size(), 10000u);
  TreeHeader header;
  header.bounds = scene::bounds(mesh);
  test::RayMaker maker(mesh, TreeView{&header}, 3);
  const Oracle loop(mesh.view(), Oracle::Search::brute_force);
  const Oracle automatic(mesh.view());
  for (const Ray& ray : maker.all_kinds(120)) {
    const ExactHit want = loop.closest_hit(ray);
    const ExactHit got = automatic.closest_hit(ray);
    ASSERT_EQ(got.ties, want.ties);
    ASSERT_EQ(got.t, want.t);
  }
}

// Four triangles round the origin in the plane z = 0, one far behind.
scene::Mesh star() {
  scene::Mesh mesh;
  mesh.positions = {{0, 0, 0},  {1, 0, 0},  {0, 1, 0},   {-1, 0, 0},
                    {0, -1, 0}, {9, 9, -1}, {-9, 9, -1}, {0, -9, -1}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}, {5, 6, 7}};
  return mesh;
}

Ray down(float x, float y) {
  Ray ray;
  ray.origin = {x, y, 2};
  ray.direction = {0, 0, -2};
  return ray;
}

TEST(VerifyOracle, TiesAndClasses) {
  const scene::Mesh mesh = star();
  const Oracle oracle(mesh.view());
  ExactHit hit = oracle.closest_hit(down(0.25F, 0.25F));
  EXPECT_EQ(hit.ties, Ids({0}));
  EXPECT_EQ(hit.hit_class, HitClass::interior);
  EXPECT_EQ(hit.t, 1.0);
  hit = oracle.closest_hit(down(0, 0.5F));
  EXPECT_EQ(hit.ties, Ids({0, 1}));
  EXPECT_EQ(hit.hit_class, HitClass::edge);
  hit = oracle.closest_hit(down(0, 0));
  EXPECT_EQ(hit.ties, Ids({0, 1, 2, 3}));
  EXPECT_EQ(hit.hit_class, HitClass::vertex);
  hit = oracle.closest_hit(down(0.5F, 0.5F));  // the rim, one triangle only
  EXPECT_EQ(hit.ties, Ids({0}));
  EXPECT_EQ(hit.hit_class, HitClass::edge);
  hit = oracle.closest_hit(down(0.75F, 0.5F));  // past the rim
  EXPECT_EQ(hit.ties, Ids({4}));
  EXPECT_EQ(hit.t, 1.5);
  EXPECT_EQ(oracle.all_hits(down(0, 0)), Ids({0, 1, 2, 3, 4}));

  scene::Mesh twice = mesh;
  twice.faces.push_back(mesh.faces[0]);
  const Oracle doubled(twice.view());
  hit = doubled.closest_hit(down(0.25F, 0.25F));
  EXPECT_EQ(hit.ties, Ids({0, 5}));
  EXPECT_EQ(hit.hit_class, HitClass::duplicate);
  EXPECT_EQ(doubled.closest_hit(down(0, 0.5F)).hit_class, HitClass::edge);
}

TEST(VerifyOracle, AnUlpDecides) {
  // The ray just inside and just outside the rim x + y = 1.
  const scene::Mesh mesh = star();
  const Oracle oracle(mesh.view());
  EXPECT_EQ(oracle.closest_hit(down(test::ulps(0.5F, -1), 0.5F)).hit_class, HitClass::interior);
  EXPECT_EQ(oracle.closest_hit(down(test::ulps(0.5F, 1), 0.5F)).ties, Ids({4}));
}

TEST(VerifyOracle, TheEndsOfTheRayBelongToIt) {
  const scene::Mesh mesh = star();
  const Oracle oracle(mesh.view());
  const auto hits = [&](float t_min, float t_max) {
    Ray ray = down(0.25F, 0.25F);
    ray.t_min = t_min;
    ray.t_max = t_max;
    EXPECT_EQ(oracle.any_hit(ray), oracle.closest_hit(ray).hit);
    return oracle.closest_hit(ray).ties;
  };
  EXPECT_EQ(hits(1, 1), Ids({0}));
  EXPECT_EQ(hits(0, 1), Ids({0}));
  EXPECT_EQ(hits(1, 9), Ids({0}));
  EXPECT_EQ(hits(0, test::ulps(1, -1)), Ids());
  EXPECT_EQ(hits(test::ulps(1, 1), 9), Ids({4}));
  EXPECT_EQ(hits(2, 1), Ids());
  EXPECT_EQ(hits(-float_infinity, float_infinity), Ids({0}));
  EXPECT_EQ(hits(float_infinity, float_infinity), Ids());
  EXPECT_EQ(hits(-float_infinity, -float_infinity), Ids());
  EXPECT_EQ(hits(-1, -0.0F), Ids());
}

TEST(VerifyOracle, CoplanarAndDegenerateRaysMiss) {
  const scene::Mesh mesh = star();
  const Oracle oracle(mesh.view());
  Ray ray;
  ray.origin = {-5, 0.25F, 0};
  ray.direction = {1, 0, 0};
  EXPECT_FALSE(oracle.closest_hit(ray).hit);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Ray good = down(0.25F, 0.25F);
  ASSERT_TRUE(oracle.any_hit(good));
  const auto refused = [&](auto change) {
    Ray bad = good;
    change(bad);
    return degenerate(bad) && !oracle.any_hit(bad) && !oracle.closest_hit(bad).hit &&
           oracle.all_hits(bad).empty();
  };
  EXPECT_TRUE(refused([&](Ray& r) { r.origin.x = nan; }));
  EXPECT_TRUE(refused([&](Ray& r) { r.origin.y = float_infinity; }));
  EXPECT_TRUE(refused([&](Ray& r) { r.direction.z = nan; }));
  EXPECT_TRUE(refused([&](Ray& r) { r.direction.x = -float_infinity; }));
  EXPECT_TRUE(refused([&](Ray& r) { r.direction = {0.0F, -0.0F, 0.0F}; }));
  EXPECT_TRUE(refused([&](Ray& r) { r.t_min = nan; }));
  EXPECT_TRUE(refused([&](Ray& r) { r.t_max = nan; }));
  EXPECT_TRUE(refused([&](Ray& r) { r.t_min = 2, r.t_max = 1; }));
}

TEST(VerifyOracle, LeavesOutWhatCannotBeHit) {
  scene::Mesh mesh = star();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  mesh.positions.push_back({nan, 0, 1});
  mesh.faces.insert(mesh.faces.begin(), {{0, 1, 8}, {0, 1, 1}, {0, 1, 77}});
  const Oracle oracle(mesh.view());
  EXPECT_EQ(oracle.closest_hit(down(0.25F, 0.25F)).ties, Ids({3}));
  const Oracle nothing{TriangleView{}};
  EXPECT_FALSE(nothing.any_hit(down(0, 0)));
}

}  // namespace
}  // namespace zkd::verify
