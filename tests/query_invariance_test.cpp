// SPDX-License-Identifier: Apache-2.0
//
// What must not change an answer: powers of two, where a ray's interval is cut, what lies behind
// the hit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <zkd/zkd.hpp>

#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/rays.hpp"

namespace zkd {
namespace {

using test::print;
using test::same_bits;

BuildOptions options_for(References references) {
  BuildOptions options;
  options.references = references;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

constexpr References policies[] = {References::once, References::all};

// ---- Powers of two ------------------------------------------------------------------------------

// The scene and the ray's origin and direction times 2^e: the same t, u, v and triangle.
TEST(QueryInvariance, ScalingTheSceneByPowersOfTwo) {
  for (const int kind : {0, 1, 2, 3, 5, 7, 8, 9, 11, 14, 16, 18, 29}) {
    const test::NamedMesh m = test::small_mesh(kind, 80);
    for (const References references : policies) {
      const test::PlatformTree at_one(m.mesh.view(), options_for(references));
      std::vector<Ray> rays = scene::rays_at_features(m.mesh, 200, 80);
      const std::vector<Ray> random = scene::random_rays(at_one.host().view().bounds(), 50, 80);
      rays.insert(rays.end(), random.begin(), random.end());
      const std::vector<Hit> want = at_one.closest_hits(rays);
      for (const int e : {-100, -60, -33, -20, -3, 1, 17, 30, 45, 100}) {
        const scene::Mesh scaled = scene::scaled(m.mesh, e);
        const bool exact =
            std::equal(scaled.positions.begin(), scaled.positions.end(), m.mesh.positions.begin(),
                       [e](const glm::vec3& a, const glm::vec3& b) {
                         return std::ldexp(a.x, -e) == b.x && std::ldexp(a.y, -e) == b.y &&
                                std::ldexp(a.z, -e) == b.z;
                       });
        if (!exact) continue;  // the input itself underflows or overflows
        const test::PlatformTree tree(scaled.view(), options_for(references));
        ASSERT_EQ(tree.host().view().leaf_count(), at_one.host().view().leaf_count());
        ASSERT_TRUE(std::equal(tree.host().references().begin(), tree.host().references().end(),
                               at_one.host().references().begin(),
                               at_one.host().references().end()));
        const float s = std::ldexp(1.0F, e);
        std::vector<Ray> shorter = rays;  // only the origin is scaled
        std::vector<Ray> along = rays;    // the direction too
        for (std::size_t i = 0; i < rays.size(); ++i) {
          shorter[i].origin *= s;
          along[i].origin *= s;
          along[i].direction *= s;
        }
        const std::vector<Hit> longer_t = tree.closest_hits(shorter);
        const std::vector<Hit> same_t = tree.closest_hits(along);
        for (std::size_t i = 0; i < rays.size(); ++i) {
          if (shorter[i].origin / s != rays[i].origin) continue;
          if (along[i].direction / s == rays[i].direction) {
            ASSERT_TRUE(same_bits(same_t[i], want[i]))
                << m.name << " times 2^" << e << ", " << to_string(references) << ": "
                << print(same_t[i]) << " instead of " << print(want[i]) << ", " << print(rays[i]);
          }
          Hit longer = want[i];
          longer.t *= s;
          if (std::ldexp(longer.t, -e) != want[i].t && test::is_hit(want[i])) continue;
          ASSERT_TRUE(same_bits(longer_t[i], longer))
              << m.name << " times 2^" << e << ", " << to_string(references) << ": "
              << print(longer_t[i]) << " instead of " << print(longer) << ", " << print(rays[i]);
        }
      }
    }
  }
}

// ---- Intervals ----------------------------------------------------------------------------------

TEST(QueryInvariance, SplittingTheInterval) {
  for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
    const test::NamedMesh m = test::small_mesh(kind, 81);
    test::Random random(81);
    for (const References references : policies) {
      const test::PlatformTree tree(m.mesh.view(), options_for(references));
      const std::vector<Ray> rays = test::RayMaker(m.mesh, tree.host().view(), 81).all_kinds(360);
      const std::vector<Hit> whole = tree.closest_hits(rays);
      std::vector<Ray> near;
      std::vector<Ray> far;
      std::vector<std::size_t> of;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const float t = test::is_hit(whole[i]) ? whole[i].t : random.unit();
        for (const float cut : {t, test::ulps(t, 1), test::ulps(t, -1), 0.5F * t, 1.5F * t}) {
          if (!(cut >= rays[i].t_min && cut <= rays[i].t_max)) continue;
          near.push_back(rays[i]);
          near.back().t_max = cut;
          far.push_back(rays[i]);
          far.back().t_min = cut;
          of.push_back(i);
        }
      }
      const std::vector<Hit> near_hits = tree.closest_hits(near);
      const std::vector<Hit> far_hits = tree.closest_hits(far);
      for (std::size_t k = 0; k < of.size(); ++k) {
        const Hit& both = test::is_hit(near_hits[k]) ? near_hits[k] : far_hits[k];
        ASSERT_TRUE(same_bits(both, whole[of[k]]))
            << m.name << ", " << to_string(references) << ", cut at " << far[k].t_min << ": "
            << print(both) << " instead of " << print(whole[of[k]]) << ", " << print(rays[of[k]]);
      }
    }
  }
}

// ---- What lies behind ---------------------------------------------------------------------------

TEST(QueryInvariance, ATriangleBehindTheHitLeavesTheHit) {
  for (const int kind : {0, 2, 3, 8, 11, 18, 20}) {
    const test::NamedMesh m = test::small_mesh(kind, 82);
    for (const References references : policies) {
      const test::PlatformTree tree(m.mesh.view(), options_for(references));
      const Box box = tree.host().view().bounds();
      const std::vector<Ray> rays = scene::rays_at_features(m.mesh, 60, 82);
      const std::vector<Hit> hits = tree.closest_hits(rays);
      int tried = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const Ray& ray = rays[i];
        const Hit& before = hits[i];
        if (!test::is_hit(before)) continue;
        // Across the ray, a little behind the hit, within the scene box.
        scene::Mesh more = m.mesh;
        const auto first = static_cast<std::uint32_t>(more.positions.size());
        const glm::vec3 behind = ray.origin + (before.t * 1.125F) * ray.direction;
        const int axis = std::abs(ray.direction.x) > std::abs(ray.direction.y) ? 0 : 1;
        bool within = true;
        for (int c = 0; c < 3; ++c) {
          glm::vec3 p = behind;
          p[(axis + 1) % 3] += 0.01F * static_cast<float>(c - 1);
          p[(axis + 2) % 3] += 0.01F * static_cast<float>(c % 2);
          for (int a = 0; a < 3; ++a) {
            within = within && p[a] >= box.lo[a] && p[a] <= box.hi[a];
          }
          more.positions.push_back(p);
        }
        if (!within) continue;
        ++tried;
        more.faces.emplace_back(first, first + 1, first + 2);
        const test::PlatformTree other(more.view(), options_for(references));
        const Hit after = other.closest_hits(std::span(rays).subspan(i, 1))[0];
        if (after.triangle + 1 == more.faces.size()) continue;  // it was not behind after all
        ASSERT_TRUE(same_bits(after, before))
            << m.name << ", " << to_string(references) << ": " << print(after) << " instead of "
            << print(before) << ", " << print(ray);
      }
      if (kind == 0) {
        EXPECT_GT(tried, 10);
      }
    }
  }
}

}  // namespace
}  // namespace zkd
