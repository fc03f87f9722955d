// SPDX-License-Identifier: Apache-2.0
//
// The workload: primary rays, one diffuse bounce and one shadow ray from each place they hit.
//
// Every ray is a function of its number and the seed alone, computed with integer random numbers,
// + - * / and square roots in double: the same rays on every machine and any number of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/ext/vector_float3.hpp>
#include <span>
#include <vector>

#include <zkd/geometry.hpp>

#include "results.hpp"
#include "scene/camera.hpp"

namespace zkd::bench {

/// Primary rays in the order they are traced: tiles of 8 x 8 pixels, Morton order inside, so that
/// eight in a row are a 4 x 2 block (which 8-packets want and single rays do not mind).
struct PrimaryRays {
  std::vector<Ray> rays;
  std::vector<std::uint32_t> pixels;  ///< for each ray, row * size + column, row 0 on top
};
[[nodiscard]] PrimaryRays tiled_primary_rays(const scene::Camera& camera, unsigned size);

/// A place that a ray hit, pushed off the surface.
struct SurfacePoint {
  glm::vec3 origin;
  glm::vec3 normal;  ///< unit length, away from the surface
};

/// Which side of the surface a point is pushed to.
enum class Side {
  front,  ///< where the ray came from
  back,   ///< where it would have gone
};

/// One for each hit in `hits`, in order. `box` is the scene's: points are pushed 2^-18 of its
/// largest coordinate off the surface.
[[nodiscard]] std::vector<SurfacePoint> surface_points(const TriangleView& triangles,
                                                       const Box& box, std::span<const Ray> rays,
                                                       std::span<const Hit> hits,
                                                       Side side = Side::front);

/// `count` rays in cosine-weighted directions: ray i leaves point i modulo points.size(). Empty if
/// there is no point.
[[nodiscard]] std::vector<Ray> diffuse_rays(std::span<const SurfacePoint> points, std::size_t count,
                                            std::uint64_t seed);

/// A cube that shines, half-way between the eye and the middle of the scene's top (as the camera's
/// up has it): inside a room it is in the room, outside it is above and in front.
struct Light {
  glm::vec3 centre;
  float half_side;
};
[[nodiscard]] Light place_light(const scene::Camera& camera, const Box& box);

/// `count` rays that end in the light (t_max = 1): ray i leaves point i modulo points.size().
[[nodiscard]] std::vector<Ray> shadow_rays(std::span<const SurfacePoint> points, const Light& light,
                                           std::size_t count, std::uint64_t seed);

}  // namespace zkd::bench
