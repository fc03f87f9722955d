// SPDX-License-Identifier: Apache-2.0
//
// All hits of a ray in order, each exactly once: against a loop over all triangles, bit for bit, on
// many small meshes, through every kind of tree; and where a ray has thousands of hits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/rays.hpp"
#include "verify/oracle.hpp"

namespace zkd {
namespace {

using test::print;
using test::same_bits;

struct TreeKind {
  const char* name;
  BuildOptions options;
};

std::vector<TreeKind> tree_kinds() {
  constexpr std::uint32_t everything = 1024;  // of the small meshes
  return {{"once", {.references = References::once}},
          {"all", {.references = References::all}},
          {"once, small leaves", {.references = References::once, .leaf_size = 1}},
          {"all, small leaves", {.references = References::all, .leaf_size = 1}},
          {"one leaf", {.references = References::once, .leaf_size = everything}},
          {"once, crowded codes",
           {.references = References::once, .code_bits = 6, .recode_crowded = false}},
          {"all, crowded codes",
           {.references = References::all, .code_bits = 6, .recode_crowded = false}}};
}

test::PlatformTree make_tree(const TreeKind& kind, const TriangleView& triangles) {
  BuildOptions options = kind.options;
  options.invalid_triangles = InvalidTriangles::skip;
  return test::PlatformTree(triangles, options);
}

std::vector<Ray> rays_at(const scene::Mesh& mesh, const TreeView& tree, std::uint64_t seed,
                         std::uint32_t count) {
  std::vector<Ray> rays = scene::hard_rays(mesh, tree, count, seed);
  // Hits on both sides of the origin, and an end among the hits.
  for (std::size_t i = 0; i < rays.size(); i += 3) {
    if (rays[i].t_min == 0.0F) rays[i].t_min = -std::numeric_limits<float>::infinity();
  }
  return rays;
}

struct Lists {
  std::uint32_t places = 0;
  std::vector<Hit> hits;
  std::vector<std::uint32_t> counts;

