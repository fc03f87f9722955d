// SPDX-License-Identifier: Apache-2.0
//
// Queries on a CUDA device: one thread a ray. See zkd/cuda/query.hpp.
#include <zkd/cuda/query.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <zkd/cuda/device.hpp>
#include <zkd/error.hpp>

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
template <class Intersect>
__global__ void __launch_bounds__(block_size)
    closest_hit_kernel(TreeView tree, TriangleView triangles, const Ray* rays, Hit* hits,
                       TraversalCost* costs, std::uint32_t count) {
  const std::uint32_t i = thread_number();
  if (i >= count) return;
  TraversalCost cost;
  hits[i] = core::to_hit(
      core::trace<false, core::FusedBoxTest, Intersect>(tree, triangles, rays[i], &cost));
  if (costs != nullptr) costs[i] = cost;
}

template <class Intersect>
__global__ void __launch_bounds__(block_size)
    any_hit_kernel(TreeView tree, TriangleView triangles, const Ray* rays, std::uint8_t* occluded,
                   TraversalCost* costs, std::uint32_t count) {
  const std::uint32_t i = thread_number();
  if (i >= count) return;
  TraversalCost cost;
  const auto found =
      core::trace<true, core::FusedBoxTest, Intersect>(tree, triangles, rays[i], &cost);
  occluded[i] = found.found() ? 1 : 0;
  if (costs != nullptr) costs[i] = cost;
}

// `counts` and `costs` may be null.
template <class Intersect>
__global__ void __launch_bounds__(block_size)
    closest_hits_kernel(TreeView tree, TriangleView triangles, const Ray* rays,
                        std::uint32_t hits_per_ray, Hit* hits, std::uint32_t* counts,
                        TraversalCost* costs, std::uint32_t count) {
  const std::uint32_t i = thread_number();
  if (i >= count) return;
  TraversalCost cost;
  const std::uint32_t found =
      core::closest_hits<core::device_hits_kept, core::device_boxes_in_order, core::FusedBoxTest,
                         Intersect>(tree, triangles, rays[i], hits + std::size_t{i} * hits_per_ray,
                                    hits_per_ray, &cost);
  if (counts != nullptr) counts[i] = found;
  if (costs != nullptr) costs[i] = cost;
}

// All threads of a warp look at the same triangle at once.
template <class Intersect>
__global__ void __launch_bounds__(block_size)
    brute_force_kernel(TreeView tree, TriangleView triangles, const Ray* rays, Hit* hits,
                       std::uint32_t count) {
  const std::uint32_t i = thread_number();
  if (i < count)
    hits[i] = core::to_hit(core::trace_brute_force<Intersect>(tree, triangles, rays[i]));
}

// kernel(arguments..., count) on the stream, a thread for each of `count` rays.
template <class Kernel, class... Arguments>
void trace(const char* what, cuda::Stream stream, std::uint32_t count, Kernel kernel,
           Arguments... arguments) {
  cuda::launch(what, stream, (count + block_size - 1) / block_size, block_size, kernel,
               arguments..., count);
}

// work<type of the intersector>(first, count) for all of `total` rays, in as many launches as it
// takes.
template <class Work>
void for_each_part(Intersector intersector, std::size_t total, Work work) {
  if (intersector == Intersector::exact)
    throw Error(ErrorCode::unsupported_option, 0,
                "Intersector::exact is not available on CUDA devices: use it on the host, with a "
                "tree brought there by to_host");
  core::with_intersector(intersector, [=]<class Intersect>() {
    for (std::size_t first = 0; first < total; first += most_rays)
      work.template operator()<Intersect>(
          first, static_cast<std::uint32_t>(std::min(most_rays, total - first)));
  });
}

std::size_t ray_count(std::span<const Ray> rays, std::size_t answers,
                      std::span<const TraversalCost> costs) {
  const std::size_t count = std::min(rays.size(), answers);
  return costs.empty() ? count : std::min(count, costs.size());
}

// What belongs to ray `first` and those behind it; null if nothing was given.
template <class Value>
Value* from(std::span<Value> values, std::size_t first) {
  return values.empty() ? nullptr : values.data() + first;
}

}  // namespace

void closest_hit(const cuda::Executor& executor, const TreeView& tree,
                 const TriangleView& triangles, std::span<const Ray> rays, std::span<Hit> hits,
                 std::span<TraversalCost> costs, Intersector intersector) {
  for_each_part(intersector, ray_count(rays, hits.size(), costs),
                [=, &executor]<class Intersect>(std::size_t first, std::uint32_t count) {
                  trace("closest_hit", executor.stream, count, closest_hit_kernel<Intersect>, tree,
                        triangles, rays.data() + first, hits.data() + first, from(costs, first));
                });
}

void any_hit(const cuda::Executor& executor, const TreeView& tree, const TriangleView& triangles,
             std::span<const Ray> rays, std::span<std::uint8_t> occluded,
             std::span<TraversalCost> costs, Intersector intersector) {
  for_each_part(intersector, ray_count(rays, occluded.size(), costs),
                [=, &executor]<class Intersect>(std::size_t first, std::uint32_t count) {
                  trace("any_hit", executor.stream, count, any_hit_kernel<Intersect>, tree,
                        triangles, rays.data() + first, occluded.data() + first,
                        from(costs, first));
                });
}

void closest_hits(const cuda::Executor& executor, const TreeView& tree,
                  const TriangleView& triangles, std::span<const Ray> rays,
                  std::uint32_t hits_per_ray, std::span<Hit> hits, std::span<std::uint32_t> counts,
                  std::span<TraversalCost> costs, Intersector intersector) {
  const std::size_t room = hits_per_ray == 0 ? rays.size() : hits.size() / hits_per_ray;
  const std::size_t total =
      ray_count(rays, counts.empty() ? room : std::min(room, counts.size()), costs);
  for_each_part(
      intersector, total, [=, &executor]<class Intersect>(std::size_t first, std::uint32_t count) {
        trace("closest_hits", executor.stream, count, closest_hits_kernel<Intersect>, tree,
              triangles, rays.data() + first, hits_per_ray, hits.data() + first * hits_per_ray,
              from(counts, first), from(costs, first));
      });
}

void closest_hit_brute_force(const cuda::Executor& executor, const TreeView& tree,
                             const TriangleView& triangles, std::span<const Ray> rays,
                             std::span<Hit> hits, Intersector intersector) {
  for_each_part(intersector, ray_count(rays, hits.size(), {}),
                [=, &executor]<class Intersect>(std::size_t first, std::uint32_t count) {
                  trace("closest_hit_brute_force", executor.stream, count,
                        brute_force_kernel<Intersect>, tree, triangles, rays.data() + first,
                        hits.data() + first);
                });
}

}  // namespace zkd
