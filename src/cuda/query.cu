// SPDX-License-Identifier: Apache-2.0
//
// Queries on a CUDA device: one thread a ray. See zkd/cuda/query.hpp.
#include <zkd/cuda/query.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <zkd/cuda/device.hpp>

#include "cuda/launch.cuh"

namespace zkd {
namespace {

// Few warps a block: those that are done make room for others sooner. No limit on registers beyond
// that: what a ray holds should not spill.
constexpr unsigned block_size = 128;

// Rays of a launch at most, so that kernels count in 32 bits.
constexpr std::size_t most_rays = std::size_t{1} << 30;

__device__ std::uint32_t thread_number() { return blockIdx.x * block_size + threadIdx.x; }

// `costs` may be null.
__global__ void __launch_bounds__(block_size)
    closest_hit_kernel(TreeView tree, TriangleView triangles, const Ray* rays, Hit* hits,
                       TraversalCost* costs, std::uint32_t count) {
  const std::uint32_t i = thread_number();
  if (i >= count) return;
  TraversalCost cost;
  hits[i] = device::closest_hit(tree, triangles, rays[i], &cost);
  if (costs != nullptr) costs[i] = cost;
}

__global__ void __launch_bounds__(block_size)
    any_hit_kernel(TreeView tree, TriangleView triangles, const Ray* rays, std::uint8_t* occluded,
                   TraversalCost* costs, std::uint32_t count) {
  const std::uint32_t i = thread_number();
  if (i >= count) return;
  TraversalCost cost;
  occluded[i] = device::any_hit(tree, triangles, rays[i], &cost) ? 1 : 0;
  if (costs != nullptr) costs[i] = cost;
}

// All threads of a warp look at the same triangle at once.
__global__ void __launch_bounds__(block_size)
    brute_force_kernel(TreeView tree, TriangleView triangles, const Ray* rays, Hit* hits,
                       std::uint32_t count) {
  const std::uint32_t i = thread_number();
  if (i < count) hits[i] = core::to_hit(core::trace_brute_force(tree, triangles, rays[i]));
}

// kernel(arguments..., count) on the stream, a thread for each of `count` rays.
template <class Kernel, class... Arguments>
void trace(const char* what, cuda::Stream stream, std::uint32_t count, Kernel kernel,
           Arguments... arguments) {
  cuda::launch(what, stream, (count + block_size - 1) / block_size, block_size, kernel,
               arguments..., count);
}

// work(first, count) for all of `total` rays, in as many launches as it takes.
template <class Work>
void for_each_part(std::size_t total, Work work) {
  for (std::size_t first = 0; first < total; first += most_rays)
    work(first, static_cast<std::uint32_t>(std::min(most_rays, total - first)));
}

std::size_t ray_count(std::span<const Ray> rays, std::size_t answers,
                      std::span<const TraversalCost> costs) {
  const std::size_t count = std::min(rays.size(), answers);
  return costs.empty() ? count : std::min(count, costs.size());
}

TraversalCost* from(std::span<TraversalCost> costs, std::size_t first) {
  return costs.empty() ? nullptr : costs.data() + first;
}

}  // namespace

void closest_hit(const cuda::Executor& executor, const TreeView& tree,
                 const TriangleView& triangles, std::span<const Ray> rays, std::span<Hit> hits,
                 std::span<TraversalCost> costs) {
  for_each_part(ray_count(rays, hits.size(), costs), [&](std::size_t first, std::uint32_t count) {
    trace("closest_hit", executor.stream, count, closest_hit_kernel, tree, triangles,
          rays.data() + first, hits.data() + first, from(costs, first));
  });
}

void any_hit(const cuda::Executor& executor, const TreeView& tree, const TriangleView& triangles,
             std::span<const Ray> rays, std::span<std::uint8_t> occluded,
             std::span<TraversalCost> costs) {
  for_each_part(ray_count(rays, occluded.size(), costs),
                [&](std::size_t first, std::uint32_t count) {
                  trace("any_hit", executor.stream, count, any_hit_kernel, tree, triangles,
                        rays.data() + first, occluded.data() + first, from(costs, first));
                });
}

void closest_hit_brute_force(const cuda::Executor& executor, const TreeView& tree,
                             const TriangleView& triangles, std::span<const Ray> rays,
                             std::span<Hit> hits) {
  for_each_part(ray_count(rays, hits.size(), {}), [&](std::size_t first, std::uint32_t count) {
    trace("closest_hit_brute_force", executor.stream, count, brute_force_kernel, tree, triangles,
          rays.data() + first, hits.data() + first);
  });
}

}  // namespace zkd
