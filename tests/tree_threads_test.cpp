// SPDX-License-Identifier: Apache-2.0
//
// Builds and queries on the CPU that run at the same time.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <thread>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/hits.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using verify::tree_hash;

constexpr BuildOptions skipping(References references) {
  BuildOptions options;
  options.references = references;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

TEST(TreeThreads, BuiltBySeveralThreadsAtOnce) {
  const scene::Mesh mesh = scene::soup(20000, 24);
  for (const References references : {References::once, References::budget, References::all}) {
    const std::string want =
        tree_hash(build(cpu::Executor{}, mesh.view(), skipping(references)).view());
    std::vector<std::string> got(4);
    std::vector<std::thread> builders;
    for (std::size_t i = 0; i < got.size(); ++i) {
      builders.emplace_back([&, i] {
        for (int again = 0; again < 3; ++again) {
          got[i] = tree_hash(build({.threads = 2}, mesh.view(), skipping(references)).view());
          if (got[i] != want) return;
        }
      });
    }
    for (std::thread& builder : builders) builder.join();
    for (const std::string& hash : got) EXPECT_EQ(hash, want);
  }
}

// Some threads build while others shoot rays through one tree that they share, single rays and
// spans.
TEST(TreeThreads, BuildsAndQueriesAtOnce) {
  const scene::Mesh mesh = scene::soup(20000, 25);
  for (const References references : {References::once, References::budget, References::all}) {
    const Tree tree = build(cpu::Executor{}, mesh.view(), skipping(references));
    const std::string want = tree_hash(tree.view());
    const std::vector<Ray> rays = scene::rays_at_features(mesh, 2000, 26);
    const std::vector<Hit> hits = test::closest(tree.view(), mesh.view(), rays, {.threads = 1});
    std::vector<std::uint64_t> wrong(6, 0);
    std::vector<std::thread> workers;
    for (std::size_t i = 0; i < wrong.size(); ++i) {
      workers.emplace_back([&, i] {
        if (i % 3 == 0) {
          const Tree again = build({.threads = 2}, mesh.view(), skipping(references));
          wrong[i] += tree_hash(again.view()) != want ? 1 : 0;
          wrong[i] += tree_hash(tree.clone().view()) != want ? 1 : 0;
        } else if (i % 3 == 1) {
          const std::vector<Hit> all =
              test::closest(tree.view(), mesh.view(), rays, {.threads = 2});
          wrong[i] += std::equal(all.begin(), all.end(), hits.begin(), test::same_bits) ? 0 : 1;
        } else {
          for (std::size_t r = 0; r < rays.size(); ++r) {
            const Hit hit = test::or_miss(closest_hit(tree.view(), mesh.view(), rays[r]));
            wrong[i] += test::same_bits(hit, hits[r]) ? 0 : 1;
            wrong[i] += any_hit(tree.view(), mesh.view(), rays[r]) == test::is_hit(hits[r]) ? 0 : 1;
          }
        }
      });
    }
    for (std::thread& worker : workers) worker.join();
    EXPECT_EQ(wrong, std::vector<std::uint64_t>(6, 0)) << to_string(references);
    EXPECT_EQ(tree_hash(tree.view()), want);
  }
}

}  // namespace
}  // namespace zkd
