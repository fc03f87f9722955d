// SPDX-License-Identifier: Apache-2.0
//
// The hard meshes of the tests: those that the stress run has too, and each kind of small mesh as a
// GoogleTest parameter.
#pragma once

#include <cctype>
#include <cstdint>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "support/random.hpp"

namespace zkd::test {

using scene::book;
using scene::denormals;
using scene::few_ulps;
using scene::integer_mesh;
using scene::jittered;
using scene::many_scales;
using scene::NamedMesh;
using scene::nested_shells;
using scene::small_mesh;
using scene::small_mesh_kinds;

/// `small` triangles of a twentieth of the unit cube, and `large` through all of it.
inline scene::Mesh room(std::uint32_t small, std::uint32_t large) {
  scene::Mesh mesh;
  std::minstd_rand numbers(3);
  const auto number = [&numbers] { return static_cast<float>(numbers() % 1024) / 1024.0F; };
  const auto point = [&number] {
    const float x = number();
    const float y = number();
    return glm::vec3(x, y, number());
  };
  for (std::uint32_t i = 0; i < small + large; ++i) {
    const glm::vec3 at = i < small ? point() : glm::vec3(0);
    for (int corner = 0; corner < 3; ++corner)
      mesh.positions.push_back(i < small ? 0.95F * at + 0.05F * point() : point());
    mesh.faces.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

/// A kind of small mesh as a GoogleTest parameter: its name is the name of the case.
struct MeshKind {
  int number = 0;

  [[nodiscard]] std::string name() const {
    std::string text = small_mesh(number, 1).name;
    for (char& c : text) {
      if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
    }
    return text;
  }
};

inline void PrintTo(const MeshKind& kind, std::ostream* out) { *out << kind.name(); }

inline std::vector<MeshKind> every_mesh_kind() {
  std::vector<MeshKind> all;
  for (int kind = 0; kind < small_mesh_kinds; ++kind) all.push_back({kind});
  return all;
}

}  // namespace zkd::test
