// SPDX-License-Identifier: Apache-2.0
//
// What a captured build is replayed over: frames of one size, each as unlike the one before as can
// be.
#pragma once

#include <limits>
#include <utility>
#include <vector>

#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "support/meshes.hpp"

namespace zkd::test {

/// Scenes of 2000 triangles and 6000 positions, from which to which a replay has to come.
inline std::vector<NamedMesh> frames() {
  std::vector<NamedMesh> all;
  const auto add = [&](const char* name, scene::Mesh mesh) {
    mesh.positions.resize(6000);
    all.push_back({name, std::move(mesh)});
  };
  add("soup", scene::soup(2000, 73));
  scene::Mesh mesh = scene::soup(2000, 73);
  mesh.positions[3000].y = std::numeric_limits<float>::quiet_NaN();
  add("a NaN", mesh);
  add("another soup", scene::soup(2000, 74));
  mesh.positions[3000].y = 0.0F;
  mesh.faces[77].z = 6000;
  add("an index out of range", mesh);
  add("crowds", scene::same_centre(2000, 75));
  add("needles", scene::needles(2000, 76));
  add("slivers", scene::slivers(2000, 1e3F, 77));
  mesh = scene::soup(2000, 78);
  for (glm::uvec3& face : mesh.faces) face = {1, 1, 2};
  add("zero area", mesh);
  add("stadium", scene::small_in_large(1988, 1e6F, 79));
  add("random bits", scene::random_bits(2000, 80));
  add("tiny", scene::scaled(scene::soup(2000, 81), -120));
  return all;
}

}  // namespace zkd::test
