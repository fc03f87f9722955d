// SPDX-License-Identifier: Apache-2.0
//
// for_each_hit and closest_hits as only the CPU has them: visitors, threads, spans of host memory,
// the caller's floating-point mode.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cfenv>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/rays.hpp"

namespace zkd {
namespace {

using test::same_bits;

constexpr Intersector every_intersector[] = {Intersector::watertight, Intersector::fast,
                                             Intersector::single_precision,
                                             Intersector::double_precision, Intersector::exact};

struct Scene {
  scene::Mesh mesh;
  Tree tree;
  std::vector<Ray> rays;

  explicit Scene(std::uint32_t count, References references = References::once)
      : mesh(scene::soup(3000, 21)),
        tree(build(mesh.view(), {.references = references})),
        rays(scene::random_rays(tree.view().bounds(), count, 22)) {}

  [[nodiscard]] std::vector<Hit> all_hits(const Ray& ray, Intersector intersector) const {
    std::vector<Hit> hits;
    for_each_hit(
        tree.view(), mesh.view(), ray, [&](const Hit& hit) { hits.push_back(hit); }, intersector);
    return hits;
  }
  [[nodiscard]] std::vector<Hit> loop(const Ray& ray, Intersector intersector) const {
    std::vector<Hit> hits(mesh.faces.size());
    std::uint32_t count = 0;
    closest_hits_brute_force({.threads = 1}, tree.view(), mesh.view(), std::span(&ray, 1),
                             static_cast<std::uint32_t>(hits.size()), hits, std::span(&count, 1),
                             intersector);
    hits.resize(count);
    return hits;
  }
};

void expect_same(const std::vector<Hit>& got, std::span<const Hit> want) {
  ASSERT_EQ(got.size(), want.size());
  for (std::size_t i = 0; i < want.size(); ++i) ASSERT_TRUE(same_bits(got[i], want[i])) << i;
}

// ---- Visitors -----------------------------------------------------------------------------------

TEST(HitsCpu, StopsAfterEachHit) {
  for (const References references : {References::once, References::budget, References::all}) {
    const Scene s(20, references);
    for (const Intersector intersector : every_intersector) {
      for (const Ray& ray : s.rays) {
        const std::vector<Hit> all = s.loop(ray, intersector);
        expect_same(s.all_hits(ray, intersector), all);
        for (std::size_t most = 1; most <= all.size(); ++most) {
          std::vector<Hit> hits;
          for_each_hit(
              s.tree.view(), s.mesh.view(), ray,
              [&](const Hit& hit) {
                hits.push_back(hit);
                return hits.size() < most;
              },
              intersector);
          expect_same(hits, std::span(all).first(most));
          if (HasFatalFailure()) return;
        }
      }
    }
  }
}

std::size_t counted = 0;
void count(const Hit&) { ++counted; }

TEST(HitsCpu, VisitorsOfEveryKind) {
  const Scene s(1);
  Ray ray;
  std::vector<Hit> all;
  for (std::uint32_t seed = 0; all.empty(); ++seed) {
    ray = scene::random_rays(s.tree.view().bounds(), 1, seed)[0];
    all = s.loop(ray, Intersector::watertight);
  }
  counted = 0;
  for_each_hit(s.tree.view(), s.mesh.view(), ray, count);
  EXPECT_EQ(counted, all.size());
  for_each_hit(s.tree.view(), s.mesh.view(), ray, &count);
  EXPECT_EQ(counted, 2 * all.size());
  struct Kept {
    std::vector<Hit> hits;
    void operator()(const Hit& hit) { hits.push_back(hit); }
  } kept;
  for_each_hit(s.tree.view(), s.mesh.view(), ray, kept);  // by reference: it keeps what it is given
  expect_same(kept.hits, all);
  const auto constant = [&](Hit hit) { kept.hits.push_back(hit); };
  for_each_hit(s.tree.view(), s.mesh.view(), ray, constant);
  EXPECT_EQ(kept.hits.size(), 2 * all.size());
}

TEST(HitsCpu, AVisitorMayTraceRays) {
  const Scene s(40);
  for (const Ray& ray : s.rays) {
    const std::vector<Hit> all = s.loop(ray, Intersector::watertight);
    std::vector<Hit> hits;
    for_each_hit(s.tree.view(), s.mesh.view(), ray, [&](const Hit& hit) {
      const std::vector<Hit> inner = s.all_hits(ray, Intersector::watertight);
      ASSERT_EQ(inner.size(), all.size());
      ASSERT_TRUE(same_bits(inner[hits.size()], hit));
      hits.push_back(hit);
    });
    expect_same(hits, all);
  }
}

TEST(HitsCpu, WhatAVisitorThrowsPassesThrough) {
  const Scene s(40);
  for (const Ray& ray : s.rays) {
    const std::size_t all = s.loop(ray, Intersector::watertight).size();
    for (std::size_t at = 0; at < all; ++at) {
      ASSERT_EQ(std::fesetround(FE_UPWARD), 0);
      std::size_t seen = 0;
      std::string what;
      try {
        for_each_hit(s.tree.view(), s.mesh.view(), ray, [&](const Hit&) {
          if (seen++ == at) throw std::runtime_error("enough");
        });
      } catch (const std::runtime_error& error) {
        what = error.what();
      }
      const int mode = std::fegetround();
      std::fesetround(FE_TONEAREST);
      ASSERT_EQ(what, "enough");
      ASSERT_EQ(seen, at + 1);
      ASSERT_EQ(mode, FE_UPWARD) << "the mode was not put back";
    }
  }
}

// ---- Threads ------------------------------------------------------------------------------------

TEST(HitsCpu, NumberOfThreadsAndInstructions) {
  for (const References references : {References::once, References::budget, References::all}) {
    const Scene s(3001, references);
    std::vector<std::vector<Hit>> want;
    for (const Ray& ray : s.rays) want.push_back(s.all_hits(ray, Intersector::watertight));
    constexpr std::uint32_t places = 5;
    for (int threads = 0; threads <= 4; ++threads) {
      for (const auto set : {cpu::InstructionSet::portable, cpu::InstructionSet::avx2}) {
        const cpu::Executor executor{.threads = threads, .instructions = set};
        std::vector<std::vector<Hit>> got(s.rays.size());
        for_each_hit(executor, s.tree.view(), s.mesh.view(), s.rays,
                     [&](std::size_t ray, const Hit& hit) { got[ray].push_back(hit); });
        std::vector<Hit> first(s.rays.size() * places);
        std::vector<std::uint32_t> counts(s.rays.size());
        closest_hits(executor, s.tree.view(), s.mesh.view(), s.rays, places, first, counts);
        for (std::size_t i = 0; i < want.size(); ++i) {
          expect_same(got[i], want[i]);
          ASSERT_EQ(counts[i], std::min<std::size_t>(places, want[i].size()));
          for (std::uint32_t k = 0; k < counts[i]; ++k)
            ASSERT_TRUE(same_bits(first[i * places + k], want[i][k]));
          if (HasFatalFailure()) return;
        }
      }
    }
  }
}

TEST(HitsCpu, FalseEndsOneRayOnly) {
  const Scene s(2000);
  std::vector<std::uint32_t> visits(s.rays.size());
  for_each_hit(cpu::Executor{.threads = 3}, s.tree.view(), s.mesh.view(), s.rays,
               [&](std::size_t ray, const Hit&) { return ++visits[ray] < 2 || ray % 2 == 0; });
  for (std::size_t i = 0; i < s.rays.size(); ++i) {
    const std::size_t all = s.all_hits(s.rays[i], Intersector::watertight).size();
    ASSERT_EQ(visits[i], i % 2 == 0 ? all : std::min<std::size_t>(all, 2)) << i;
  }
}

TEST(HitsCpu, AnExceptionAmongManyRays) {
  const Scene s(20000);
  for (const int threads : {1, 3}) {
    std::atomic<std::uint32_t> thrown = 0;
    std::atomic<std::uint32_t> visits = 0;
    std::uint32_t caught = 0;
    try {
      for_each_hit(cpu::Executor{.threads = threads}, s.tree.view(), s.mesh.view(), s.rays,
                   [&](std::size_t ray, const Hit&) {
                     ++visits;
                     if (ray % 100 == 50) throw std::runtime_error(std::to_string(++thrown));
                   });
    } catch (const std::runtime_error&) {
      ++caught;
    }
    EXPECT_EQ(caught, 1u);
    EXPECT_LE(thrown, static_cast<std::uint32_t>(threads)) << "each thread stops at its first";
    EXPECT_LT(visits, s.rays.size() / 2) << "other rays were traced on";
  }
}

// ---- Spans --------------------------------------------------------------------------------------

TEST(HitsCpu, ShorterSpansEndTheWork) {
  const Scene s(100);
  constexpr std::uint32_t places = 3;
  const Hit untouched{-1, -2, -3, 12345};
  std::vector<Hit> want(300);
  std::vector<std::uint32_t> want_counts(100);
  closest_hits({}, s.tree.view(), s.mesh.view(), s.rays, places, want, want_counts);
  const auto check = [&](std::size_t hits_length, std::size_t counts_length,
                         std::size_t costs_length, std::size_t rays) {
    std::vector<Hit> hits(300, untouched);
    std::vector<Hit> loop(300, untouched);
    std::vector<std::uint32_t> counts(100, 77);
    std::vector<TraversalCost> costs(100, {99, 99});
    closest_hits({}, s.tree.view(), s.mesh.view(), s.rays, places,
                 std::span(hits).first(hits_length), std::span(counts).first(counts_length),
                 std::span(costs).first(costs_length));
    closest_hits_brute_force({}, s.tree.view(), s.mesh.view(), s.rays, places,
                             std::span(loop).first(std::min(hits_length, 3 * rays)));
    for (std::size_t i = 0; i < 300; ++i) {
      ASSERT_TRUE(same_bits(hits[i], i < 3 * rays ? want[i] : untouched)) << i;
      ASSERT_TRUE(same_bits(loop[i], i < 3 * rays ? want[i] : untouched)) << i;
    }
    for (std::size_t i = 0; i < 100; ++i) {
      ASSERT_EQ(counts[i], counts_length != 0 && i < rays ? want_counts[i] : 77) << i;
      if (costs_length == 0 || i >= rays) {
        ASSERT_EQ(costs[i].node_visits, 99u);
      } else {
        ASSERT_LE(want_counts[i], costs[i].triangle_tests);
      }
    }
  };
  check(300, 100, 100, 100);
  check(300, 0, 0, 100);
  check(299, 0, 0, 99);
  check(0, 0, 0, 0);
  check(300, 37, 100, 37);
  check(31, 37, 11, 10);
  check(300, 100, 11, 11);
}

TEST(HitsCpu, NoPlaces) {
  const Scene s(100);
  std::vector<std::uint32_t> counts(100, 5);
  closest_hits({}, s.tree.view(), s.mesh.view(), s.rays, 0, {}, counts);
  EXPECT_EQ(counts, std::vector<std::uint32_t>(100, 0));
}

// ---- The caller's floating-point mode -----------------------------------------------------------

TEST(HitsCpu, RoundingModeOfTheCaller) {
  const Scene s(200);
  for (const Ray& ray : s.rays) {
    const std::vector<Hit> want = s.all_hits(ray, Intersector::watertight);
    for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
      ASSERT_EQ(std::fesetround(mode), 0);
      const std::vector<Hit> got = s.all_hits(ray, Intersector::watertight);
      const int after = std::fegetround();
      std::fesetround(FE_TONEAREST);
      ASSERT_EQ(after, mode) << "the mode was not put back";
      expect_same(got, want);
    }
  }
}

}  // namespace
}  // namespace zkd
