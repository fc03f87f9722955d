// SPDX-License-Identifier: Apache-2.0
//
// Bugs that were found once, each as a named test.
#include <gtest/gtest.h>

#include <vector>

#include <zkd/zkd.hpp>

#include "scene/random.hpp"
#include "support/hits.hpp"
#include "support/platform_tree.hpp"

namespace zkd {
namespace {

// A far origin is moved along the ray and rounded to float for the boxes. In a scene much smaller
// than its distance from 0 that rounding is larger than the padding relative to the scene.
TEST(QueryFound, FarOriginsOfScenesAwayFromZero) {
  scene::Random random(7);
  for (const float offset : {30.0F, 1.0e2F, 1.0e4F, 1.0e5F}) {
    std::vector<glm::vec3> corners;
    for (int i = 0; i < 40; ++i) {
      const glm::vec3 at{offset + 4.0F * random.unit(), 4.0F * random.unit(), 4.0F * random.unit()};
      for (int c = 0; c < 3; ++c)
        corners.push_back(at + glm::vec3(random.unit(), random.unit(), random.unit()));
    }
    const TriangleView view{std::span<const glm::vec3>(corners)};
    for (const References references : {References::once, References::budget, References::all}) {
      const test::PlatformTree tree(view, {.references = references, .leaf_size = 1});
      std::vector<Ray> rays;
      for (int i = 0; i < 4000; ++i) {
        const glm::vec3 target = corners[random.below(static_cast<std::uint32_t>(corners.size()))];
        glm::vec3 direction{random.between(-2.0F, 2.0F), random.between(-1.0F, 1.0F), 1.0F};
        if (i % 2 == 0) direction.y = 0.0F;
        direction *= 20.0F * offset;
        rays.push_back({target - direction, 0.0F, direction});
      }
      const std::vector<Hit> hits = tree.closest_hits(rays);
      const std::vector<Hit> brute = tree.brute_force_hits(rays);
      std::size_t found = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_TRUE(test::same_bits(hits[i], brute[i]))
            << "offset " << offset << ", ray " << i << ": " << test::print(hits[i]) << " for "
            << test::print(brute[i]);
        found += test::is_hit(hits[i]) ? 1 : 0;
      }
      EXPECT_GT(found, rays.size() / 20);
    }
  }
}

// Edge functions above the smallest that single precision holds, but not what they weigh in t.
TEST(QueryFound, NearHitsOfSmallTrianglesKeepTheirT) {
  const float s = 0x1p-32F;
  std::vector<glm::vec3> corners;
  for (const float z : {2.0e-27F, 1.0e-27F}) {
    corners.insert(corners.end(), {{-s, -s, z}, {s, -s, z}, {0, s, z}});
  }
  corners.insert(corners.end(), {{1, 0, 0}, {1, 1, 0}, {1, 0, 1}});
  const TriangleView view{std::span<const glm::vec3>(corners)};
  const test::PlatformTree tree(view);
  for (const float t_min : {0.0F, 1.0e-30F}) {
    const std::vector<Ray> ray = {{{0, 0, 0}, t_min, {0, 0, 1}}};
    const Hit hit = tree.closest_hits(ray)[0];
    ASSERT_TRUE(test::is_hit(hit));
    EXPECT_EQ(hit.triangle, 1u);
    EXPECT_FLOAT_EQ(hit.t, 1.0e-27F);
  }
}

// A needle whose line passes the ray's origin: sheared coordinates cancel to nothing in single
// precision, and the sign of an edge function was noise.
TEST(QueryFound, NeedleThatPointsAtTheOrigin) {
  const std::vector<glm::vec3> corners = {{0x1.2e9a22p-53F, -0x1.ae7f3ep+126F, 0x1.d0ed6cp+13F},
                                          {0x1.245d94p-108F, -0x1.bc8e4ep-13F, 0x1.13f2bp-6F},
                                          {-0x1.19374ap+9F, -0x1.b2ca38p+125F, -0x1.2446ecp-113F}};
  const TriangleView view{std::span<const glm::vec3>(corners)};
  const test::PlatformTree tree(view);
  const std::vector<Ray> ray = {{{-0x1.ca6db8p+56F, -0x1.986e58p+124F, -0x1.713966p-83F},
                                 0.0F,
                                 {0x1.89bf2p+123F, -0x1.d4cddap+126F, 0x1.2e3d5ap+126F}}};
  EXPECT_FALSE(test::is_hit(tree.closest_hits(ray)[0]));
}

// An indexed mesh without faces is empty, however many vertices it has.
TEST(QueryFound, VerticesWithoutFaces) {
  for (const std::size_t count : {1u, 2u, 3u, 4u}) {
    const std::vector<glm::vec3> vertices(count);
    const TriangleView view{vertices, std::vector<glm::uvec3>{}};
    const test::PlatformTree tree(view);
    EXPECT_TRUE(tree.host().view().empty());
    const std::vector<Ray> ray = {{{0, 0, 0}, 0.0F, {0, 0, 1}}};
    EXPECT_EQ(tree.any_hits(ray)[0], 0);
  }
}

TEST(QueryFound, SoupWithMorePositionsThanIndicesCount) {
  TriangleView view;
  const float position[3] = {};
  view.positions = position;
  view.triangle_count = max_soup_count + 1;
  view.position_count = 3 * view.triangle_count;
  for (const test::WayToBuild& way : test::ways_to_build()) {
    try {
      const Tree tree = way.build(view, {});
      ADD_FAILURE() << "accepted: " << way.name;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::too_many_triangles);
      EXPECT_EQ(error.offender(), max_soup_count + 1);
    }
  }
}

}  // namespace
}  // namespace zkd
