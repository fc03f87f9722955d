// SPDX-License-Identifier: Apache-2.0
//
// Rays traced in kernels of a program's own, compiled as nvcc compiles by default, with
// contraction, and not as zkd compiles itself: the bits of zkd/query.hpp on the host.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include <zkd/cuda/build.hpp>
#include <zkd/cuda/device.hpp>
#include <zkd/zkd.hpp>

#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_cuda.hpp"
#include "support/rays.hpp"

namespace zkd {
namespace {

using test::Array;
using test::print;
using test::same_bits;

constexpr unsigned block_size = 128;

struct Path {
  Hit hit;
  float shading;         // of the program's own arithmetic, which may be fused
  std::uint32_t shadow;  // 1: between the hit and the light lies something
};

ZKD_HOST_DEVICE Ray shadow_ray(const Ray& ray, const Hit& hit) {
  Ray shadow;
  // Powers of two, so that no rounding depends on who computes it.
  shadow.origin = ray.origin;
  shadow.direction = ray.direction * 0.5F;
  shadow.t_min = hit.t * 2.0F;
  return shadow;
}

// The walk among other work: two calls, threads that leave early, numbers kept across them.
__global__ void __launch_bounds__(block_size)
    trace_paths(TreeView tree, TriangleView triangles, const Ray* rays, Path* paths,
                TraversalCost* costs, std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  const Ray ray = rays[i];
  Path path;
  path.shading = ray.origin.x * ray.direction.x + ray.origin.y * ray.direction.y;
  path.hit = device::closest_hit(tree, triangles, ray, &costs[i]);
  path.shadow = 0;
  if (path.hit.triangle != no_triangle) {
    path.shading += path.hit.u * path.hit.v + path.hit.t;
    path.shadow = device::any_hit(tree, triangles, shadow_ray(ray, path.hit)) ? 1 : 0;
  }
  paths[i] = path;
}

void expect_bits_of_the_host(const cuda::Tree& tree, const Tree& host,
                             const TriangleView& triangles, const std::vector<Ray>& rays) {
  const auto count = static_cast<std::uint32_t>(rays.size());
  const Array<Ray> uploaded = test::upload(rays);
  Array<Path> paths(count);
  Array<TraversalCost> costs(count);
  trace_paths<<<(count + block_size - 1) / block_size, block_size>>>(
      tree.view(), tree.triangles(), uploaded.data(), std::span<Path>(paths).data(),
      std::span<TraversalCost>(costs).data(), count);
  test::require(cudaGetLastError());
  test::require(cudaDeviceSynchronize());
  const std::vector<Path> got = paths.download();
  const std::vector<TraversalCost> visits = costs.download();
  const std::vector<Hit> want = test::closest(host.view(), triangles, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_TRUE(same_bits(got[i].hit, want[i]))
        << "ray " << i << " " << print(rays[i]) << ": " << print(got[i].hit) << " instead of "
        << print(want[i]);
    if (!test::is_hit(want[i])) continue;
    ASSERT_GT(visits[i].triangle_tests, 0u);
    ASSERT_EQ(got[i].shadow != 0, any_hit(host.view(), triangles, shadow_ray(rays[i], want[i])))
        << "shadow of ray " << i << " " << print(rays[i]);
  }
}

struct Bounce {
  Hit hit;
  glm::vec3 origin;  // of a ray that goes on from the hit
};

template <Intersector intersector>
__global__ void __launch_bounds__(block_size)
    trace_and_leave(TreeView tree, TriangleView triangles, const Ray* rays, Bounce* bounces,
                    std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  bounces[i].hit = device::closest_hit<intersector>(tree, triangles, rays[i]);
  if (bounces[i].hit.triangle != no_triangle)
    bounces[i].origin =
        device::offset_origin<intersector>(triangles, bounces[i].hit, rays[i].direction);
}

template <Intersector intersector>
void expect_same_bounces(const cuda::Tree& tree, const Tree& host, const TriangleView& triangles,
                         const std::vector<Ray>& rays) {
  SCOPED_TRACE(to_string(intersector));
  const auto count = static_cast<std::uint32_t>(rays.size());
  const Array<Ray> uploaded = test::upload(rays);
  Array<Bounce> bounces(count);
  trace_and_leave<intersector><<<(count + block_size - 1) / block_size, block_size>>>(
      tree.view(), tree.triangles(), uploaded.data(), std::span<Bounce>(bounces).data(), count);
  test::require(cudaGetLastError());
  test::require(cudaDeviceSynchronize());
  const std::vector<Bounce> got = bounces.download();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit want = test::or_miss(closest_hit(host.view(), triangles, rays[i], intersector));
    ASSERT_TRUE(same_bits(got[i].hit, want)) << "ray " << i << " " << print(rays[i]) << ": "
                                             << print(got[i].hit) << " instead of " << print(want);
    if (!test::is_hit(want)) continue;
    ASSERT_EQ(got[i].origin, offset_origin(triangles, want, rays[i].direction, intersector))
        << "from ray " << i << " " << print(rays[i]);
  }
}

// The last hits of each ray, in order, by a ring of them.
constexpr std::uint32_t ring_size = 6;

struct Ring {
  Hit hits[ring_size];
  std::uint32_t count;
};

template <Intersector intersector>
__global__ void __launch_bounds__(block_size)
    list_hits(TreeView tree, TriangleView triangles, const Ray* rays, Ring* rings,
              std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= count) return;
  rings[i].count = 0;
  device::for_each_hit<intersector>(tree, triangles, rays[i], [&](const Hit& hit) {
    rings[i].hits[rings[i].count++ % ring_size] = hit;
    return true;
  });
}

