// SPDX-License-Identifier: Apache-2.0
//
// Scenes and rays, all from generators that give the same bits everywhere.
#include "scenes.hpp"

#include <utility>

#include <zkd/build.hpp>
#include <zkd/query.hpp>

#include "rays.hpp"
#include "scene/generate.hpp"
#include "scene/progress.hpp"

namespace zkd::bench::accuracy {

std::vector<TestScene> stress_scenes(std::uint32_t n, std::uint64_t seed) {
  std::vector<TestScene> scenes;
  const auto add = [&](const char* name, scene::Mesh mesh) {
    const scene::Camera camera = scene::fit_camera(scene::bounds(mesh));
    scenes.push_back({name, false, true, std::move(mesh), camera});
  };
  add("slivers-1e5", scene::slivers(n, 1e5F, seed));
  add("offset-1e6", scene::offset(scene::soup(n, seed), glm::vec3(1e6F)));
  add("needles", scene::needles(n / 10, seed));
  add("small-in-large-1e4", scene::small_in_large(n, 1e4F, seed));
  return scenes;
}

std::vector<RaySet> ray_sets(const TestScene& scene, const verify::Oracle& oracle,
                             const cpu::Executor& executor, unsigned size, std::uint64_t seed) {
  const TriangleView triangles = scene.mesh.view();
  BuildOptions options;
  options.invalid_triangles = InvalidTriangles::skip;
  const Tree tree = zkd::build(executor, triangles, options);
  const Box box = tree.view().bounds();

  std::vector<RaySet> sets;
  const auto add = [&](std::string kind, std::string group, std::vector<Ray> rays) {
    if (!rays.empty())
      sets.push_back({std::move(kind), std::move(group), std::move(rays), nullptr});
  };
  std::vector<Ray> primary = tiled_primary_rays(scene.camera, size).rays;
  std::vector<Hit> hits(primary.size());
  zkd::closest_hit(executor, tree.view(), triangles, primary, hits);
  const std::vector<SurfacePoint> points = surface_points(triangles, box, primary, hits);
  add("primary", "workload", std::move(primary));
  add("diffuse", "workload", diffuse_rays(points, points.size(), seed));
  add("shadow", "workload",
      shadow_rays(points, place_light(scene.camera, box), points.size(), seed));
  add("adversarial", "adversarial", scene::rays_at_features(scene.mesh, size * size, seed));

  for (RaySet& set : sets) {
    const scene::Progress progress(scene.name + ": exact answers to " + set.kind + " rays", 0);
    set.truth = std::make_unique<Truth>(oracle, triangles, set.rays, executor.threads);
  }
  return sets;
}

}  // namespace zkd::bench::accuracy
