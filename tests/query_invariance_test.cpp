// SPDX-License-Identifier: Apache-2.0
//
// What must not change an answer: powers of two, where a ray's interval is cut, what lies behind
// the hit, the caller's floating-point mode, threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#if defined(__SSE2__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <zkd/zkd.hpp>

#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/rays.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using test::or_miss;
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
      const Tree at_one = build(m.mesh.view(), options_for(references));
      std::vector<Ray> rays = scene::rays_at_features(m.mesh, 200, 80);
      const std::vector<Ray> random = scene::random_rays(at_one.view().bounds(), 50, 80);
      rays.insert(rays.end(), random.begin(), random.end());
      const std::vector<Hit> want = test::closest(at_one.view(), m.mesh.view(), rays);
      for (const int e : {-100, -60, -33, -20, -3, 1, 17, 30, 45, 100}) {
        const scene::Mesh scaled = scene::scaled(m.mesh, e);
        const bool exact =
            std::equal(scaled.positions.begin(), scaled.positions.end(), m.mesh.positions.begin(),
                       [e](const glm::vec3& a, const glm::vec3& b) {
                         return std::ldexp(a.x, -e) == b.x && std::ldexp(a.y, -e) == b.y &&
                                std::ldexp(a.z, -e) == b.z;
                       });
        if (!exact) continue;  // the input itself underflows or overflows
        const Tree tree = build(scaled.view(), options_for(references));
        ASSERT_EQ(tree.view().leaf_count(), at_one.view().leaf_count());
        ASSERT_TRUE(std::equal(tree.references().begin(), tree.references().end(),
                               at_one.references().begin(), at_one.references().end()));
        const float s = std::ldexp(1.0F, e);
        for (std::size_t i = 0; i < rays.size(); ++i) {
          Ray ray = rays[i];
          ray.origin *= s;
          if (ray.origin / s != rays[i].origin) continue;
          const Hit same_t = or_miss(closest_hit(
              tree.view(), scaled.view(), {ray.origin, ray.t_min, ray.direction * s, ray.t_max}));
          if ((ray.direction * s) / s == rays[i].direction) {
            ASSERT_TRUE(same_bits(same_t, want[i]))
                << m.name << " times 2^" << e << ", " << to_string(references) << ": "
                << print(same_t) << " instead of " << print(want[i]) << ", " << print(rays[i]);
          }
          Hit longer = want[i];
          longer.t *= s;
          if (std::ldexp(longer.t, -e) != want[i].t && test::is_hit(want[i])) continue;
          const Hit scaled_t = or_miss(closest_hit(tree.view(), scaled.view(), ray));
          ASSERT_TRUE(same_bits(scaled_t, longer))
              << m.name << " times 2^" << e << ", " << to_string(references) << ": "
              << print(scaled_t) << " instead of " << print(longer) << ", " << print(rays[i]);
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
      const Tree tree = build(m.mesh.view(), options_for(references));
      for (const Ray& ray : test::RayMaker(m.mesh, tree.view(), 81).all_kinds(360)) {
        const Hit whole = or_miss(closest_hit(tree.view(), m.mesh.view(), ray));
        const float t = test::is_hit(whole) ? whole.t : random.unit();
        for (const float cut : {t, test::ulps(t, 1), test::ulps(t, -1), 0.5F * t, 1.5F * t}) {
          if (!(cut >= ray.t_min && cut <= ray.t_max)) continue;
          Ray near = ray;
          near.t_max = cut;
          Ray far = ray;
          far.t_min = cut;
          Hit both = or_miss(closest_hit(tree.view(), m.mesh.view(), near));
          if (!test::is_hit(both)) both = or_miss(closest_hit(tree.view(), m.mesh.view(), far));
          ASSERT_TRUE(same_bits(both, whole))
              << m.name << ", " << to_string(references) << ", cut at " << cut << ": "
              << print(both) << " instead of " << print(whole) << ", " << print(ray);
        }
      }
    }
  }
}

// ---- What lies behind ---------------------------------------------------------------------------