template <Intersector intersector>
void expect_same_lists(const cuda::Tree& tree, const Tree& host, const TriangleView& triangles,
                       const std::vector<Ray>& rays) {
  SCOPED_TRACE(to_string(intersector));
  const auto count = static_cast<std::uint32_t>(rays.size());
  const Array<Ray> uploaded = test::upload(rays);
  Array<Ring> rings(count);
  list_hits<intersector><<<(count + block_size - 1) / block_size, block_size>>>(
      tree.view(), tree.triangles(), uploaded.data(), std::span<Ring>(rings).data(), count);
  test::require(cudaGetLastError());
  test::require(cudaDeviceSynchronize());
  const std::vector<Ring> got = rings.download();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    Ring want = {};
    for_each_hit(
        host.view(), triangles, rays[i],
        [&](const Hit& hit) { want.hits[want.count++ % ring_size] = hit; }, intersector);
    ASSERT_EQ(got[i].count, want.count) << "ray " << i << " " << print(rays[i]);
    for (std::uint32_t k = 0; k < ring_size && k < want.count; ++k) {
      ASSERT_TRUE(same_bits(got[i].hits[k], want.hits[k]))
          << "ray " << i << " " << print(rays[i]) << ": " << print(got[i].hits[k]) << " instead of "
          << print(want.hits[k]);
    }
  }
}

class CudaUserKernel : public testing::TestWithParam<test::MeshKind> {};

TEST_P(CudaUserKernel, GivesTheBitsOfTheHost) {
  for (std::uint64_t seed = 300; seed < 304; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    for (const References references : {References::once, References::all}) {
      SCOPED_TRACE(m.name + ", seed " + std::to_string(seed) + ", " + to_string(references));
      BuildOptions options;
      options.references = references;
      options.leaf_size = seed % 2 == 0 ? 1 : 4;
      options.invalid_triangles = InvalidTriangles::skip;
      const test::UploadedTriangles<Array> uploaded(m.mesh.view());
      const cuda::Tree tree = build(test::executor(), uploaded, test::with_room(uploaded, options));
      const Tree host = tree.to_host();
      const std::vector<Ray> rays = test::RayMaker(m.mesh, host.view(), seed).all_kinds(1200);
      expect_bits_of_the_host(tree, host, m.mesh.view(), rays);
      if (HasFatalFailure()) return;
      expect_same_bounces<Intersector::watertight>(tree, host, m.mesh.view(), rays);
      expect_same_bounces<Intersector::fast>(tree, host, m.mesh.view(), rays);
      expect_same_bounces<Intersector::single_precision>(tree, host, m.mesh.view(), rays);
      expect_same_bounces<Intersector::double_precision>(tree, host, m.mesh.view(), rays);
      expect_same_lists<Intersector::watertight>(tree, host, m.mesh.view(), rays);
      expect_same_lists<Intersector::single_precision>(tree, host, m.mesh.view(), rays);
      if (HasFatalFailure()) return;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, CudaUserKernel, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

TEST(CudaUserKernel, MissesInAnEmptyTree) {
  const cuda::Tree tree;
  expect_bits_of_the_host(tree, Tree(), TriangleView{}, scene::random_rays(Box{}, 100, 305));
}

// Behind a build on its stream nobody has to wait before the kernel is launched.
TEST(CudaUserKernel, FollowsABuildAtOnce) {
  const scene::Mesh mesh = scene::sphere(4);
  const Tree host = build(cpu::Executor{}, mesh.view());
  const cuda::Tree tree = build(cuda::Executor{}, mesh.view());
  expect_bits_of_the_host(tree, host, mesh.view(), scene::rays_at_features(mesh, 2000, 306));
}

}  // namespace
}  // namespace zkd
