// SPDX-License-Identifier: Apache-2.0
//
// Which reader a file goes to, and what every mesh must be in the end.
#include "scene/load.hpp"

#include <algorithm>
#include <cmath>
#include <new>
#include <string>

#include "scene/source_file.hpp"

namespace zkd::scene {
namespace {

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return extension;
}

/// What no reader may hand on, whichever library it trusts.
void check(const SourceFile& file, const Mesh& mesh) {
  if (mesh.faces.empty()) file.fail("contains no triangle");
  if (mesh.positions.size() > max_count || mesh.faces.size() > max_count) {
    file.fail("has more than 2147483647 vertices or triangles");
  }
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const glm::vec3& p = mesh.positions[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      file.fail("vertex " + std::to_string(i) + " has a coordinate that is not a finite number");
    }
  }
  for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
    const glm::uvec3& f = mesh.faces[i];
    const std::uint32_t largest = std::max({f.x, f.y, f.z});
    if (largest >= mesh.positions.size()) {
      file.fail("triangle " + std::to_string(i) + " names vertex " + std::to_string(largest) +
                " of " + std::to_string(mesh.positions.size()));
    }
  }
}

}  // namespace

Mesh load_mesh(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  const bool obj = extension == ".obj";
  const bool ply = extension == ".ply";
  const bool stl = extension == ".stl";
  const bool gltf = extension == ".gltf" || extension == ".glb";

  std::error_code error;
  const bool exists = std::filesystem::exists(path, error);
  if (exists && !std::filesystem::is_directory(path, error) && !obj && !ply && !stl && !gltf) {
    throw LoadError(path.string() +
                    ": unknown kind of mesh file; known are .obj .ply .stl .gltf .glb");
  }
  const std::uintmax_t size = exists ? std::filesystem::file_size(path, error) : 0;

  // Each byte is read once, checked once and, in text formats, parsed once more by a library.
  Progress progress("loading " + path.filename().string(), error ? 0 : 3 * size);
  try {
    SourceFile file(path, progress);
    Mesh mesh = obj   ? load_obj(file, progress)
                : ply ? load_ply(file, progress)
                : stl ? load_stl(file, progress)
                      : load_gltf(file, progress);
    check(file, mesh);
    return mesh;
  } catch (const std::bad_alloc&) {
    throw LoadError(path.string() + ": there is not enough memory");
  }
}

Box bounds(const Mesh& mesh) {
  Box box;
  for (const glm::vec3& position : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) {
      const float x = position[axis];
      if (!std::isfinite(x)) continue;
      box.lo[axis] = std::min(box.lo[axis], x);
      box.hi[axis] = std::max(box.hi[axis], x);
    }
  }
  return box;
}

}  // namespace zkd::scene
