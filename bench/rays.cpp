// SPDX-License-Identifier: Apache-2.0
//
// The workload, ray by ray.
#include "rays.hpp"

#include <algorithm>
#include <cmath>
#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>

#include "scene/random.hpp"

namespace zkd::bench {
namespace {

glm::dvec3 corner(const TriangleView& triangles, std::uint32_t triangle, int which) {
  const float* p = triangles.position(triangles.index(triangle, which));
  return {p[0], p[1], p[2]};
}

glm::dvec3 normalized_or(glm::dvec3 vector, glm::dvec3 otherwise) {
  const double length = std::sqrt(glm::dot(vector, vector));
  return length > 0.0 && std::isfinite(length) ? vector / length : otherwise;
}

// A generator of its own for every ray: neighbours start from numbers that share no pattern.
scene::Random random_of(std::uint64_t seed, RayKind kind, std::size_t ray) {
  scene::Random mix(seed ^ (static_cast<std::uint64_t>(kind) << 56));
  scene::Random own(mix.bits64() + ray * 0xD1342543DE82EF95u);
  return scene::Random(own.bits64());
}

// Even bits of a 6-bit number: the column of an 8 x 8 tile in Morton order.
unsigned even_bits(unsigned code) { return (code & 1u) | ((code >> 1) & 2u) | ((code >> 2) & 4u); }

// A uniform point of the unit disc, by rejection: no sine, no cosine.
void sample_disc(scene::Random& random, double& x, double& y) {
  do {
    x = 2.0 * static_cast<double>(random.unit()) - 1.0;
    y = 2.0 * static_cast<double>(random.unit()) - 1.0;
  } while (x * x + y * y >= 1.0);
}

}  // namespace

const char* to_string(RayKind kind) noexcept {
  switch (kind) {
    case RayKind::primary:
      return "primary";
    case RayKind::diffuse:
      return "diffuse";
    case RayKind::shadow:
      return "shadow";
  }
  return "primary";
}

PrimaryRays tiled_primary_rays(const scene::Camera& camera, unsigned size) {
  const std::vector<Ray> by_rows = scene::primary_rays(camera, size);
  PrimaryRays tiled;
  tiled.rays.reserve(by_rows.size());
  tiled.pixels.reserve(by_rows.size());
  for (unsigned top = 0; top < size; top += 8) {
    for (unsigned left = 0; left < size; left += 8) {
      for (unsigned code = 0; code < 64; ++code) {
        const unsigned column = left + even_bits(code);
        const unsigned row = top + even_bits(code >> 1);
        if (column >= size || row >= size) continue;
        const std::uint32_t pixel = row * size + column;
        tiled.rays.push_back(by_rows[pixel]);
        tiled.pixels.push_back(pixel);
      }
    }
  }
  return tiled;
}

std::vector<SurfacePoint> surface_points(const TriangleView& triangles, const Box& box,
                                         std::span<const Ray> rays, std::span<const Hit> hits,
                                         Side side) {
  double largest = 0.0;
  for (int axis = 0; axis < 3 && !box.empty(); ++axis) {
    largest = std::max({largest, std::abs(static_cast<double>(box.lo[axis])),
                        std::abs(static_cast<double>(box.hi[axis]))});
  }
  const double push = 0x1p-18 * largest;

  std::vector<SurfacePoint> points;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit& hit = hits[i];
    if (hit.triangle == no_triangle) continue;
    const glm::dvec3 a = corner(triangles, hit.triangle, 0);
    const glm::dvec3 b = corner(triangles, hit.triangle, 1);
    const glm::dvec3 c = corner(triangles, hit.triangle, 2);
    const double u = static_cast<double>(hit.u);
    const double v = static_cast<double>(hit.v);
    const glm::dvec3 direction(rays[i].direction);
    const glm::dvec3 back = normalized_or(-direction, glm::dvec3(0.0, 0.0, 1.0));
    glm::dvec3 normal = normalized_or(glm::cross(b - a, c - a), back);
    if ((glm::dot(normal, back) < 0.0) != (side == Side::back)) normal = -normal;
    const glm::dvec3 place = a + u * (b - a) + v * (c - a);
    points.push_back({glm::vec3(place + push * normal), glm::vec3(normal)});
  }
  return points;
}

std::vector<Ray> diffuse_rays(std::span<const SurfacePoint> points, std::size_t count,
                              std::uint64_t seed) {
  if (points.empty()) return {};
  std::vector<Ray> rays(count);
#pragma omp parallel for
  for (std::size_t i = 0; i < count; ++i) {
    const SurfacePoint& point = points[i % points.size()];
    const glm::dvec3 normal(point.normal);
    // Any frame round the normal will do; start from the axis it is furthest from.
    const glm::dvec3 size = glm::abs(normal);
    const glm::dvec3 helper = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                              : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                                   : glm::dvec3(0, 0, 1);
    const glm::dvec3 tangent = normalized_or(glm::cross(helper, normal), helper);
    const glm::dvec3 bitangent = glm::cross(normal, tangent);
    scene::Random random = random_of(seed, RayKind::diffuse, i);
    double x = 0.0;
    double y = 0.0;
    sample_disc(random, x, y);
    // Malley: a uniform disc, lifted to the hemisphere, is cosine-weighted.
    const double z = std::sqrt(std::max(0.0, 1.0 - x * x - y * y));
    rays[i].origin = point.origin;
    rays[i].direction = glm::vec3(x * tangent + y * bitangent + z * normal);
  }
  return rays;
}

Light place_light(const scene::Camera& camera, const Box& box) {
  if (box.empty()) return {camera.eye, 0.0F};
  const glm::dvec3 lo(box.lo[0], box.lo[1], box.lo[2]);
  const glm::dvec3 hi(box.hi[0], box.hi[1], box.hi[2]);
  const glm::dvec3 up = normalized_or(glm::dvec3(camera.up), glm::dvec3(0, 1, 0));
  const glm::dvec3 top = 0.5 * (lo + hi) + 0.5 * (hi - lo) * up;
  const glm::dvec3 diagonal = hi - lo;
  return {glm::vec3(0.5 * (glm::dvec3(camera.eye) + top)),
          static_cast<float>(0.005 * std::sqrt(glm::dot(diagonal, diagonal)))};
}

std::vector<Ray> shadow_rays(std::span<const SurfacePoint> points, const Light& light,
                             std::size_t count, std::uint64_t seed) {
  if (points.empty()) return {};
  std::vector<Ray> rays(count);
#pragma omp parallel for
  for (std::size_t i = 0; i < count; ++i) {
    scene::Random random = random_of(seed, RayKind::shadow, i);
    const glm::vec3 target = light.centre + light.half_side * random.point(-1.0F, 1.0F);
    rays[i].origin = points[i % points.size()].origin;
    rays[i].direction = target - rays[i].origin;
    rays[i].t_max = 1.0F;
  }
  return rays;
}

}  // namespace zkd::bench
