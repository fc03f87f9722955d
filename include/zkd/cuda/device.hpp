// SPDX-License-Identifier: Apache-2.0
//
// Rays traced from inside a kernel: functions for device code, one ray a thread.
//
//     __global__ void depths(zkd::TreeView tree, zkd::TriangleView triangles, const zkd::Ray* rays,
//                            float* depths, std::uint32_t count) {
//       const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
//       if (i < count) depths[i] = zkd::device::closest_hit(tree, triangles, rays[i]).t;
//     }
//
// Pass cuda::Tree::view() and cuda::Tree::triangles(), by value. The kernel goes on the stream that
// the tree was built on, or behind it; where the build failed the tree is empty and every ray
// misses. Neither tree nor triangles may be written while the kernel runs: nodes are read through
// the read-only cache. Nothing here synchronises, allocates or uses shared memory, and threads of a
// warp may call in any company: there is no barrier and no vote.
//
// The same bits as from zkd/query.hpp and zkd/cuda/query.hpp, whatever else is in the kernel: every
// operation is rounded as written, under nvcc's default --fmad=true too. The exception is
// --use_fast_math (or --ftz=true), which puts 0 for numbers below 2^-126 even in operations that
// are spelled out: answers then are those of another arithmetic wherever such numbers come up.
// Compile such kernels without it, and call the fast functions (__sinf, ...) by name where wanted.
//
// What it costs a kernel: a thread keeps its stack of nodes in local memory, 8 * max_depth = 768
// bytes for each call in the source, few of them touched; and about 100 registers, since a prepared
// ray is held in single and in double precision. Give the kernel __launch_bounds__ with the block
// size in use (128 is a good first guess): nvcc then knows how many registers a thread may have.
// The code is inlined, so each call in the source is a copy of the whole walk: better one call in a
// loop than several.
//
// For nvcc (12 or later, C++20, sm_75 or newer). Other compilers find no function here, so that a
// header of a program may include this one on both sides.
#pragma once

#include <cstdint>

#include <zkd/config.hpp>
#include <zkd/geometry.hpp>
#include <zkd/query.hpp>
#include <zkd/traversal/all_hits.hpp>
#include <zkd/traversal/intersectors.hpp>
#include <zkd/traversal/offset.hpp>
#include <zkd/traversal/traverse.hpp>
#include <zkd/tree.hpp>

namespace zkd::core {

/// Hits kept and boxes in order, of a ray whose hits are all wanted: see all_hits.hpp. Few, so that
/// a thread's local memory stays small.
inline constexpr std::uint32_t device_hits_kept = 8;
inline constexpr std::uint32_t device_boxes_in_order = 16;

/// BoxTest as a GPU likes it: fused, without a variable index, nodes read 16 bytes at a time.
/// Rounds once less than core::BoxTest: boxes only say what may be left out, within padding.
class FusedBoxTest {
 public:
  ZKD_HOST_DEVICE explicit FusedBoxTest(const PreparedRay& ray) : ray_(ray) {}

  [[nodiscard]] static ZKD_HOST_DEVICE Node read(const Node& node) {
#if defined(__CUDA_ARCH__)
    const auto* words = reinterpret_cast<const uint4*>(&node);
    Node copy;
    for (int a = 0; a < 3; ++a) {
      const uint4 bounds = __ldg(words + a);
      copy.bounds[a][0] = __uint_as_float(bounds.x);
      copy.bounds[a][1] = __uint_as_float(bounds.y);
      copy.bounds[a][2] = __uint_as_float(bounds.z);
      copy.bounds[a][3] = __uint_as_float(bounds.w);
    }
    const uint4 rest = __ldg(words + 3);
    copy.child[0].bits = rest.x;
    copy.child[1].bits = rest.y;
    copy.plane = __uint_as_float(rest.z);
    copy.axis = rest.w;
    return copy;
#else
    return node;
#endif
  }

