// SPDX-License-Identifier: Apache-2.0
//
// What is measured on: scenes that were found, and generated ones that are hard on purpose; for
// each, the workload and rays aimed at edges and vertices.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>

#include "scene/camera.hpp"
#include "scene/mesh.hpp"
#include "truth.hpp"

namespace zkd::bench::accuracy {

struct TestScene {
  std::string name;
  bool stand_in = false;
  bool generated = false;
  scene::Mesh mesh;
  scene::Camera camera;
};

/// Slivers, a scene far from the origin, diagonal needles, a small model in a large room; `n`
/// triangles or so each (needles: a tenth, each box is nearly the whole scene).
[[nodiscard]] std::vector<TestScene> stress_scenes(std::uint32_t n, std::uint64_t seed);

/// Rays of one kind with their exact answers.
struct RaySet {
  std::string kind;   ///< "primary", "diffuse", "shadow" or "adversarial"
  std::string group;  ///< "workload" or "adversarial"
  std::vector<Ray> rays;
  std::unique_ptr<Truth> truth;
};

/// The workload of zkd-bench (size * size primary rays, a bounce and a shadow ray from each hit)
/// and size * size rays aimed at vertices, edges, faces and beside vertices. Kinds without a ray
/// are left out. Exact answers come from `oracle`; `scene` must outlive the sets.
[[nodiscard]] std::vector<RaySet> ray_sets(const TestScene& scene, const verify::Oracle& oracle,
                                           const cpu::Executor& executor, unsigned size,
                                           std::uint64_t seed);

}  // namespace zkd::bench::accuracy
