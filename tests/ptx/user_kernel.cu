// SPDX-License-Identifier: Apache-2.0
//
// A program's own kernels, with the traversal compiled into them. For PTX only; never run.
#include <zkd/cuda/device.hpp>

#include <cstdint>

extern "C" __global__ void closest_hits(zkd::TreeView tree, zkd::TriangleView triangles,
                                        const zkd::Ray* rays, zkd::Hit* hits,
                                        zkd::TraversalCost* costs) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  hits[i] = zkd::device::closest_hit(tree, triangles, rays[i], &costs[i]);
}

// The second ray begins where the first one ended.
extern "C" __global__ void two_bounces(zkd::TreeView tree, zkd::TriangleView triangles,
                                       const zkd::Ray* rays, const zkd::Ray* next,
                                       std::uint8_t* occluded) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  const zkd::Hit hit = zkd::device::closest_hit(tree, triangles, rays[i]);
  if (hit.triangle == zkd::no_triangle) return;
  zkd::Ray shadow = next[hit.triangle];
  shadow.t_max = hit.t;
  occluded[i] = zkd::device::any_hit(tree, triangles, shadow) ? 1 : 0;
}

extern "C" __global__ void count_hits(zkd::TreeView tree, zkd::TriangleView triangles,
                                      const zkd::Ray* rays, std::uint32_t* counts, float* last) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  zkd::device::for_each_hit(tree, triangles, rays[i], [&](const zkd::Hit& hit) {
    last[i] = hit.t;
    return ++counts[i] < 100;
  });
}

template <zkd::Intersector intersector>
__global__ void trace_with(zkd::TreeView tree, zkd::TriangleView triangles, zkd::Ray* rays,
                           zkd::Hit* hits) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  hits[i] = zkd::device::closest_hit<intersector>(tree, triangles, rays[i]);
  rays[i].origin = zkd::device::offset_origin<intersector>(triangles, hits[i], rays[i].direction);
}

template __global__ void trace_with<zkd::Intersector::fast>(zkd::TreeView, zkd::TriangleView,
                                                            zkd::Ray*, zkd::Hit*);
template __global__ void trace_with<zkd::Intersector::single_precision>(zkd::TreeView,
                                                                        zkd::TriangleView,
                                                                        zkd::Ray*, zkd::Hit*);
template __global__ void trace_with<zkd::Intersector::double_precision>(zkd::TreeView,
                                                                        zkd::TriangleView,
                                                                        zkd::Ray*, zkd::Hit*);
