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
