// SPDX-License-Identifier: Apache-2.0
//
// Queries as only the CPU has them: spans of host memory, the caller's floating-point mode,
// threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cfenv>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
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

// ---- Spans --------------------------------------------------------------------------------------

TEST(QueryCpu, ShorterSpansEndTheWork) {
  const scene::Mesh mesh = scene::sphere(2);
  const Tree tree = build(cpu::Executor{}, mesh.view());
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 100, 74);
  const std::vector<Hit> want = test::closest(tree.view(), mesh.view(), rays);
  const Hit untouched{-1, -2, -3, 12345};
  for (const std::size_t length : {0u, 1u, 37u, 100u}) {
    std::vector<Hit> hits(100, untouched);
    closest_hit({}, tree.view(), mesh.view(), rays, std::span(hits).first(length));
    std::vector<Hit> loop(100, untouched);
    closest_hit_brute_force({}, tree.view(), mesh.view(), rays, std::span(loop).first(length));
    std::vector<std::uint8_t> occluded(100, 9);
    any_hit({}, tree.view(), mesh.view(), rays, std::span(occluded).first(length));
    for (std::size_t i = 0; i < 100; ++i) {
      EXPECT_TRUE(same_bits(hits[i], i < length ? want[i] : untouched));
      EXPECT_TRUE(same_bits(loop[i], i < length ? want[i] : untouched));
      EXPECT_EQ(occluded[i], i < length ? (test::is_hit(want[i]) ? 1 : 0) : 9);
    }
    std::vector<TraversalCost> costs(std::max<std::size_t>(length, 1));
    std::fill(hits.begin(), hits.end(), untouched);
    closest_hit({}, tree.view(), mesh.view(), rays, hits, costs);
    for (std::size_t i = 0; i < 100; ++i) {
      EXPECT_TRUE(same_bits(hits[i], i < costs.size() ? want[i] : untouched)) << i;
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
      const Tree tree = build(cpu::Executor{}, c.named.mesh.view(), options_for(references));
      c.rays = test::RayMaker(c.named.mesh, tree.view(), 83).all_kinds(240);
      c.want = answers(c.named.mesh, c.rays, references);
      cases.push_back(std::move(c));
    }
  }
  return cases;
}

TEST(QueryCpu, RoundingModeOfTheCaller) {
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
TEST(QueryCpu, FlushToZeroOfTheCaller) {
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

TEST(QueryCpu, ModeIsPutBackWhenABuildThrows) {
  scene::Mesh mesh = scene::soup(10, 84);
  mesh.faces[5].x = 1000;
  ASSERT_EQ(std::fesetround(FE_UPWARD), 0);
  EXPECT_THROW((void)build(mesh.view()), Error);
  const int after = std::fegetround();
  std::fesetround(FE_TONEAREST);
  EXPECT_EQ(after, FE_UPWARD);
}

// ---- Brute force in vectors ---------------------------------------------------------------------

// Loops that end within a block of eight triangles, within what is looked at together, and between;
// with triangles among them that no build takes.
TEST(QueryCpu, BruteForceInVectorsIsTheScalarLoop) {
  std::uint64_t hits = 0;
  for (const std::uint32_t n : {1u, 7u, 8u, 9u, 511u, 512u, 513u, 1025u}) {
    scene::Mesh mesh = scene::soup(n, 90 + n);
    mesh = scene::joined(std::move(mesh), scene::random_bits(n % 4, 90));
    const Tree tree = build(mesh.view(), options_for(References::once));
    const std::vector<Ray> rays = test::RayMaker(mesh, tree.view(), n).all_kinds(200);
    for (const Intersector intersector :
         {Intersector::watertight, Intersector::fast, Intersector::single_precision,
          Intersector::double_precision, Intersector::exact}) {
      SCOPED_TRACE(std::to_string(n) + " triangles, " + to_string(intersector));
      const std::vector<Hit> want =
          test::brute_force(tree.view(), mesh.view(), rays,
                            {.instructions = cpu::InstructionSet::portable}, intersector);
      for (const std::size_t count : {1u, 64u, 65u, 200u}) {
        const std::vector<Hit> got = test::brute_force(
            tree.view(), mesh.view(), std::span(rays).first(count),
            {.threads = 3, .instructions = cpu::InstructionSet::avx2}, intersector);
        for (std::size_t i = 0; i < count; ++i) {
          ASSERT_TRUE(same_bits(got[i], want[i]))
              << print(rays[i]) << ": " << print(got[i]) << " instead of " << print(want[i]);
          hits += test::is_hit(got[i]) ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(hits, 1000u);
}

// ---- Threads ------------------------------------------------------------------------------------

TEST(QueryCpu, NumberOfThreads) {
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
