// SPDX-License-Identifier: Apache-2.0
//
// Verdicts: what rounding excuses, and above all what it does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include <glm/glm.hpp>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/meshes.hpp"
#include "support/random.hpp"
#include "support/rays.hpp"
#include "verify/check.hpp"
#include "verify/exact.hpp"

namespace zkd::verify {
namespace {

constexpr float float_infinity = std::numeric_limits<float>::infinity();

Point point(const glm::vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

// An answer: a triangle and t.
struct On {
  std::uint32_t triangle;
  double t;
};
On on(std::uint32_t triangle, double t) { return {triangle, t}; }

struct Scene {
  explicit Scene(scene::Mesh mesh_) : mesh(std::move(mesh_)), oracle(mesh.view()) {}

  // Single precision, whose band is wide enough to aim at.
  [[nodiscard]] Verdict verdict(const Ray& ray, const Hit& hit,
                                Intersector intersector = Intersector::single_precision) const {
    return judge(oracle, mesh.view(), ray, hit, intersector);
  }
  // With u and v of where the ray meets the plane.
  [[nodiscard]] Verdict verdict(const Ray& ray, const On& answer,
                                Intersector intersector = Intersector::single_precision) const {
    return verdict(ray, hit(ray, answer), intersector);
  }
  [[nodiscard]] Hit hit(const Ray& ray, const On& answer) const {
    Hit hit{static_cast<float>(answer.t), 0, 0, answer.triangle};
    if (answer.triangle >= mesh.faces.size() || degenerate(ray)) return hit;
    const auto [u, v] = barycentrics(point(ray.origin), point(ray.direction),
                                     *finite_corners(mesh.view(), answer.triangle));
    if (std::isnan(u) || std::isnan(v)) return hit;
    hit.u = static_cast<float>(u);
    hit.v = static_cast<float>(v);
    return hit;
  }
  [[nodiscard]] Verdict missed(const Ray& ray) const { return verdict(ray, Hit{}); }

  // Where the ray meets the plane of a triangle.
  [[nodiscard]] double t(const Ray& ray, std::size_t triangle) const {
    return plane_hit(point(ray.origin), point(ray.direction),
                     *finite_corners(mesh.view(), triangle))
        .t;
  }

  scene::Mesh mesh;
  Oracle oracle;
};

Ray from_to(const glm::vec3& from, const glm::vec3& to) {
  Ray ray;
  ray.origin = from;
  ray.direction = to - from;
  return ray;
}

scene::Mesh triangles(const std::vector<glm::vec3>& corners) {
  scene::Mesh mesh;
  mesh.positions = corners;
  for (std::uint32_t i = 0; i < corners.size(); i += 3) mesh.faces.emplace_back(i, i + 1, i + 2);
  return mesh;
}

void expect(const Verdict& verdict, Verdict::Kind kind, bool in_band) {
  EXPECT_EQ(to_string(verdict.kind), to_string(kind));
  EXPECT_EQ(verdict.in_band, in_band);
}

// Two triangles that share the edge x = 0.3 of the plane z = 1, and one behind at z = 2.
Scene folded() {
  return Scene(triangles({{0.3F, -1, 1},
                          {0.3F, 1, 1},
                          {-1, 0, 1},  //
                          {0.3F, -1, 1},
                          {0.3F, 1, 1},
                          {2, 0, 1},  //
                          {-9, -9, 2},
                          {9, -9, 2},
                          {0, 9, 2}}));
}

// Oblique, so that an intersector rounds: nothing is a multiple of anything.
Ray oblique(const glm::vec3& to) { return from_to({0.17F, -0.23F, -0.71F}, to); }

TEST(VerifyBand, CorrectAnswers) {
  const Scene scene = folded();
  Ray ray = oblique({-0.2F, 0.1F, 1});
  ray.direction *= 1.5F;
  const double t = scene.oracle.closest_hit(ray).t;
  const Verdict exact = scene.verdict(ray, on(0, t));
  expect(exact, Verdict::correct, false);
  EXPECT_LE(exact.t_ulp, 0.5);
  const float three = test::ulps(static_cast<float>(t), 3);
  EXPECT_NEAR(scene.verdict(ray, on(0, static_cast<double>(three))).t_ulp, 3.0, 0.5);
  EXPECT_EQ(scene.verdict(ray, on(0, std::nan(""))).t_ulp, std::numeric_limits<double>::infinity());
  const Ray away = from_to({0, 0, -1}, {0, 0, -2});
  expect(scene.missed(away), Verdict::correct, false);
  EXPECT_EQ(scene.missed(away).t_ulp, 0.0);
}

TEST(VerifyBand, ATriangleHitInItsMiddleMustBeFound) {
  const Scene scene = folded();
  const Ray ray = oblique({-0.2F, 0.1F, 1});
  expect(scene.missed(ray), Verdict::missed, false);
  const double behind = scene.t(ray, 2);
  expect(scene.verdict(ray, on(2, behind)), Verdict::wrong_triangle, false);
  expect(scene.verdict(ray, on(1, 1)), Verdict::wrong_triangle, false);
}

TEST(VerifyBand, AnEdgeMayBeMissedByRounding) {
  // One triangle only: nothing behind its edge had to be found.
  const Scene scene(triangles({{0.3F, -1, 1}, {0.3F, 1, 1}, {-1, 0, 1}}));
  Ray ray = oblique({0.3F, 0.1F, 1});
  while (!scene.oracle.any_hit(ray)) ray.direction.x = test::ulps(ray.direction.x, -1);
  expect(scene.missed(ray), Verdict::missed, true);
  ray.direction.x -= 1e-5F;
  ASSERT_TRUE(scene.oracle.any_hit(ray));
  expect(scene.missed(ray), Verdict::missed, false);
}

TEST(VerifyBand, AnEdgeIsNoExcuseForMissingWhatIsBehindIt) {
  const Scene scene = folded();
  Ray ray = oblique({0.3F, 0.1F, 1});
  expect(scene.missed(ray), Verdict::missed, false);
  const ExactHit nearest = scene.oracle.closest_hit(ray);
  ASSERT_LT(nearest.ties.front(), 2u);
  // A leak through the edge: excused one by one, and told apart in the counts.
  const double behind = scene.t(ray, 2);
  expect(scene.verdict(ray, on(2, behind)), Verdict::wrong_triangle, true);
  // The neighbour across the edge.
  if (nearest.ties.size() == 1) {
    expect(scene.verdict(ray, on(1 - nearest.ties.front(), nearest.t)), Verdict::wrong_triangle,
           true);
  }
}

TEST(VerifyBand, WhatNoIntersectorRoundsIsNotExcused) {
  // Along z the sheared coordinates of this edge are exact: every product is zero.
  const Scene scene(triangles({{0, -1, 1}, {0, 1, 1}, {-1, 0, 1}}));
  Ray ray = from_to({0, 0.25F, 0}, {0, 0.25F, 1});
  ASSERT_EQ(scene.oracle.closest_hit(ray).hit_class, HitClass::edge);
  expect(scene.missed(ray), Verdict::missed, false);
}

TEST(VerifyBand, SmallTrianglesFarAwayAreNotAllInTheBand) {
  // Edges of 1e-3 seen from 1: their determinants are below 2^-20 of the permanent everywhere.
  const glm::vec3 at = {0.613F, 0.377F, 0.541F};
  const Scene scene(triangles({at,
                               at + glm::vec3(1e-3F, 0, 2e-4F),
                               at + glm::vec3(0, 1e-3F, 1e-4F),
                               {-9, -9, 2},
                               {9, -9, 2},
                               {0, 9, 2}}));
  const Ray ray = from_to({0, 0, 0}, at + glm::vec3(3e-4F, 3e-4F, 1e-4F));
  ASSERT_EQ(scene.oracle.closest_hit(ray).ties.front(), 0u);
  expect(scene.missed(ray), Verdict::missed, false);
  const Ray beside = from_to({0, 0, 0}, at + glm::vec3(-1e-4F, 3e-4F, 1e-4F));
  ASSERT_EQ(scene.oracle.closest_hit(beside).ties.front(), 2u - 1u);
  expect(scene.verdict(beside, on(0, 1)), Verdict::wrong_triangle, false);
  Ray short_ray = beside;
  short_ray.t_max = 1.5F;
  expect(scene.verdict(short_ray, on(0, 1)), Verdict::phantom, false);
}

TEST(VerifyBand, PhantomsJustOutside) {
  const Scene scene(triangles({{0.3F, -1, 1}, {0.3F, 1, 1}, {-1, 0, 1}}));
  Ray ray = oblique({0.3F, 0.1F, 1});
  while (scene.oracle.any_hit(ray)) ray.direction.x = test::ulps(ray.direction.x, 1);
  const double t = scene.t(ray, 0);
  expect(scene.verdict(ray, on(0, t)), Verdict::phantom, true);
  expect(scene.verdict(ray, on(0, t * (1 + 1e-4))), Verdict::phantom, false);
  expect(scene.verdict(ray, on(0, std::nan(""))), Verdict::phantom, false);
  expect(scene.verdict(ray, on(1, t)), Verdict::phantom, false);
  expect(scene.verdict(ray, on(0xFFFFFFFEu, t)), Verdict::phantom, false);
  Ray wide = ray;
  wide.direction.x += 1e-4F;
  expect(scene.verdict(wide, on(0, t)), Verdict::phantom, false);
}

TEST(VerifyBand, WhatIsExcusedDependsOnTheIntersector) {
  const Scene scene(triangles({{0.3F, -1, 1}, {0.3F, 1, 1}, {-1, 0, 1}}));
  Ray ray = oblique({0.3F, 0.1F, 1});
  while (!scene.oracle.any_hit(ray)) ray.direction.x = test::ulps(ray.direction.x, -1);
  const auto excused = [&](Intersector intersector) {
    return scene.verdict(ray, Hit{}, intersector).in_band;
  };
  EXPECT_TRUE(excused(Intersector::single_precision));
  EXPECT_TRUE(excused(Intersector::fast));
  EXPECT_FALSE(excused(Intersector::watertight));
  EXPECT_FALSE(excused(Intersector::double_precision));
  EXPECT_FALSE(excused(Intersector::exact));
}

TEST(VerifyBand, TIsHeldAgainstItsBound) {
  const Scene scene = folded();
  const Ray ray = oblique({-0.2F, 0.1F, 1});
  const double t = scene.oracle.closest_hit(ray).t;
  const auto in_bound = [&](int steps, Intersector intersector) {
    const float moved = test::ulps(static_cast<float>(t), steps);
    return scene.verdict(ray, on(0, static_cast<double>(moved)), intersector).t_in_bound;
  };
  EXPECT_TRUE(in_bound(0, Intersector::exact));
  EXPECT_TRUE(in_bound(0, Intersector::watertight));
  EXPECT_FALSE(in_bound(2, Intersector::watertight));
  EXPECT_TRUE(in_bound(2, Intersector::single_precision));
  EXPECT_FALSE(in_bound(200, Intersector::single_precision));
  EXPECT_TRUE(in_bound(20, Intersector::fast));
  EXPECT_FALSE(in_bound(2000, Intersector::fast));
}

TEST(VerifyBand, UAndVAreHeldAgainstTheirBound) {
  const Scene scene = folded();
  const Tree tree = zkd::build(scene.mesh.view());
  const Ray ray = oblique({-0.2F, 0.1F, 1});
  const auto in_bound = [&](int steps, Intersector intersector) {
    Hit hit = closest_hit(tree.view(), scene.mesh.view(), ray, intersector).value();
    hit.u = test::ulps(hit.u, steps);
    EXPECT_TRUE(scene.verdict(ray, hit, intersector).t_in_bound);
    const bool of_u = scene.verdict(ray, hit, intersector).point_in_bound;
    hit.u = test::ulps(hit.u, -steps);
    hit.v = test::ulps(hit.v, steps);
    EXPECT_EQ(scene.verdict(ray, hit, intersector).point_in_bound, of_u);
    return of_u;
  };
  for (const Intersector intersector :
       {Intersector::watertight, Intersector::double_precision, Intersector::exact}) {
    EXPECT_TRUE(in_bound(0, intersector)) << to_string(intersector);
    EXPECT_FALSE(in_bound(4, intersector)) << to_string(intersector);
  }
  for (const Intersector intersector : {Intersector::single_precision, Intersector::fast}) {
    EXPECT_TRUE(in_bound(4, intersector)) << to_string(intersector);
    EXPECT_FALSE(in_bound(2000, intersector)) << to_string(intersector);
  }
}

// A ray from 2^108 that passes a vertex by 2^-120: found by fuzzing.
TEST(VerifyBand, FromFurtherAwayThanADoubleResolves) {
  const Scene scene(triangles({{0x1.9f87bap+3F, 0x1.14741ap+3F, -0x1.df057p+4F},
                               {0x1.ec9804p+2F, 0x1.f45e5p+1F, 0x1.f1dc84p+4F},
                               {0x1.b8a32p+1F, 0x1.07a1dep+4F, 0x1.fa3718p+4F}}));
  Ray ray;
  ray.origin = {0x1.e8aa04p+108F, 0x1.b395eep-120F, 0x1.ac8ad2p-74F};
  ray.direction = {-0x1.e8aa04p+108F, 0x1.07a1dep+4F, 0x1.fa3718p+4F};
  ASSERT_FALSE(scene.oracle.any_hit(ray));
  expect(scene.verdict(ray, on(0, 1), Intersector::watertight), Verdict::phantom, true);
  ray.direction.z *= 1.001F;
  ASSERT_FALSE(scene.oracle.any_hit(ray));
  expect(scene.verdict(ray, on(0, 1), Intersector::single_precision), Verdict::phantom, false);
}

// A triangle that is one point to the last digit seen from where the origin is moved to: found by
// fuzzing.
TEST(VerifyBand, SmallerThanALongDoubleResolves) {
  constexpr float small = 0x1p-40F;
  constexpr float large = 0x1p+40F;
  const Scene scene(triangles({{small, 0, 0},
                               {2 * small, 0, 0},
                               {small, 0, small},
                               {large, 0, 0},
                               {large, 1, 0},
                               {large, 0, 1}}));
  const Ray ray = from_to(glm::vec3(-1024 * large), {0, 0, 0});
  ASSERT_FALSE(scene.oracle.any_hit(ray));
  expect(scene.verdict(ray, on(0, 1)), Verdict::phantom, true);
  expect(scene.verdict(ray, on(0, 1.001)), Verdict::phantom, false);
}

// Of a scene of the smallest floats products underflow even when it has been scaled.
TEST(VerifyBand, UnderflowInTheSmallestScenes) {
  constexpr float least = std::numeric_limits<float>::denorm_min();
  const Scene scene(triangles({{0, -least, least}, {0, least, least}, {least, 0, least}}));
  for (int k = 106; k <= 110; ++k) {
    Ray ray;
    ray.direction = {-std::ldexp(1.0F, -k), 0, 1};
    ASSERT_FALSE(scene.oracle.any_hit(ray));
    expect(scene.verdict(ray, on(0, static_cast<double>(least))), Verdict::phantom, true);
  }
}

// A needle beside the ray, which `fast` leaves to double precision. That rounds the last corner's
// sheared z, 1 - 3 * 2^53, by more than single precision would lose of the needle's few products.
// Found by fuzzing.
TEST(VerifyBand, WhatFastAsksDoublePrecision) {
  const Scene scene(triangles({{0, 0, 0}, {1, 0, 0}, {0x1p+55F, 0, 1}}));
  const Tree tree = zkd::build(scene.mesh.view());
  Ray ray;
  ray.origin = {0x1p+53F, 0, 0};
  ray.direction = {1, 0.75F, 1};
  for (const Intersector intersector : {Intersector::double_precision, Intersector::fast}) {
    const std::optional<Hit> hit = closest_hit(tree.view(), scene.mesh.view(), ray, intersector);
    ASSERT_TRUE(hit) << to_string(intersector);
    expect(scene.verdict(ray, *hit, intersector), Verdict::phantom, true);
  }
  // Further beside than double precision loses.
  ray.origin.z = -64;
  for (const Intersector intersector : {Intersector::double_precision, Intersector::fast}) {
    EXPECT_FALSE(closest_hit(tree.view(), scene.mesh.view(), ray, intersector));
    expect(scene.verdict(ray, on(0, 0), intersector), Verdict::phantom, false);
  }
}

TEST(VerifyBand, NothingIsHitThatHasNoArea) {
  const Scene scene(triangles({{-1, 0.1F, 1}, {1, 0.1F, 1}, {0.5F, 0.1F, 1}}));
  expect(scene.verdict(oblique({0.2F, 0.1F, 1}), on(0, 1)), Verdict::phantom, false);
}

TEST(VerifyBand, DegenerateRaysHitNothing) {
  const Scene scene = folded();
  Ray ray = oblique({-0.2F, 0.1F, 1});
  ray.t_min = 3;
  ray.t_max = 2;
  expect(scene.verdict(ray, on(0, 1)), Verdict::phantom, false);
  ray = oblique({-0.2F, 0.1F, 1});
  ray.origin.x = std::numeric_limits<float>::quiet_NaN();
  expect(scene.verdict(ray, on(0, 1)), Verdict::phantom, false);
}

TEST(VerifyBand, TheEndsOfTheRay) {
  const Scene scene(triangles({{0.3F, -1, 1}, {0.3F, 1, 1}, {-1, 0, 1}}));
  Ray ray = oblique({-0.2F, 0.1F, 1});
  const auto t = static_cast<float>(scene.oracle.closest_hit(ray).t);
  ray.t_max = test::ulps(t, 2);
  expect(scene.missed(ray), Verdict::missed, true);
  ray.t_max = t + 1e-4F;
  expect(scene.missed(ray), Verdict::missed, false);
  ray.t_max = test::ulps(t, -2);
  expect(scene.verdict(ray, on(0, static_cast<double>(ray.t_max))), Verdict::phantom, true);
  // The t answered is itself held against the ends.
  expect(scene.verdict(ray, on(0, static_cast<double>(t))), Verdict::phantom, false);
  ray.t_max = t - 1e-4F;
  expect(scene.verdict(ray, on(0, static_cast<double>(ray.t_max))), Verdict::phantom, false);
  ray.t_max = float_infinity;
  ray.t_min = test::ulps(t, -2);
  expect(scene.missed(ray), Verdict::missed, true);
}

TEST(VerifyBand, CoplanarRays) {
  // In the plane of the triangle x + y + z = 1, through it and past it.
  const Scene scene(triangles({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  Ray through;
  through.origin = {2.5F, -0.75F, -0.75F};
  through.direction = {-1, 0.5F, 0.5F};
  ASSERT_FALSE(scene.oracle.any_hit(through));
  expect(scene.missed(through), Verdict::correct, false);
  expect(scene.verdict(through, Hit{2, 0.25F, 0.25F, 0}), Verdict::phantom, true);
  expect(scene.verdict(through, Hit{2, 0.25F, 0.26F, 0}), Verdict::phantom, false);
  expect(scene.verdict(through, on(0, 7)), Verdict::phantom, false);
  Ray past = through;
  past.direction = {-1, 1.5F, -0.5F};
  ASSERT_FALSE(scene.oracle.any_hit(past));
  for (const double t : {0.5, 1.0, 1.5, 2.0}) {
    expect(scene.verdict(past, on(0, t)), Verdict::phantom, false);
  }
}

TEST(VerifyBand, TwoSurfacesAnUlpApart) {
  const auto sheets = [](float z) {
    return Scene(
        triangles({{-9, -9, 1}, {9, -9, 1}, {0, 9, 1}, {-9, -9, z}, {9, -9, z}, {0, 9, z}}));
  };
  const Ray ray = oblique({0.1F, 0.2F, 1});
  const auto answer_behind = [&](const Scene& scene) {
    const double t = scene.t(ray, 1);
    return scene.verdict(ray, on(1, t));
  };
  expect(answer_behind(sheets(test::ulps(1, 1))), Verdict::wrong_triangle, true);
  expect(answer_behind(sheets(1.001F)), Verdict::wrong_triangle, false);
  expect(answer_behind(sheets(2)), Verdict::wrong_triangle, false);
}

// Watertight intersection in float (Woop, Benthin, Wald 2013) over all triangles: the kind of
// answers that the band of Intersector::single_precision is made for. It does not bring far origins
// near.
Hit woop(const scene::Mesh& mesh, const Ray& ray) {
  Hit nearest;
  if (degenerate(ray)) return nearest;
  int z = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (std::abs(ray.direction[axis]) > std::abs(ray.direction[z])) z = axis;
  }
  const int x = (z + 1) % 3;
  const int y = (z + 2) % 3;
  const float shear_x = ray.direction[x] / ray.direction[z];
  const float shear_y = ray.direction[y] / ray.direction[z];
  for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) {
    if (!valid_triangle(mesh.view(), i)) continue;
    float at[3][3];
    for (int c = 0; c < 3; ++c) {
      const glm::vec3 p = mesh.positions[mesh.faces[i][c]] - ray.origin;
      at[c][0] = p[x] - shear_x * p[z];
      at[c][1] = p[y] - shear_y * p[z];
      at[c][2] = p[z] / ray.direction[z];
    }
    // Products of floats are exact in double, and so is the sign of their difference. Kept in
    // double, so that t is no noise where the edge functions are next to nothing.
    const auto edge = [&](int a, int b) {
      return static_cast<double>(at[a][0]) * static_cast<double>(at[b][1]) -
             static_cast<double>(at[a][1]) * static_cast<double>(at[b][0]);
    };
    const double u = edge(1, 2);
    const double v = edge(2, 0);
    const double w = edge(0, 1);
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) continue;
    const double whole = u + v + w;
    if (whole == 0) continue;
    const double sum = u * static_cast<double>(at[0][2]) + v * static_cast<double>(at[1][2]) +
                       w * static_cast<double>(at[2][2]);
    const auto t = static_cast<float>(sum / whole);
    if (t >= ray.t_min && t <= ray.t_max && t < nearest.t)
      nearest = {t, static_cast<float>(v / whole), static_cast<float>(w / whole), i};
  }
  return nearest;
}

TEST(VerifyBand, AWatertightIntersectorInFloatStaysWithin) {
  // Kinds whose floats neither overflow nor lose digits in a plain intersector.
  std::uint64_t mistakes = 0;
  std::uint64_t hits = 0;
  std::uint64_t outside_watertight = 0;
  for (const int kind :
       {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 15, 16, 17, 18, 19, 20, 21, 22, 29}) {
    const test::NamedMesh named = test::small_mesh(kind, 5);
    TreeHeader header;
    header.bounds = scene::bounds(named.mesh);
    test::RayMaker maker(named.mesh, TreeView{&header}, static_cast<std::uint64_t>(kind));
    const Oracle oracle(named.mesh.view());
    std::vector<Ray> rays;
    std::vector<Hit> answers;
    for (const Ray& ray : maker.all_kinds(720)) {
      if (glm::length(ray.origin) > 8.0 * oracle.largest_coordinate()) continue;
      rays.push_back(ray);
      answers.push_back(woop(named.mesh, ray));
    }
    const Summary summary =
        check(oracle, named.mesh.view(), rays, answers, 1, {}, Intersector::single_precision);
    EXPECT_EQ(summary.outside_band(), 0u)
        << named.name << ", ray " << summary.first_offenders.front() << ": "
        << to_string(judge(oracle, named.mesh.view(), rays[summary.first_offenders.front()],
                           answers[summary.first_offenders.front()], Intersector::single_precision)
                         .kind);
    // None of them is what double precision promises.
    const Summary strict = check(oracle, named.mesh.view(), rays, answers, 1);
    outside_watertight += strict.outside_band();
    mistakes += summary.in_band.total();
    for (const Hit& hit : answers) hits += hit.triangle != no_triangle;
  }
  EXPECT_GT(hits, 2000u);
  EXPECT_GT(mistakes, 50u);
  EXPECT_GT(outside_watertight, 50u);
}

TEST(VerifyCheck, CountsAndNamesTheFirst) {
  const Scene scene = folded();
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  for (int i = 0; i < 5000; ++i) {
    rays.push_back(oblique({-0.2F + 1e-5F * static_cast<float>(i), 0.1F, 1}));
    const ExactHit exact = scene.oracle.closest_hit(rays.back());
    hits.push_back(scene.hit(rays.back(), on(exact.ties.front(), exact.t)));
  }
  for (int i = 0; i < 12; ++i) hits[static_cast<std::size_t>(4000 - 300 * i)] = Hit{};
  rays[4500].t_max = 0.1F;
  hits[123].triangle = 2;
  hits[124].u += 1e-3F;
  for (const int threads : {0, 1, 3}) {
    std::uint64_t last = 0;
    const Summary summary =
        check(scene.oracle, scene.mesh.view(), rays, hits, threads, [&](std::uint64_t done) {
          EXPECT_GE(done, last);
          last = done;
        });
    EXPECT_EQ(last, 5000u);
    EXPECT_EQ(summary.rays, 5000u);
    EXPECT_EQ(summary.missed, 12u);
    EXPECT_EQ(summary.phantom, 1u);
    EXPECT_EQ(summary.wrong_triangle, 1u);
    EXPECT_EQ(summary.correct, 5000u - 14u);
    EXPECT_EQ(summary.in_band.total(), 0u);
    EXPECT_EQ(summary.beyond_bound, 1u);
    EXPECT_EQ(summary.outside_band(), 15u);
    EXPECT_LE(summary.t_ulp_max, 0.5);
    EXPECT_LE(summary.t_ulp_p999, summary.t_ulp_max);
    EXPECT_GT(summary.t_ulp_p999, 0.0);
    const std::vector<std::uint64_t> first = {123,  124,  700,  1000, 1300,
                                              1600, 1900, 2200, 2500, 2800};
    EXPECT_EQ(summary.first_offenders, first);
  }
  EXPECT_THROW(
      (void)check(scene.oracle, scene.mesh.view(), rays, std::span<const Hit>(hits).first(3), 1),
      std::invalid_argument);
  EXPECT_EQ(check(scene.oracle, scene.mesh.view(), {}, {}, 1).rays, 0u);
}

}  // namespace
}  // namespace zkd::verify
