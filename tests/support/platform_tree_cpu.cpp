// SPDX-License-Identifier: Apache-2.0
//
// Whole trees on the CPU. See support/platform_tree.hpp.
#include "support/platform_tree.hpp"

#include <utility>

#include <gtest/gtest.h>

#include <zkd/build.hpp>
#include <zkd/hits.hpp>

#include "support/memory.hpp"

namespace zkd::test {
namespace {

cpu::Executor executor(Walk walk) {
  cpu::Executor executor{.threads = 2};
  if (walk == Walk::portable) executor.instructions = cpu::InstructionSet::portable;
  if (walk == Walk::avx2) executor.instructions = cpu::InstructionSet::avx2;
  return executor;
}

}  // namespace

Backend backend() { return Backend::cpu; }

std::uint32_t build_thinning() { return 1; }

std::vector<Walk> walks() { return {Walk::portable, Walk::avx2}; }

std::vector<Intersector> intersectors() {
  return {Intersector::watertight, Intersector::fast, Intersector::single_precision,
          Intersector::double_precision, Intersector::exact};
}

struct PlatformTree::There {
  Tree tree;
  TriangleView triangles;
};

PlatformTree::PlatformTree(const TriangleView& triangles, const BuildOptions& options)
    : there_(new There{test::build(triangles, options), triangles}) {}
PlatformTree::PlatformTree(const Tree& tree, const TriangleView& triangles)
    : there_(new There{tree.clone(), triangles}) {}
PlatformTree::PlatformTree(PlatformTree&& other) noexcept = default;
PlatformTree::~PlatformTree() = default;

const Tree& PlatformTree::host() const { return there_->tree; }

std::vector<Hit> PlatformTree::closest_hits(std::span<const Ray> rays, Walk walk,
                                            std::vector<TraversalCost>* costs,
                                            Intersector intersector) const {
  std::vector<Hit> hits(rays.size());
  std::span<TraversalCost> to;
  if (costs != nullptr) {
    costs->resize(rays.size());
    to = *costs;
  }
  closest_hit(executor(walk), there_->tree.view(), there_->triangles, rays, hits, to, intersector);
  return hits;
}

std::vector<std::uint8_t> PlatformTree::any_hits(std::span<const Ray> rays, Walk walk,
                                                 Intersector intersector) const {
  std::vector<std::uint8_t> occluded(rays.size(), 7);
  any_hit(executor(walk), there_->tree.view(), there_->triangles, rays, occluded, {}, intersector);
  return occluded;
}

std::vector<Hit> PlatformTree::hits_in_order(std::span<const Ray> rays, std::uint32_t hits_per_ray,
                                             std::vector<std::uint32_t>& counts, Walk walk,
                                             Intersector intersector) const {
  std::vector<Hit> hits(rays.size() * hits_per_ray);
  counts.assign(rays.size(), 7);
  zkd::closest_hits(executor(walk), there_->tree.view(), there_->triangles, rays, hits_per_ray,
                    hits, counts, {}, intersector);
  return hits;
}

std::vector<Hit> PlatformTree::brute_force_hits(std::span<const Ray> rays, Walk walk,
                                                Intersector intersector) const {
  std::vector<Hit> hits(rays.size());
  closest_hit_brute_force(executor(walk), there_->tree.view(), there_->triangles, rays, hits,
                          intersector);
  return hits;
}

Tree build(const TriangleView& triangles, const BuildOptions& options) {
  return zkd::build(executor(Walk::automatic), triangles, options);
}

std::vector<WayToBuild> ways_to_build() {
  std::vector<WayToBuild> all = {{"no executor", [](const auto& triangles, const auto& options) {
                                    return zkd::build(triangles, options);
                                  }}};
  for (int threads = 1; threads <= 4; ++threads) {
    for (const Walk walk : {Walk::automatic, Walk::portable, Walk::avx2}) {
      all.push_back({std::to_string(threads) + " threads, " + name(walk),
                     [threads, walk](const auto& triangles, const auto& options) {
                       CountingResource memory;
                       cpu::Executor with = executor(walk);
                       with.threads = threads;
                       with.memory = &memory;
                       try {
                         const Tree tree = zkd::build(with, triangles, options);
                         return tree.clone();
                       } catch (...) {
                         EXPECT_EQ(memory.live_bytes(), 0u);
                         throw;
                       }
                     }});
    }
  }
  return all;
}

}  // namespace zkd::test
