// SPDX-License-Identifier: Apache-2.0
//
// Pictures from primary rays: shaded, depth, node visits.
#include "images.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

#include <zkd/query.hpp>

#include "rays.hpp"
#include "scene/image.hpp"

namespace zkd::bench {
namespace {

using Pixels = std::vector<glm::vec3>;

// The value below which `share` of all values lie; 0 for none.
double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

// One sample a ray: clay under one light with a hard shadow, some sky, and a paler backdrop.
Pixels shade(const TriangleView& triangles, const Tree& tree, const scene::Camera& camera,
             const std::vector<Ray>& rays, const cpu::Executor& executor) {
  constexpr glm::vec3 clay(0.50F, 0.43F, 0.36F);
  constexpr glm::vec3 backdrop(0.80F, 0.84F, 0.89F);
  constexpr float sky = 0.22F;
  constexpr float from_eye = 0.08F;
  constexpr float from_light = 0.90F;

  std::vector<Hit> hits(rays.size());
  closest_hit(executor, tree.view(), triangles, rays, hits);
  const std::vector<SurfacePoint> points =
      surface_points(triangles, tree.view().bounds(), rays, hits);
  const Light light = place_light(camera, tree.view().bounds());
  std::vector<Ray> to_light(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    to_light[i].origin = points[i].origin;
    to_light[i].direction = light.centre - points[i].origin;
    to_light[i].t_max = 1.0F;
  }
  std::vector<std::uint8_t> in_shadow(points.size());
  any_hit(executor, tree.view(), triangles, to_light, in_shadow);

  const glm::vec3 up = glm::normalize(camera.up);
  Pixels samples(rays.size(), backdrop);
  std::size_t next = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].triangle == no_triangle) continue;
    const std::size_t point = next++;
    const glm::vec3 normal = points[point].normal;
    float brightness = sky * (0.5F + 0.5F * glm::dot(normal, up));
    brightness += from_eye * std::abs(glm::dot(normal, glm::normalize(rays[i].direction)));
    if (in_shadow[point] == 0) {
      const glm::vec3 direction = glm::normalize(to_light[point].direction);
      brightness += from_light * std::max(0.0F, glm::dot(normal, direction));
    }
    samples[i] = brightness * clay;
  }
  return samples;
}

// The mean of each 2 x 2 block.
Pixels halve(const Pixels& fine, unsigned size) {
  Pixels image(std::size_t{size} * size);
  const std::size_t row_length = 2 * std::size_t{size};
  for (std::size_t row = 0; row < size; ++row) {
    for (std::size_t column = 0; column < size; ++column) {
      const std::size_t first = 2 * row * row_length + 2 * column;
      image[row * size + column] =
          0.25F *
          (fine[first] + fine[first + 1] + fine[first + row_length] + fine[first + row_length + 1]);
    }
  }
  return image;
}

Pixels depth_image(const std::vector<Hit>& hits) {
  std::vector<double> distances;
  for (const Hit& hit : hits) {
    if (hit.triangle != no_triangle) distances.push_back(static_cast<double>(hit.t));
  }
  const auto nearest = static_cast<float>(percentile(distances, 0.0));
  const auto farthest = static_cast<float>(percentile(distances, 0.995));
  const float range = std::max(farthest - nearest, 1e-6F * std::abs(farthest));
  Pixels image(hits.size(), glm::vec3(0.0F));
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].triangle == no_triangle) continue;
    const float part = range > 0.0F ? std::clamp((hits[i].t - nearest) / range, 0.0F, 1.0F) : 0.0F;
    image[i] = glm::vec3(0.85F * (1.0F - part) * (1.0F - part) + 0.02F);
  }
  return image;
}

}  // namespace

double write_images(const std::filesystem::path& folder, const std::string& name,
                    const TriangleView& triangles, const Tree& tree, const scene::Camera& camera,
                    unsigned size, const cpu::Executor& executor) {
  const auto write = [&](const char* what, const Pixels& image) {
    scene::write_png(folder / (name + "-" + what + ".png"), size, size, image);
  };
  write(
      "shaded",
      halve(shade(triangles, tree, camera, scene::primary_rays(camera, 2 * size), executor), size));

  const std::vector<Ray> rays = scene::primary_rays(camera, size);
  std::vector<Hit> hits(rays.size());
  std::vector<TraversalCost> costs(rays.size());
  closest_hit(executor, tree.view(), triangles, rays, hits, costs);
  write("depth", depth_image(hits));

  std::vector<double> visits(rays.size());
  std::transform(costs.begin(), costs.end(), visits.begin(),
                 [](const TraversalCost& cost) { return static_cast<double>(cost.node_visits); });
  const double white = std::max(1.0, percentile(visits, 0.999));
  Pixels image(rays.size());
  std::transform(visits.begin(), visits.end(), image.begin(),
                 [&](double count) { return scene::heat(static_cast<float>(count / white)); });
  write("visits", image);
  return white;
}

}  // namespace zkd::bench
