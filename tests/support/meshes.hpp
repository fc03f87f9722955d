// SPDX-License-Identifier: Apache-2.0
//
// The hard meshes of the tests: those that the stress run has too, and each kind of small mesh as a
// GoogleTest parameter.
#pragma once

#include <cctype>
#include <ostream>
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
