// SPDX-License-Identifier: Apache-2.0
//
// Generated meshes and rays: what they promise, and that their bits stay.
#include "scene/generate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "scene/random.hpp"

namespace zkd::test {
namespace {

using glm::uvec3;
using glm::vec3;
using scene::Mesh;

std::uint64_t hash(std::uint64_t state, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) state = (state ^ bytes[i]) * 0x100000001B3u;
  return state;
}

std::uint64_t hash(const Mesh& mesh) {
  const std::uint64_t state =
      hash(0xCBF29CE484222325u, mesh.positions.data(), mesh.positions.size() * sizeof(vec3));
  return hash(state, mesh.faces.data(), mesh.faces.size() * sizeof(uvec3));
}

std::uint64_t hash(const std::vector<Ray>& rays) {
  return hash(0xCBF29CE484222325u, rays.data(), rays.size() * sizeof(Ray));
}

void expect_whole(const Mesh& mesh, std::size_t triangles) {
  EXPECT_EQ(mesh.faces.size(), triangles);
  for (const uvec3& f : mesh.faces) {
    ASSERT_LT(std::max({f.x, f.y, f.z}), mesh.positions.size());
  }
}

/// How often each undirected edge is used, and that no directed edge is used twice.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
  std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
  for (const uvec3& f : mesh.faces) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = f[k];
      const std::uint32_t b = f[(k + 1) % 3];
      EXPECT_TRUE(directed.emplace(a, b).second);
      ++count[std::minmax(a, b)];
    }
  }
  return count;
}

TEST(Random, KnownNumbers) {
  // The first outputs of SplitMix64 for seed 1234567, as its reference gives them.
  scene::Random random(1234567);
  EXPECT_EQ(random.bits64(), 6457827717110365317u);
  EXPECT_EQ(random.bits64(), 3203168211198807973u);
  EXPECT_EQ(random.bits64(), 9817491932198370423u);
}

TEST(Random, Ranges) {
  scene::Random random(7);
  std::vector<int> seen(6);
  for (int i = 0; i < 6000; ++i) {
    ++seen[random.below(6)];
    const float unit = random.unit();
    ASSERT_GE(unit, 0.0F);
    ASSERT_LT(unit, 1.0F);
  }
  for (const int count : seen) EXPECT_NEAR(count, 1000, 150);
}

TEST(Generate, CountsAndIndices) {
  expect_whole(scene::soup(1000, 1), 1000);
  expect_whole(scene::grid(4), 6 * 5 * 16);
  expect_whole(scene::sphere(3), 20 * 64);
  expect_whole(scene::slivers(500, 1e4F, 2), 500);
  expect_whole(scene::identical(100), 100);
  expect_whole(scene::same_centre(300, 3), 300);
  for (int axis = 0; axis < 3; ++axis) expect_whole(scene::flat(200, axis, 4), 200);
  expect_whole(scene::needles(100, 5), 100);
  expect_whole(scene::small_in_large(400, 1e5F, 6), 412);
  expect_whole(scene::fan(17), 17);
  expect_whole(scene::staircase(63), 64);
  expect_whole(scene::random_bits(500, 7), 500);
}

TEST(Generate, NothingAtAll) {
  for (const Mesh& mesh :
       {scene::soup(0, 1), scene::grid(0), scene::slivers(0, 10.0F, 1), scene::identical(0),
        scene::same_centre(0, 1), scene::flat(0, 1, 1), scene::needles(0, 1),
        scene::random_bits(0, 1), scene::shuffled({}, 1)}) {
    EXPECT_TRUE(mesh.faces.empty());
  }
}

TEST(Generate, BadArguments) {
  EXPECT_THROW((void)scene::grid(701), std::invalid_argument);
  EXPECT_THROW((void)scene::sphere(13), std::invalid_argument);
  EXPECT_THROW((void)scene::slivers(1, 0.5F, 1), std::invalid_argument);
  EXPECT_THROW((void)scene::flat(1, 3, 1), std::invalid_argument);
  EXPECT_THROW((void)scene::small_in_large(1, 1.0F, 1), std::invalid_argument);
  EXPECT_THROW((void)scene::fan(2), std::invalid_argument);
  EXPECT_THROW((void)scene::staircase(301), std::invalid_argument);
  EXPECT_THROW((void)scene::scaled({}, 401), std::invalid_argument);
  EXPECT_THROW((void)scene::rays_at_features({}, 1, 1), std::invalid_argument);
  EXPECT_THROW((void)scene::axis_rays({}, 1, 1), std::invalid_argument);
}