  [[nodiscard]] std::span<const Hit> of(std::size_t ray) const {
    return std::span(hits).subspan(ray * places, counts[ray]);
  }
};

Lists brute_force(const TreeView& tree, const TriangleView& triangles, std::span<const Ray> rays,
                  std::uint32_t places, Intersector intersector = Intersector::watertight) {
  Lists lists{places, std::vector<Hit>(rays.size() * places),
              std::vector<std::uint32_t>(rays.size())};
  closest_hits_brute_force({.threads = 2, .instructions = cpu::InstructionSet::portable}, tree,
                           triangles, rays, places, lists.hits, lists.counts, intersector);
  return lists;
}

Lists walked(const test::PlatformTree& tree, std::span<const Ray> rays, std::uint32_t places,
             test::Walk walk = test::Walk::automatic,
             Intersector intersector = Intersector::watertight) {
  Lists lists{places, {}, {}};
  lists.hits = tree.hits_in_order(rays, places, lists.counts, walk, intersector);
  return lists;
}

void expect_same(const Lists& got, const Lists& want, std::span<const Ray> rays) {
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(got.counts[i], std::min(want.counts[i], got.places))
        << "ray " << i << " " << print(rays[i]);
    for (std::uint32_t k = 0; k < got.places; ++k) {
      const Hit& hit = got.hits[i * got.places + k];
      const Hit expected = k < want.counts[i] ? want.of(i)[k] : Hit{};
      ASSERT_TRUE(same_bits(hit, expected))
          << "hit " << k << " of ray " << i << " " << print(rays[i]) << ": " << print(hit)
          << " instead of " << print(expected);
    }
  }
}

class HitsInOrder : public testing::TestWithParam<test::MeshKind> {};

TEST_P(HitsInOrder, AreThoseOfALoopOverAllTriangles) {
  std::uint64_t hits = 0;
  for (std::uint64_t seed = 0; seed < 2; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    const TriangleView triangles = m.mesh.view();
    const auto most = static_cast<std::uint32_t>(m.mesh.faces.size()) + 1;
    for (const Intersector intersector : test::intersectors()) {
      if (intersector != Intersector::watertight && seed != 0) continue;
      Lists want;
      std::vector<Ray> rays;
      for (const TreeKind& kind : tree_kinds()) {
        SCOPED_TRACE(m.name + ", seed " + std::to_string(seed) + ", " + kind.name + ", " +
                     to_string(intersector));
        const test::PlatformTree tree = make_tree(kind, triangles);
        if (rays.empty()) {
          // Exact arithmetic is slow where a ray meets hundreds of triangles.
          const std::uint32_t count = intersector == Intersector::exact ? 12 : 96;
          rays = rays_at(m.mesh, tree.host().view(), seed, count);
          want = brute_force(tree.host().view(), triangles, rays, most, intersector);
          hits += std::accumulate(want.counts.begin(), want.counts.end(), std::uint64_t{0});
          // The loop itself begins with closest_hit's answer.
          const std::vector<Hit> first = tree.brute_force_hits(rays, test::walks()[0], intersector);
          for (std::size_t i = 0; i < rays.size(); ++i)
            ASSERT_TRUE(same_bits(want.hits[i * most], first[i])) << print(rays[i]);
        }
        for (const test::Walk walk : test::walks()) {
          SCOPED_TRACE(test::name(walk));
          expect_same(walked(tree, rays, most, walk, intersector), want, rays);
          if (HasFatalFailure()) return;
        }
      }
    }
  }
  RecordProperty("hits", std::to_string(hits));
}

// However many are asked for, they are the first of all.
TEST_P(HitsInOrder, TheFirstFew) {
  const test::NamedMesh m = test::small_mesh(GetParam().number, 4);
  const TriangleView triangles = m.mesh.view();
  for (const TreeKind& kind : tree_kinds()) {
    SCOPED_TRACE(m.name + ", " + kind.name);
    const test::PlatformTree tree = make_tree(kind, triangles);
    const std::vector<Ray> rays = rays_at(m.mesh, tree.host().view(), 4, 96);
    const Lists want = brute_force(tree.host().view(), triangles, rays, 40);
    for (const std::uint32_t most : {0u, 1u, 2u, 3u, 7u, 8u, 9u, 40u}) {
      expect_same(walked(tree, rays, most), want, rays);
      if (HasFatalFailure()) return;
    }
    const std::vector<Hit> closest = tree.closest_hits(rays);
    const Lists first = walked(tree, rays, 1);
    for (std::size_t i = 0; i < rays.size(); ++i)
      ASSERT_TRUE(same_bits(first.hits[i], closest[i])) << print(rays[i]);
  }
}

// ---- Against exact arithmetic -------------------------------------------------------------------

// Whether exact arithmetic has the first of two triangles nearer, or as near and of the lower id.
bool comes_first(const TriangleView& triangles, std::uint32_t first, std::uint32_t second,
                 const Ray& ray) {
  std::vector<glm::vec3> corners;
  for (const std::uint32_t id : {first, second}) {
    for (int c = 0; c < 3; ++c) {
      const float* p = triangles.position(triangles.index(id, c));
      corners.emplace_back(p[0], p[1], p[2]);
    }
  }
  const verify::ExactHit hit = verify::Oracle(TriangleView{corners}).closest_hit(ray);
  const bool tie = hit.ties.size() == 2;
  return tie ? first < second : hit.ties.size() == 1 && hit.ties.front() == 0;
}

// A t that no float holds is no hit of the library's.
bool within_floats(const TriangleView& triangles, std::uint32_t id, const Ray& ray) {
  std::vector<glm::vec3> corners;
  for (int c = 0; c < 3; ++c) {
    const float* p = triangles.position(triangles.index(id, c));
    corners.emplace_back(p[0], p[1], p[2]);
  }
  const verify::ExactHit hit = verify::Oracle(TriangleView{corners}).closest_hit(ray);
  return hit.hit && std::isfinite(static_cast<float>(hit.t));
}

TEST_P(HitsInOrder, OfExactAreTheOracles) {
  const std::vector<Intersector> here = test::intersectors();
  if (std::find(here.begin(), here.end(), Intersector::exact) == here.end())
    GTEST_SKIP() << "Intersector::exact is of the host only";
  const test::NamedMesh m = test::small_mesh(GetParam().number, 5);
  const TriangleView triangles = m.mesh.view();
  const verify::Oracle oracle(triangles);
  const auto most = static_cast<std::uint32_t>(m.mesh.faces.size()) + 1;
  for (const References references : {References::once, References::budget, References::all}) {
    SCOPED_TRACE(m.name + ", " + to_string(references));
    const test::PlatformTree tree = make_tree({"", {.references = references}}, triangles);
    const std::vector<Ray> rays = rays_at(m.mesh, tree.host().view(), 5, 60);
    const Lists lists = walked(tree, rays, most, test::Walk::automatic, Intersector::exact);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      std::vector<std::uint32_t> ids;
      for (const Hit& hit : lists.of(i)) ids.push_back(hit.triangle);
      for (std::size_t k = 1; k < ids.size(); ++k) {
        ASSERT_TRUE(comes_first(triangles, ids[k - 1], ids[k], rays[i]))
            << ids[k - 1] << " is reported before " << ids[k] << " for " << print(rays[i]);
      }
      std::vector<std::uint32_t> want = oracle.all_hits(rays[i]);
      std::erase_if(want, [&](std::uint32_t id) { return !within_floats(triangles, id, rays[i]); });
      std::sort(ids.begin(), ids.end());
      ASSERT_EQ(ids, want) << print(rays[i]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, HitsInOrder, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

// ---- Thousands of hits on one ray ---------------------------------------------------------------

// Triangles across the z axis at 1, 2, 3, ..., each given `times` times.
scene::Mesh stack(std::uint32_t sheets, std::uint32_t times) {
  scene::Mesh mesh;
  for (std::uint32_t i = 0; i < sheets; ++i) {
    const auto z = static_cast<float>(i + 1);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {{-8, -8, z}, {8, -8, z}, {0, 8, z}});
    for (std::uint32_t k = 0; k < times; ++k) mesh.faces.emplace_back(first, first + 1, first + 2);
  }
  return mesh;
}

TEST(HitsInOrderOfManyHits, ThroughAStackOfSheets) {
  for (const std::uint32_t times : {1u, 2u, 300u}) {
    const std::uint32_t sheets = 3000 / times;
    std::vector<std::uint32_t> original;
    // Ids that say nothing of the order along the ray.
    const scene::Mesh mesh = scene::shuffled(stack(sheets, times), 11, &original);
    Ray up;
    up.origin = {0.1F, 0.2F, 0.0F};
    up.direction = {0.0F, 0.0F, 1.0F};
    Ray down = up;
    down.origin.z = static_cast<float>(sheets + 1);
    down.direction.z = -1.0F;
    const std::vector<Ray> rays = {up, down};
    const auto total = static_cast<std::uint32_t>(mesh.faces.size());
    for (const TreeKind& kind : tree_kinds()) {
      SCOPED_TRACE(std::to_string(times) + " times, " + kind.name);
      const test::PlatformTree tree = make_tree(kind, mesh.view());
      const Lists lists = walked(tree, rays, total + 1);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(lists.counts[i], total);
        for (std::uint32_t k = 0; k < total; ++k) {
          const Hit& hit = lists.of(i)[k];
          ASSERT_EQ(hit.t, static_cast<float>(k / times + 1)) << k;
          const std::uint32_t sheet = original[hit.triangle] / times;
          ASSERT_EQ(sheet, i == 0 ? k / times : sheets - 1 - k / times) << k;
          ASSERT_TRUE(k % times == 0 || lists.of(i)[k - 1].triangle < hit.triangle) << k;
        }
      }
    }
  }
}

TEST(HitsInOrderOfManyHits, OnAHundredThousandIdenticalTriangles) {
  // Where few hits are kept it takes many more walks: a device, and in simulation. Only the CPU has
  // several ways to walk.
  const std::uint32_t n = test::walks().size() > 1 ? 100000 : 2000;
  const scene::Mesh mesh = scene::identical(n);
  const glm::vec3 a = mesh.positions[mesh.faces[0].x];
  const glm::vec3 b = mesh.positions[mesh.faces[0].y];
  const glm::vec3 c = mesh.positions[mesh.faces[0].z];
  const glm::vec3 middle = (a + b + c) / 3.0F;
  const Ray ray = scene::ray_between(middle + glm::vec3(0.5F, 0.75F, 1.0F), middle);
  for (const References references : {References::once, References::budget, References::all}) {
    SCOPED_TRACE(to_string(references));
    const test::PlatformTree tree = make_tree({"", {.references = references}}, mesh.view());
    const Lists lists = walked(tree, std::span(&ray, 1), n + 1);
    ASSERT_EQ(lists.counts[0], n);
    for (std::uint32_t k = 0; k < n; ++k) {
      ASSERT_EQ(lists.hits[k].triangle, k);
      ASSERT_EQ(lists.hits[k].t, lists.hits[0].t);
    }
  }
}

TEST(HitsInOrderOfManyHits, ThroughTheTipOfAFan) {
  constexpr std::uint32_t n = 700;
  const scene::Mesh mesh = scene::fan(n);
  const std::vector<Ray> rays = scene::axis_rays(mesh, 40, 12);
  Lists want;
  for (const TreeKind& kind : tree_kinds()) {
    SCOPED_TRACE(kind.name);
    const test::PlatformTree tree = make_tree(kind, mesh.view());
    if (want.places == 0) want = brute_force(tree.host().view(), mesh.view(), rays, n + 1);
    EXPECT_GT(*std::max_element(want.counts.begin(), want.counts.end()), n / 2);
    expect_same(walked(tree, rays, n + 1), want, rays);
    if (testing::Test::HasFatalFailure()) return;
  }
}

// Sheets so near to each other that their t is one float: they come in the order of nearness.
TEST(HitsInOrderOfManyHits, OrderIsThatBeforeRounding) {
  scene::Mesh mesh;
  constexpr std::uint32_t sheets = 50;
  for (std::uint32_t i = 0; i < sheets; ++i) {
    // The higher the id the nearer, by less than an ulp of t.
    const float z = 0x1p-40F * static_cast<float>(sheets - i);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {{-1, -1, z}, {1, -1, z}, {0, 1, z}});
    mesh.faces.emplace_back(first, first + 1, first + 2);
  }
  Ray ray;
  ray.origin = {0.0F, 0.0F, -4.0F};
  ray.direction = {0.0F, 0.0F, 1.0F};
  for (const TreeKind& kind : tree_kinds()) {
    SCOPED_TRACE(kind.name);
    const test::PlatformTree tree = make_tree(kind, mesh.view());
    const Lists lists = walked(tree, std::span(&ray, 1), sheets + 1);
    ASSERT_EQ(lists.counts[0], sheets);
    for (std::uint32_t k = 0; k < sheets; ++k) {
      EXPECT_EQ(lists.hits[k].t, 4.0F);
      EXPECT_EQ(lists.hits[k].triangle, sheets - 1 - k);
    }
  }
}

// ---- Rules --------------------------------------------------------------------------------------

TEST(HitsInOrderRules, BothTrianglesOfASharedEdge) {
  const std::vector<glm::vec3> corners = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0},
                                          {-1, -1, 0}, {1, 1, 0},  {-1, 1, 0}};
  const TriangleView triangles{corners};
  const test::PlatformTree tree(triangles, {.leaf_size = 1});
  Ray ray;
  ray.origin = {0.5F, 0.5F, -2.0F};
  ray.direction = {0.0F, 0.0F, 1.0F};
  std::vector<std::uint32_t> counts;
  const std::vector<Hit> hits = tree.hits_in_order(std::span(&ray, 1), 3, counts);
  EXPECT_EQ(counts[0], 2u);
  EXPECT_EQ(hits[0].triangle, 0u);
  EXPECT_EQ(hits[1].triangle, 1u);
  EXPECT_EQ(hits[0].t, 2.0F);
  EXPECT_EQ(hits[1].t, 2.0F);
  EXPECT_EQ(hits[2].triangle, no_triangle);
}

