// SPDX-License-Identifier: Apache-2.0
//
// Whole trees in the memory of a simulated device, rays walked as in its kernels. See
// support/platform_tree.hpp.
#include "support/platform_tree.hpp"

#include <utility>

#include <gtest/gtest.h>

#include <zkd/cuda/device.hpp>

#include "core/check_input.hpp"
#include "support/platform_simulated.hpp"
#include "support/simulated_machine.hpp"

namespace zkd::test {
namespace {

// answer(ray, i) for each ray, when the stream gets to it.
template <class Answer>
void trace(std::span<const Ray> rays, const Answer& answer) {
  simulated::Stream::of(executor().stream)
      .enqueue("trace", static_cast<std::uint32_t>(rays.size()), [=](Random&) {
        for (std::size_t i = 0; i < rays.size(); ++i) answer(rays[i], i);
      });
}

BuildOptions with_room(const simulated::Executor& executor, const TriangleView& triangles,
                       const BuildOptions& options) {
  if (options.references != References::all || options.reference_capacity != 0) return options;
  BuildOptions enough = options;
  enough.reference_capacity = analyse(executor, triangles, options).reference_capacity;
  return enough;
}

}  // namespace

Backend backend() { return Backend::cuda; }

std::uint32_t build_thinning() { return 17; }

std::vector<Walk> walks() { return {Walk::automatic}; }

std::vector<Intersector> intersectors() {
  return {Intersector::watertight, Intersector::fast, Intersector::single_precision,
          Intersector::double_precision};
}

struct PlatformTree::There {
  UploadedTriangles<simulated::Array> triangles;
  simulated::Tree tree;
  Tree on_host;
};

PlatformTree::PlatformTree(const TriangleView& triangles, const BuildOptions& options)
    : there_(new There{upload(triangles), {}, {}}) {
  const TriangleView& view = there_->triangles;
  there_->tree = zkd::build(executor(), view, with_room(executor(), view, options));
  there_->on_host = there_->tree.to_host();
}
PlatformTree::PlatformTree(const Tree& tree, const TriangleView& triangles)
    : there_(new There{upload(triangles), {}, tree.clone()}) {
  there_->tree = simulated::to_device(executor(), tree, there_->triangles);
}
PlatformTree::PlatformTree(PlatformTree&& other) noexcept = default;
PlatformTree::~PlatformTree() = default;

const Tree& PlatformTree::host() const { return there_->on_host; }

std::vector<Hit> PlatformTree::closest_hits(std::span<const Ray> rays, Walk,
                                            std::vector<TraversalCost>* costs,
                                            Intersector intersector) const {
  const Array<Ray> uploaded(rays);
  Array<Hit> hits(rays.size());
  Array<TraversalCost> visits(rays.size());
  core::with_intersector(intersector, [&]<class Intersect>() {
    trace(uploaded,
          [tree = there_->tree.view(), triangles = there_->tree.triangles(),
           out = std::span<Hit>(hits).data(),
           cost = std::span<TraversalCost>(visits).data()](const Ray& ray, std::size_t i) {
            out[i] = core::to_hit(
                core::trace<false, core::FusedBoxTest, Intersect>(tree, triangles, ray, &cost[i]));
          });
  });
  if (costs != nullptr) *costs = visits.download();
  return hits.download();
}

std::vector<std::uint8_t> PlatformTree::any_hits(std::span<const Ray> rays, Walk,
                                                 Intersector intersector) const {
  const Array<Ray> uploaded(rays);
  Array<std::uint8_t> occluded(rays.size(), 7);
  core::with_intersector(intersector, [&]<class Intersect>() {
    trace(uploaded,
          [tree = there_->tree.view(), triangles = there_->tree.triangles(),
           out = std::span<std::uint8_t>(occluded).data()](const Ray& ray, std::size_t i) {
            const auto found =
                core::trace<true, core::FusedBoxTest, Intersect>(tree, triangles, ray, nullptr);
            out[i] = found.found() ? 1 : 0;
          });
  });
  return occluded.download();
}

std::vector<Hit> PlatformTree::hits_in_order(std::span<const Ray> rays, std::uint32_t hits_per_ray,
                                             std::vector<std::uint32_t>& counts, Walk,
                                             Intersector intersector) const {
  const Array<Ray> uploaded(rays);
  Array<Hit> hits(rays.size() * hits_per_ray);
  Array<std::uint32_t> found(rays.size(), 7);
  core::with_intersector(intersector, [&]<class Intersect>() {
    trace(uploaded,
          [tree = there_->tree.view(), triangles = there_->tree.triangles(), hits_per_ray,
           out = std::span<Hit>(hits).data(),
           count = std::span<std::uint32_t>(found).data()](const Ray& ray, std::size_t i) {
            count[i] = core::closest_hits<core::device_hits_kept, core::device_boxes_in_order,
                                          core::FusedBoxTest, Intersect>(
                tree, triangles, ray, out + i * hits_per_ray, hits_per_ray, nullptr);
          });
  });
  counts = found.download();
  return hits.download();
}

std::vector<Hit> PlatformTree::brute_force_hits(std::span<const Ray> rays, Walk,
                                                Intersector intersector) const {
  const Array<Ray> uploaded(rays);
  Array<Hit> hits(rays.size());
  core::with_intersector(intersector, [&]<class Intersect>() {
    trace(uploaded, [tree = there_->tree.view(), triangles = there_->tree.triangles(),
                     out = std::span<Hit>(hits).data()](const Ray& ray, std::size_t i) {
      out[i] = core::to_hit(core::trace_brute_force<Intersect>(tree, triangles, ray));
    });
  });
  return hits.download();
}

Tree build(const TriangleView& triangles, const BuildOptions& options) {
  const auto uploaded = upload(triangles);
  return zkd::build(executor(), uploaded, with_room(executor(), uploaded, options)).to_host();
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

// On a machine of its own, from host or device memory.
Tree counted(const TriangleView& triangles, const BuildOptions& options, bool upload_first) {
  static std::uint64_t seed = 0;
  simulated::Machine machine(++seed);
  const auto build_there = [&](const TriangleView& where) {
    return zkd::build(machine.executor(), where, with_room(machine.executor(), where, options))
        .to_host();
  };
  const auto expect_all_given_back = [&] {
    EXPECT_EQ(machine.memory.live_blocks(), 0u);
    EXPECT_FALSE(machine.memory.misused());
  };
  try {
    Tree tree = upload_first && readable(triangles) ? build_there(upload(triangles))
                                                    : build_there(triangles);
    expect_all_given_back();
    return tree;
  } catch (const Error&) {
    expect_all_given_back();
    throw;
  }
}

}  // namespace

std::vector<WayToBuild> ways_to_build() {
  return {
      {"from host memory", [](const auto& triangles,
                              const auto& options) { return counted(triangles, options, false); }},
      {"from device memory", [](const auto& triangles, const auto& options) {
         return counted(triangles, options, true);
       }}};
}

}  // namespace zkd::test
