// SPDX-License-Identifier: Apache-2.0
//
// Pixels and vertices with their errors, in formats that need no library.
#include "pictures.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>

#include <zkd/build.hpp>

#include "rays.hpp"
#include "runner.hpp"
#include "scene/generate.hpp"
#include "scene/progress.hpp"
#include "scene/random.hpp"
#include "settings.hpp"
#include "usage_error.hpp"
#include "walks.hpp"

namespace zkd::bench::accuracy {
namespace {

void write_pgm(const std::filesystem::path& file, unsigned size,
               const std::vector<std::uint8_t>& pixels) {
  std::ofstream out(file, std::ios::trunc | std::ios::binary);
  out << "P5\n" << size << ' ' << size << "\n255\n";
  out.write(reinterpret_cast<const char*>(pixels.data()),
            static_cast<std::streamsize>(pixels.size()));
  out.flush();
  if (!out) throw UsageError("--plots: cannot write " + file.string());
}

// How much the surface faces the ray; 255 where nothing is hit.
std::uint8_t shade(const TriangleView& triangles, const Ray& ray, std::uint32_t triangle) {
  glm::dvec3 corner[3];
  for (int i = 0; i < 3; ++i) {
    const float* p = triangles.position(triangles.index(triangle, i));
    corner[i] = {p[0], p[1], p[2]};
  }
  const glm::dvec3 normal = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
  const glm::dvec3 direction(ray.direction);
  const double facing = std::abs(glm::dot(normal, direction)) /
                        std::sqrt(glm::dot(normal, normal) * glm::dot(direction, direction));
  return static_cast<std::uint8_t>(60.0 + 150.0 * std::clamp(facing, 0.0, 1.0));
}

}  // namespace

void write_literal_errors(const std::filesystem::path& folder, const TestScene& scene,
                          const verify::Oracle& oracle, unsigned size,
                          const cpu::Executor& executor) {
  const scene::Progress progress(scene.name + ": picture", 0);
  const TriangleView triangles = scene.mesh.view();
  const PrimaryRays primary = tiled_primary_rays(scene.camera, size);
  const Truth truth(oracle, triangles, primary.rays, executor.threads);
  BuildOptions options;
  options.invalid_triangles = InvalidTriangles::skip;
  const Tree tree = zkd::build(executor, triangles, options);
  std::vector<Hit> hits(primary.rays.size());
  closest_hit(Walk::literal, Intersector::watertight, executor, tree.view(), triangles,
              primary.rays, hits);

  std::vector<std::uint8_t> shades(primary.rays.size(), 255);
  std::vector<std::uint8_t> errors(primary.rays.size(), 0);
  for (std::size_t i = 0; i < primary.rays.size(); ++i) {
    const auto ties = truth.ties(i);
    if (ties.empty()) continue;
    const std::uint32_t pixel = primary.pixels[i];
    shades[pixel] = shade(triangles, primary.rays[i], ties.front());
    if (hits[i].triangle == no_triangle) {
      errors[pixel] = 255;
    } else if (!std::binary_search(ties.begin(), ties.end(), hits[i].triangle)) {
      errors[pixel] = 128;
    }
  }
  write_pgm(folder / (scene.name + "-shade.pgm"), size, shades);
  write_pgm(folder / (scene.name + "-literal.pgm"), size, errors);
}

void write_vertex_leaks(const std::filesystem::path& folder, unsigned rays, std::uint64_t seed,
                        const cpu::Executor& executor) {
  const scene::Mesh mesh = scene::sphere(4);
  std::vector<Peer> entrants;
  entrants.push_back({"zkd", make_runner(all_settings(false).front(), mesh, executor)});
  for (Peer& peer : make_peers(mesh, executor.threads)) entrants.push_back(std::move(peer));

  // Rays start near the centre, each somewhere else.
  scene::Random random(seed);
  std::vector<Ray> all;
  for (const glm::vec3& vertex : mesh.positions) {
    for (unsigned i = 0; i < rays; ++i) {
      Ray ray;
      ray.origin = random.point(-0.25F, 0.25F);
      ray.direction = vertex - ray.origin;
      all.push_back(ray);
    }
  }
  std::vector<std::vector<unsigned>> leaks;
  std::vector<Hit> hits(all.size());
  for (const Peer& entrant : entrants) {
    entrant.runner->build();
    entrant.runner->closest_hit(all, hits);
    std::vector<unsigned>& of_vertex = leaks.emplace_back(mesh.positions.size(), 0u);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].triangle == no_triangle) ++of_vertex[i / rays];
    }
  }

  const std::filesystem::path file = folder / "vertices.csv";
  std::ofstream out(file, std::ios::trunc);
  out << "x,y,z,rays";
  for (const Peer& entrant : entrants) out << ',' << entrant.name;
  out << '\n';
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const glm::vec3& p = mesh.positions[i];
    out << p.x << ',' << p.y << ',' << p.z << ',' << rays;
    for (const std::vector<unsigned>& of_vertex : leaks) out << ',' << of_vertex[i];
    out << '\n';
  }
  if (!out.flush()) throw UsageError("--plots: cannot write " + file.string());
}

}  // namespace zkd::bench::accuracy
