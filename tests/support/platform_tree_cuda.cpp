// SPDX-License-Identifier: Apache-2.0
//
// Whole trees in the memory of a CUDA device. See support/platform_tree.hpp.
#include "support/platform_tree.hpp"

#include <utility>

#include <gtest/gtest.h>

#include <zkd/cuda/build.hpp>
#include <zkd/cuda/query.hpp>

#include "core/check_input.hpp"
#include "support/platform_cuda.hpp"

namespace zkd::test {

Backend backend() { return Backend::cuda; }

std::uint32_t build_thinning() { return 1; }

std::vector<Walk> walks() { return {Walk::automatic}; }

std::vector<Intersector> intersectors() {
  return {Intersector::watertight, Intersector::fast, Intersector::single_precision,
          Intersector::double_precision};
}

struct PlatformTree::There {
  UploadedTriangles<Array> triangles;
  cuda::Tree tree;
  Tree on_host;
};

PlatformTree::PlatformTree(const TriangleView& triangles, const BuildOptions& options)
    : there_(new There{upload(triangles), {}, {}}) {
  there_->tree = zkd::build(executor(), there_->triangles, with_room(there_->triangles, options));
  there_->on_host = there_->tree.to_host();
}
PlatformTree::PlatformTree(const Tree& tree, const TriangleView& triangles)
    : there_(new There{upload(triangles), {}, tree.clone()}) {
  there_->tree = cuda::to_device(executor(), tree, there_->triangles);
}
PlatformTree::PlatformTree(PlatformTree&& other) noexcept = default;
PlatformTree::~PlatformTree() = default;

const Tree& PlatformTree::host() const { return there_->on_host; }

std::vector<Hit> PlatformTree::closest_hits(std::span<const Ray> rays, Walk,
                                            std::vector<TraversalCost>* costs,
                                            Intersector intersector) const {
  const Array<Ray> uploaded(rays);
  Array<Hit> hits(rays.size());
  Array<TraversalCost> visits(costs != nullptr ? rays.size() : 0);
  closest_hit(executor(), there_->tree.view(), there_->tree.triangles(), uploaded, hits, visits,
              intersector);
  if (costs != nullptr) *costs = visits.download();
  return hits.download();
}

std::vector<std::uint8_t> PlatformTree::any_hits(std::span<const Ray> rays, Walk,
                                                 Intersector intersector) const {
  const Array<Ray> uploaded(rays);
  Array<std::uint8_t> occluded(rays.size(), 7);
  any_hit(executor(), there_->tree.view(), there_->tree.triangles(), uploaded, occluded, {},
          intersector);
  return occluded.download();
}

std::vector<Hit> PlatformTree::hits_in_order(std::span<const Ray> rays, std::uint32_t hits_per_ray,
                                             std::vector<std::uint32_t>& counts, Walk,
                                             Intersector intersector) const {
  const Array<Ray> uploaded(rays);
  Array<Hit> hits(rays.size() * hits_per_ray);
  Array<std::uint32_t> found(rays.size(), 7);
  zkd::closest_hits(executor(), there_->tree.view(), there_->tree.triangles(), uploaded,
                    hits_per_ray, hits, found, {}, intersector);
  counts = found.download();
  return hits.download();
}

std::vector<Hit> PlatformTree::brute_force_hits(std::span<const Ray> rays, Walk,
                                                Intersector intersector) const {
  const Array<Ray> uploaded(rays);
  Array<Hit> hits(rays.size());
  closest_hit_brute_force(executor(), there_->tree.view(), there_->tree.triangles(), uploaded, hits,
                          intersector);
  return hits.download();
}

Tree build(const TriangleView& triangles, const BuildOptions& options) {
  const auto uploaded = upload(triangles);
  return zkd::build(executor(), uploaded, with_room(uploaded, options)).to_host();
}

namespace {

// Whether the arrays can be read, so that they can be copied.
bool readable(const TriangleView& triangles) {
  try {
    core::check_view(triangles);
    return true;
  } catch (const Error&) {
    return false;
  }
}

// build(executor, triangles, options), with memory that counts.
template <class Build>
Tree counted(const TriangleView& triangles, const BuildOptions& options, const Build& build) {
  CountingMemory memory;
  cuda::Executor executor;
  executor.memory = &memory;
  const auto expect_all_given_back = [&] {
    EXPECT_EQ(memory.live_blocks(), 0u);
    EXPECT_FALSE(memory.misused());
  };
  try {
    Tree tree = build(executor, triangles, with_room(triangles, options));
    expect_all_given_back();
    return tree;
  } catch (const Error&) {
    expect_all_given_back();
    throw;
  }
}

}  // namespace

std::vector<WayToBuild> ways_to_build() {
  const auto in_one_go = [](const cuda::Executor& executor, const TriangleView& triangles,
                            const BuildOptions& options) {
    return zkd::build(executor, triangles, options).to_host();
  };
  const auto twice = [=](cuda::Executor executor, const TriangleView& triangles,
                         const BuildOptions& options) {
    // Others make room as they go.
    if (options.builder != Builder::morton) return in_one_go(executor, triangles, options);
    Array<std::byte> workspace(
        memory_requirement(executor, triangles.triangle_count, options).workspace_bytes);
    const std::span<std::byte> bytes = workspace;
    executor.workspace = bytes.data();
    executor.workspace_bytes = bytes.size();
    cuda::Tree tree = zkd::build(executor, triangles, options);
    rebuild(executor, tree, triangles);
    return tree.to_host();
  };
  return {{"no executor", [](const auto& triangles,
                             const auto& options) { return zkd::build(triangles, options); }},
          {"from host memory",
           [=](const auto& triangles, const auto& options) {
             return counted(triangles, options, in_one_go);
           }},
          {"from device memory",
           [=](const auto& triangles, const auto& options) {
             if (!readable(triangles)) return counted(triangles, options, in_one_go);
             return counted(upload(triangles), options, in_one_go);
           }},
          {"twice in one workspace", [=](const auto& triangles, const auto& options) {
             if (!readable(triangles)) return counted(triangles, options, twice);
             return counted(upload(triangles), options, twice);
           }}};
}

}  // namespace zkd::test
