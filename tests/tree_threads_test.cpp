// SPDX-License-Identifier: Apache-2.0
//
// Builds on the CPU that run at the same time.
#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
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
  for (const References references : {References::once, References::all}) {
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

}  // namespace
}  // namespace zkd