TEST(QueryInvariance, ATriangleBehindTheHitLeavesTheHit) {
  for (const int kind : {0, 2, 3, 8, 11, 18, 20}) {
    const test::NamedMesh m = test::small_mesh(kind, 82);
    for (const References references : policies) {
      const Tree tree = build(m.mesh.view(), options_for(references));
      int tried = 0;
      for (const Ray& ray : scene::rays_at_features(m.mesh, 60, 82)) {
        const Hit before = or_miss(closest_hit(tree.view(), m.mesh.view(), ray));
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
            within =
                within && p[a] >= tree.view().bounds().lo[a] && p[a] <= tree.view().bounds().hi[a];
          }
          more.positions.push_back(p);
        }
        if (!within) continue;
        ++tried;
        more.faces.emplace_back(first, first + 1, first + 2);
        const Tree other = build(more.view(), options_for(references));
        const Hit after = or_miss(closest_hit(other.view(), more.view(), ray));
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

// ---- The caller's floating-point mode -----------------------------------------------------------

struct Answers {
  std::string tree;
  std::vector<Hit> hits;
  std::vector<Hit> single;
  std::vector<Hit> loop;
};

Answers answers(const scene::Mesh& mesh, const std::vector<Ray>& rays, References references) {
  Answers out;
  const Tree tree = build({.threads = 2}, mesh.view(), options_for(references));
  out.tree = verify::tree_hash(tree.view());
  out.hits = test::closest(tree.view(), mesh.view(), rays, {.threads = 2});
  out.loop = test::brute_force(tree.view(), mesh.view(), rays, {.threads = 2});
  for (const Ray& ray : rays) {
    out.single.push_back(or_miss(closest_hit(tree.view(), mesh.view(), ray)));
    if (any_hit(tree.view(), mesh.view(), ray) != test::is_hit(out.single.back())) {
      out.single.back().triangle = no_triangle - 1;
    }
  }
  return out;
}

void expect_equal(const Answers& got, const Answers& want, const std::string& what) {
  EXPECT_EQ(got.tree, want.tree) << what;
  for (std::size_t i = 0; i < want.hits.size(); ++i) {
    ASSERT_TRUE(same_bits(got.hits[i], want.hits[i])) << what << ", ray " << i;
    ASSERT_TRUE(same_bits(got.single[i], want.single[i])) << what << ", single ray " << i;
    ASSERT_TRUE(same_bits(got.loop[i], want.loop[i])) << what << ", brute force, ray " << i;
  }
}

struct ModeCase {
  test::NamedMesh named;
  References references;
  std::vector<Ray> rays;
  Answers want;
};

std::vector<ModeCase> mode_cases() {
  std::vector<ModeCase> cases;
  for (const int kind : {0, 5, 8, 14, 19, 23, 24, 25, 27, 28}) {
    for (const References references : policies) {
      ModeCase c{test::small_mesh(kind, 83), references, {}, {}};
      const Tree tree = build(c.named.mesh.view(), options_for(references));
      c.rays = test::RayMaker(c.named.mesh, tree.view(), 83).all_kinds(240);
      c.want = answers(c.named.mesh, c.rays, references);
      cases.push_back(std::move(c));
    }
  }
  return cases;
}

TEST(QueryInvariance, RoundingModeOfTheCaller) {
  for (const ModeCase& c : mode_cases()) {
    for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
      ASSERT_EQ(std::fesetround(mode), 0);
      const Answers got = answers(c.named.mesh, c.rays, c.references);
      const int after = std::fegetround();
      std::fesetround(FE_TONEAREST);
      EXPECT_EQ(after, mode) << "the mode was not put back";
      expect_equal(
          got, c.want,
          c.named.name + ", " + to_string(c.references) + ", mode " + std::to_string(mode));
    }
  }
}

#if defined(__SSE2__)
TEST(QueryInvariance, FlushToZeroOfTheCaller) {
  const unsigned before = _mm_getcsr();
  for (const ModeCase& c : mode_cases()) {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    const Answers got = answers(c.named.mesh, c.rays, c.references);
    const bool kept = _MM_GET_FLUSH_ZERO_MODE() == _MM_FLUSH_ZERO_ON &&
                      _MM_GET_DENORMALS_ZERO_MODE() == _MM_DENORMALS_ZERO_ON;
    _mm_setcsr(before);
    EXPECT_TRUE(kept) << "the mode was not put back";
    expect_equal(got, c.want, c.named.name + ", " + to_string(c.references));
  }
}
#endif

TEST(QueryInvariance, ModeIsPutBackWhenABuildThrows) {
  scene::Mesh mesh = scene::soup(10, 84);
  mesh.faces[5].x = 1000;
  ASSERT_EQ(std::fesetround(FE_UPWARD), 0);
  EXPECT_THROW((void)build(mesh.view()), Error);
  const int after = std::fegetround();
  std::fesetround(FE_TONEAREST);
  EXPECT_EQ(after, FE_UPWARD);
}

// ---- Threads ------------------------------------------------------------------------------------

TEST(QueryInvariance, NumberOfThreads) {
  const scene::Mesh mesh = scene::small_in_large(5000, 1e4F, 85);
  for (const References references : policies) {
    const Tree tree = build(mesh.view(), options_for(references));
    const std::vector<Ray> rays = test::RayMaker(mesh, tree.view(), 85).all_kinds(10007);
    const std::vector<Hit> want = test::closest(tree.view(), mesh.view(), rays, {.threads = 1});
    std::vector<TraversalCost> want_costs(rays.size());
    std::vector<Hit> hits(rays.size());
    closest_hit({.threads = 1}, tree.view(), mesh.view(), rays, hits, want_costs);
    for (int threads = 0; threads <= 4; ++threads) {
      std::vector<TraversalCost> costs(rays.size());
      closest_hit({.threads = threads}, tree.view(), mesh.view(), rays, hits, costs);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_TRUE(same_bits(hits[i], want[i])) << threads << " threads, " << print(rays[i]);
        ASSERT_EQ(costs[i].node_visits, want_costs[i].node_visits);
        ASSERT_EQ(costs[i].triangle_tests, want_costs[i].triangle_tests);
      }
    }
  }
}

}  // namespace
}  // namespace zkd
