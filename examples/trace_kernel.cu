// SPDX-License-Identifier: Apache-2.0
//
// A kernel of one's own that traces rays: builds a tree on the device, looks straight down on it
// with one ray a thread, and prints how high the surface is. Compiled by nvcc, linked with
// zkd::cuda.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <vector>

#include <cuda_runtime.h>
#include <thrust/device_vector.h>
#include <thrust/host_vector.h>

#include <zkd/cuda/build.hpp>
#include <zkd/cuda/device.hpp>
#include <zkd/error.hpp>

constexpr std::uint32_t side = 16;

// Height of the surface below each point of a grid over [0, 1] x [0, 1]; -1 where there is none.
__global__ void __launch_bounds__(128)
    look_down(zkd::TreeView tree, zkd::TriangleView triangles, float* heights) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= side * side) return;
  zkd::Ray ray;
  ray.origin.x = (static_cast<float>(i % side) + 0.5F) / side;
  ray.origin.y = (static_cast<float>(i / side) + 0.5F) / side;
  ray.origin.z = 10.0F;
  ray.direction.z = -1.0F;
  const zkd::Hit hit = zkd::device::closest_hit(tree, triangles, ray);
  heights[i] = hit.triangle != zkd::no_triangle ? ray.origin.z - hit.t : -1.0F;
}

int main() try {
  // A pyramid without its base. It is in host memory: the build copies it to the device.
  const std::vector<glm::vec3> vertices = {{0.0F, 0.0F, 0.0F},
                                           {1.0F, 0.0F, 0.0F},
                                           {1.0F, 1.0F, 0.0F},
                                           {0.0F, 1.0F, 0.0F},
                                           {0.5F, 0.5F, 9.0F}};
  const std::vector<glm::uvec3> faces = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  const zkd::cuda::Executor gpu;  // the default stream
  const zkd::cuda::Tree tree = zkd::build(gpu, zkd::TriangleView{vertices, faces});

  thrust::device_vector<float> on_device(side * side);
  look_down<<<side * side / 128, 128, 0, gpu.stream>>>(tree.view(), tree.triangles(),
                                                       on_device.data().get());
  tree.check();  // waits, and throws what went wrong in the build
  const thrust::host_vector<float> heights = on_device;  // waits, and throws what went wrong here
  for (std::uint32_t i = 0; i < side * side; ++i)
    std::printf("%1.0f%s", heights[i], (i + 1) % side == 0 ? "\n" : " ");
} catch (const zkd::Error& error) {
  std::fprintf(stderr, "%s: %s\n", zkd::to_string(error.code()), error.what());
  return 1;
} catch (const std::exception& error) {  // thrust's
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
