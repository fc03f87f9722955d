// SPDX-License-Identifier: Apache-2.0
//
// No ray leaves a closed surface unseen: from inside to vertices, edges, and what is an ulp beside
// them.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/random.hpp"

namespace zkd {
namespace {

using test::print;
using test::Random;

// From random points inside (within `depth` of the centre) to features of the mesh in turn.
std::vector<Ray> rays_from_inside(const scene::Mesh& mesh, const glm::vec3& centre, float depth,
                                  std::uint32_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::uvec3& f = mesh.faces[random.below(static_cast<std::uint32_t>(mesh.faces.size()))];
    const int corner = random.integer(0, 2);
    const glm::vec3& a = mesh.positions[f[corner]];
    const glm::vec3& b = mesh.positions[f[(corner + 1) % 3]];
    glm::vec3 to = a;
    if (i % 4 == 1) to = 0.5F * a + 0.5F * b;
    if (i % 4 == 2) to = a + random.unit() * (b - a);
    if (i % 4 == 3) {
      for (int axis = 0; axis < 3; ++axis) to[axis] = test::ulps(to[axis], random.integer(-8, 8));
    }
    Ray ray;
    ray.origin = centre + depth * random.in_cube();
    ray.direction = to - ray.origin;
    rays.push_back(ray);
  }
  return rays;
}

void expect_no_leak(const scene::Mesh& mesh, const std::vector<Ray>& rays,
                    const std::string& name) {
  for (const References references : {References::once, References::all}) {
    const test::PlatformTree tree(mesh.view(), {.references = references});
    for (const test::Walk walk : test::walks()) {
      const std::vector<Hit> hits = tree.closest_hits(rays, walk);
      std::size_t leaks = 0;
      std::string first;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (test::is_hit(hits[i])) continue;
        if (leaks++ == 0) first = print(rays[i]);
      }
      EXPECT_EQ(leaks, 0u) << name << ", " << to_string(references) << ", " << test::name(walk)
                           << ": of " << rays.size() << ", the first " << first;
    }
  }
}

TEST(QueryWatertight, SphereFromInside) {
  for (std::uint32_t subdivisions = 0; subdivisions <= 6; subdivisions += 2) {
    const scene::Mesh mesh = scene::sphere(subdivisions);
    expect_no_leak(mesh, rays_from_inside(mesh, glm::vec3(0), 0.25F, 60000, 90 + subdivisions),
                   "sphere " + std::to_string(subdivisions));
    expect_no_leak(mesh, rays_from_inside(mesh, glm::vec3(0), 0.0F, 20000, 91 + subdivisions),
                   "sphere from its centre " + std::to_string(subdivisions));
  }
}

TEST(QueryWatertight, ClosedConeFromInside) {
  for (const std::uint32_t n : {4u, 60u, 5000u}) {
    const scene::Mesh mesh = scene::fan(n);
    const Box box = scene::bounds(mesh);
    // Only a point that sees every target is inside for certain: count what brute force sees too.
    glm::vec3 centre;
    for (int a = 0; a < 3; ++a) centre[a] = 0.5F * box.lo[a] + 0.5F * box.hi[a];
    const std::vector<Ray> rays = rays_from_inside(mesh, centre, 0.01F, 4000, 92);
    const test::PlatformTree tree(mesh.view());
    const std::vector<Hit> loop = tree.brute_force_hits(rays);
    const std::vector<Hit> hits = tree.closest_hits(rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_TRUE(test::same_bits(hits[i], loop[i])) << print(rays[i]);
    }
  }
}

TEST(QueryWatertight, SphereScaled) {
  for (const int e : {-110, -40, -17, 33, 60, 120}) {
    const scene::Mesh mesh = scene::scaled(scene::sphere(3), e);
    expect_no_leak(mesh, rays_from_inside(mesh, glm::vec3(0), std::ldexp(0.25F, e), 20000, 93),
                   "sphere times 2^" + std::to_string(e));
  }
}

TEST(QueryWatertight, SphereFarFromTheOrigin) {
  for (const float at : {100.0F, 148376.0F, 1e6F}) {
    const scene::Mesh mesh =
        scene::offset(scene::scaled(scene::sphere(3), 3), glm::vec3(at, -at, 0.5F * at));
    expect_no_leak(mesh, rays_from_inside(mesh, {at, -at, 0.5F * at}, 1.0F, 20000, 94),
                   "sphere at " + std::to_string(at));
  }
}

// Towards the sphere from far outside, within its silhouette.
TEST(QueryWatertight, SphereFromAfar) {
  const scene::Mesh mesh = scene::sphere(4);
  Random random(95);
  for (const float distance : {10.0F, 1e3F, 1e5F, 1e7F}) {
    std::vector<Ray> rays;
    while (rays.size() < 20000) {
      const glm::vec3 away = random.in_cube();
      const float length = away.x * away.x + away.y * away.y + away.z * away.z;
      if (length < 0.25F) continue;
      // A point within half a radius of the centre: whatever rounding does, the ray passes inside.
      const glm::vec3 through = 0.25F * random.in_cube();
      Ray ray;
      ray.origin = through + away * distance;
      ray.direction = -away;
      rays.push_back(ray);
    }
    if (distance > 1e6F) {
      // An ulp of the origin is larger than the sphere is precise: still inside its half radius.
      for (Ray& ray : rays) ray.direction = -ray.origin;
    }
    expect_no_leak(mesh, rays, "from " + std::to_string(distance));
  }
}

}  // namespace
}  // namespace zkd