TEST(Generate, SphereIsClosedAndRound) {
  const Mesh mesh = scene::sphere(3);
  EXPECT_EQ(mesh.positions.size(), 642U);
  for (const auto& [edge, count] : edges(mesh)) EXPECT_EQ(count, 2);
  for (const vec3& p : mesh.positions) {
    EXPECT_NEAR(p.x * p.x + p.y * p.y + p.z * p.z, 1.0F, 3e-7F);
  }
  for (const uvec3& f : mesh.faces) {  // outward
    const vec3 a = mesh.positions[f.x];
    const vec3 b = mesh.positions[f.y];
    const vec3 c = mesh.positions[f.z];
    const float volume = a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) +
                         a.z * (b.x * c.y - b.y * c.x);
    EXPECT_GT(volume, 0.0F);
  }
}

TEST(Generate, FanIsClosedRoundItsVertex) {
  for (const std::uint32_t n : {3u, 4u, 5u, 64u, 1001u}) {
    int shared = 0;
    for (const auto& [edge, count] : edges(scene::fan(n))) shared += count == 2;
    EXPECT_EQ(shared, static_cast<int>(n));
    const Mesh mesh = scene::fan(n);
    for (std::size_t i = 1; i < mesh.positions.size(); ++i) {
      EXPECT_NEAR(std::hypot(mesh.positions[i].x, mesh.positions[i].y), 1.0F, 3e-7F);
    }
  }
}

TEST(Generate, GridLiesOnPlanes) {
  const Mesh mesh = scene::grid(3);
  for (const vec3& p : mesh.positions) {
    for (int a = 0; a < 3; ++a) EXPECT_EQ(p[a] * 8.0F, std::floor(p[a] * 8.0F));
  }
  for (const uvec3& f : mesh.faces) {
    int flat_axes = 0;
    for (int a = 0; a < 3; ++a) {
      flat_axes += mesh.positions[f.x][a] == mesh.positions[f.y][a] &&
                   mesh.positions[f.x][a] == mesh.positions[f.z][a];
    }
    EXPECT_EQ(flat_axes, 1);
  }
}

TEST(Generate, SameCentreExactly) {
  const Mesh mesh = scene::same_centre(500, 9);
  for (const uvec3& f : mesh.faces) {
    for (int a = 0; a < 3; ++a) {
      const auto [lo, hi] =
          std::minmax({mesh.positions[f.x][a], mesh.positions[f.y][a], mesh.positions[f.z][a]});
      EXPECT_EQ(lo, -hi);
      EXPECT_GT(hi, 0.0F);
    }
  }
}

TEST(Generate, StaircaseSharesEverLongerPrefixes) {
  const Mesh mesh = scene::staircase(63);
  const Box box = bounds(mesh);
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(box.lo[a], 0.0F);
    EXPECT_GT(box.hi[a], 0.5F);
    EXPECT_LT(box.hi[a], 1.0F);
  }
  // Morton codes of the box centres on a lattice of 21 bits an axis over the unit cube.
  std::uint64_t expected = std::uint64_t{1} << 62;
  for (const uvec3& f : mesh.faces) {
    std::uint64_t code = 0;
    for (int level = 0; level < 63; ++level) {
      const int a = level % 3;
      const auto [lo, hi] =
          std::minmax({mesh.positions[f.x][a], mesh.positions[f.y][a], mesh.positions[f.z][a]});
      const auto cell = static_cast<std::uint32_t>(0.5F * (lo + hi) * 0x1p21F);
      code = (code << 1) | ((cell >> (20 - level / 3)) & 1u);
    }
    EXPECT_EQ(code, expected);
    expected >>= 1;
  }
}

TEST(Generate, SliversHaveTheirAspect) {
  const Mesh mesh = scene::slivers(200, 1000.0F, 3);
  for (const uvec3& f : mesh.faces) {
    const auto length = [&](std::uint32_t i, std::uint32_t j) {
      const vec3 p = mesh.positions[i];
      const vec3 q = mesh.positions[j];
      return std::hypot(p.x - q.x, p.y - q.y, p.z - q.z);
    };
    EXPECT_NEAR(length(f.x, f.y) / length(f.x, f.z), 1000.0F, 10.0F);
  }
}

TEST(Generate, SmallInLarge) {
  const Mesh mesh = scene::small_in_large(50, 1e4F, 1);
  const Box box = bounds(mesh);
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(box.lo[a], 0.0F);
    EXPECT_EQ(box.hi[a], 1e4F);
  }
}

TEST(Generate, RandomBitsHaveEveryKindOfNumber) {
  const Mesh mesh = scene::random_bits(20000, 1);
  int nan = 0;
  int infinite_or_huge = 0;
  int denormal = 0;
  for (const vec3& p : mesh.positions) {
    for (int a = 0; a < 3; ++a) {
      nan += std::isnan(p[a]);
      infinite_or_huge += std::fabs(p[a]) > 1e38F;
      denormal += std::fpclassify(p[a]) == FP_SUBNORMAL;
    }
  }
  EXPECT_GT(nan, 0);
  EXPECT_GT(infinite_or_huge, 0);
  EXPECT_GT(denormal, 0);
}