  ZKD_HOST_DEVICE Entries operator()(const Node& node, Real last) const {
    constexpr float largest = 3.4028234663852886e38F;
    float near[2] = {ray_.first.value, ray_.first.value};
    float far[2] = {largest, largest};
    for (std::uint32_t a = 0; a < 3; ++a) {
      const bool negative = ray_.is_negative(a);
      for (int child = 0; child < 2; ++child) {
        const Real low = node.bounds[a][child];
        const Real high = node.bounds[a][2 + child];
        const Real to_near = (negative ? high : low) - ray_.origin[a];
        const Real to_far = (negative ? low : high) - ray_.origin[a];
        near[child] = greatest(near[child], fma(to_near, ray_.inverse[a], -ray_.padding[a]).value);
        far[child] = least(far[child], fma(to_far, ray_.inverse[a], ray_.padding[a]).value);
      }
    }
    for (float& leaving : far) leaving = least((Real(leaving) * ray_.far_slack).value, last.value);
    return {{near[0], near[1]}, (near[0] <= far[0] ? 1u : 0u) | (near[1] <= far[1] ? 2u : 0u)};
  }

 private:
  // Single instructions on the device, which they are not as a comparison and a choice.
  static ZKD_HOST_DEVICE float least(float a, float b) { return __builtin_fminf(a, b); }
  static ZKD_HOST_DEVICE float greatest(float a, float b) { return __builtin_fmaxf(a, b); }

  const PreparedRay& ray_;
};

}  // namespace zkd::core

#if defined(__CUDACC__)
namespace zkd::device {

/// The nearest hit along `ray`; a miss has triangle == no_triangle, t == infinity, u == v == 0. The
/// rules are those of zkd/query.hpp. `cost`, unless null, is overwritten. Any intersector but
/// `exact`: closest_hit<Intersector::fast>(...).
template <Intersector intersector = Intersector::watertight>
[[nodiscard]] __device__ inline Hit closest_hit(const TreeView& tree, const TriangleView& triangles,
                                                const Ray& ray, TraversalCost* cost = nullptr) {
  using Intersect = typename core::Named<intersector>::type;
  return core::to_hit(
      core::trace<false, core::FusedBoxTest, Intersect>(tree, triangles, ray, cost));
}

/// Whether anything is hit; true exactly when closest_hit finds something. Stops at the first hit.
template <Intersector intersector = Intersector::watertight>
[[nodiscard]] __device__ inline bool any_hit(const TreeView& tree, const TriangleView& triangles,
                                             const Ray& ray, TraversalCost* cost = nullptr) {
  using Intersect = typename core::Named<intersector>::type;
  return core::trace<true, core::FusedBoxTest, Intersect>(tree, triangles, ray, cost).found();
}

/// visitor(hit) for every hit of the ray, from near to far, each once. The rules, and the order,
/// are those of zkd/hits.hpp. The visitor returns whether to go on, as a bool. `cost`, unless null,
/// is overwritten. Takes 1.2 KB of local memory, 256 bytes of which are for hits that were found
/// and may still have a nearer one before them; where there are more than 8 of those at once,
/// another walk finds the furthest again.
template <Intersector intersector = Intersector::watertight, class Visitor>
__device__ inline void for_each_hit(const TreeView& tree, const TriangleView& triangles,
                                    const Ray& ray, Visitor&& visitor,
                                    TraversalCost* cost = nullptr) {
  using Intersect = typename core::Named<intersector>::type;
  auto visit = [&](const core::Candidate& found) -> bool { return visitor(core::to_hit(found)); };
  const core::AllHitsCost spent =
      core::for_each_hit<core::device_hits_kept, core::device_boxes_in_order, core::FusedBoxTest,
                         Intersect>(tree, triangles, ray, visit);
  if (cost != nullptr) *cost = spent.as_traversal_cost();
}

/// Where a ray begins that leaves the surface at `hit`: see zkd/query.hpp.
template <Intersector intersector = Intersector::watertight>
[[nodiscard]] __device__ inline glm::vec3 offset_origin(const TriangleView& triangles,
                                                        const Hit& hit,
                                                        const glm::vec3& direction) {
  using Intersect = typename core::Named<intersector>::type;
  return core::offset_origin(core::corners_of(triangles, hit.triangle), hit.u, hit.v, direction,
                             Intersect::plane_margin);
}

}  // namespace zkd::device
#endif