TEST(HitsInOrderRules, TheEndsOfTheRayBelongToIt) {
  const scene::Mesh mesh = stack(9, 1);
  const test::PlatformTree tree(mesh.view());
  const auto count_between = [&](float t_min, float t_max) {
    Ray ray;
    ray.origin = {0.1F, 0.2F, 0.0F};
    ray.direction = {0.0F, 0.0F, 1.0F};
    ray.t_min = t_min;
    ray.t_max = t_max;
    std::vector<std::uint32_t> counts;
    (void)tree.hits_in_order(std::span(&ray, 1), 20, counts);
    return counts[0];
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(count_between(3.0F, 5.0F), 3u);
  EXPECT_EQ(count_between(test::ulps(3.0F, 1), test::ulps(5.0F, -1)), 1u);
  EXPECT_EQ(count_between(4.0F, 4.0F), 1u);
  EXPECT_EQ(count_between(4.25F, 4.75F), 0u);
  EXPECT_EQ(count_between(5.0F, 3.0F), 0u);
  EXPECT_EQ(count_between(nan, 9.0F), 0u);
  EXPECT_EQ(count_between(0.0F, nan), 0u);
}

TEST(HitsInOrderRules, InAnEmptyTree) {
  const test::PlatformTree tree(TriangleView{});
  std::vector<std::uint32_t> counts;
  const std::vector<Ray> rays = scene::random_rays(Box{}, 10, 13);
  for (const Hit& hit : tree.hits_in_order(rays, 2, counts)) EXPECT_FALSE(test::is_hit(hit));
  EXPECT_EQ(counts, std::vector<std::uint32_t>(10, 0));
}

}  // namespace
}  // namespace zkd