TEST(Generate, OffsetScaledJoined) {
  const Mesh mesh = scene::soup(10, 1);
  const Mesh moved = scene::offset(mesh, {1, 2, 3});
  const Mesh larger = scene::scaled(mesh, 20);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    EXPECT_EQ(moved.positions[i].y, mesh.positions[i].y + 2.0F);
    EXPECT_EQ(larger.positions[i].z, mesh.positions[i].z * 0x1p20F);
  }
  EXPECT_EQ(scene::scaled(larger, -20).positions, mesh.positions);
  const Mesh both = scene::joined(mesh, moved);
  expect_whole(both, 20);
  EXPECT_EQ(both.positions[both.faces[10].x], moved.positions[moved.faces[0].x]);
}

TEST(Generate, ShuffledSaysHow) {
  const Mesh mesh = scene::soup(100, 1);
  std::vector<std::uint32_t> permutation;
  const Mesh other = scene::shuffled(mesh, 5, &permutation);
  ASSERT_EQ(permutation.size(), 100U);
  EXPECT_NE(other.faces, mesh.faces);
  EXPECT_EQ(std::set<std::uint32_t>(permutation.begin(), permutation.end()).size(), 100U);
  for (std::size_t i = 0; i < 100; ++i) EXPECT_EQ(other.faces[i], mesh.faces[permutation[i]]);
}

TEST(Generate, AxisRaysAreParallelToAxes) {
  const Mesh mesh = scene::sphere(2);
  std::size_t minus_zero = 0;
  std::size_t exact = 0;
  const auto rays = scene::axis_rays(mesh, 2000, 1);
  for (const Ray& ray : rays) {
    int along = 0;
    for (int a = 0; a < 3; ++a) {
      along += std::fabs(ray.direction[a]) == 1.0F;
      minus_zero += ray.direction[a] == 0.0F && std::signbit(ray.direction[a]);
    }
    EXPECT_EQ(along, 1);
    for (const vec3& p : mesh.positions) {
      int same = 0;
      for (int a = 0; a < 3; ++a) same += ray.direction[a] == 0.0F && ray.origin[a] == p[a];
      if (same == 2) {
        ++exact;
        break;
      }
    }
  }
  EXPECT_GT(minus_zero, 1500U);
  EXPECT_GT(exact, 800U);
  EXPECT_LT(exact, 1500U);
}

TEST(Generate, RaysAtFeaturesComeFromOutsideTo) {
  const Mesh mesh = scene::sphere(2);
  const auto rays = scene::rays_at_features(mesh, 400, 1);
  ASSERT_EQ(rays.size(), 400U);
  for (const Ray& ray : rays) {
    for (int a = 0; a < 3; ++a) {
      EXPECT_TRUE(std::isfinite(ray.direction[a]));
      EXPECT_LE(std::fabs(ray.origin[a]), 2.0F);
      EXPECT_LE(std::fabs(ray.origin[a] + ray.direction[a]), 1.00001F);
    }
  }
}

/// Frozen: a change here changes every number that was ever measured on these.
TEST(Generate, BitsStay) {
  EXPECT_EQ(hash(scene::soup(1000, 1)), 1760638696072786193u);
  EXPECT_EQ(hash(scene::grid(4)), 1552032061745068050u);
  EXPECT_EQ(hash(scene::sphere(3)), 1066390099720738101u);
  EXPECT_EQ(hash(scene::slivers(100, 1e4F, 2)), 14665983183007459983u);
  EXPECT_EQ(hash(scene::same_centre(100, 3)), 2277393440379108873u);
  EXPECT_EQ(hash(scene::needles(100, 5)), 3865071640251337161u);
  EXPECT_EQ(hash(scene::small_in_large(100, 1e5F, 6)), 13483666745396512283u);
  EXPECT_EQ(hash(scene::fan(100)), 9932908168523566112u);
  EXPECT_EQ(hash(scene::staircase(63)), 17612975500361993098u);
  EXPECT_EQ(hash(scene::random_bits(100, 7)), 15669846929237933770u);
  EXPECT_EQ(hash(scene::shuffled(scene::grid(4), 8)), 11105806999411239298u);
  EXPECT_EQ(hash(scene::random_rays(Box{}, 100, 9)), 15622707555020432146u);
  EXPECT_EQ(hash(scene::rays_at_features(scene::sphere(1), 100, 10)), 12127394139258238465u);
  EXPECT_EQ(hash(scene::axis_rays(scene::sphere(1), 100, 11)), 1020207594843182806u);
}

}  // namespace
}  // namespace zkd::test
