// SPDX-License-Identifier: Apache-2.0
//
// From a mesh file to triangles, all of them or one clear error.
#pragma once

#include <filesystem>
#include <stdexcept>

#include "scene/mesh.hpp"

namespace zkd::scene {

/// A file that is missing, broken or without triangles. The message is one line that begins with
/// `file:line: ` (text), `file: byte N: ` (binary) or `file: `, and names the first offender.
class LoadError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads .obj, .ply, .stl, .gltf or .glb; the extension decides, in any case.
///
/// Positions and faces keep the order of the file. Polygons become the fan round their first
/// corner: n corners, n - 2 triangles. Nothing is merged, mended or left out: zero-area triangles
/// and unreferenced vertices stay. STL has no indices, so each triangle brings three positions.
/// glTF nodes are put in their place by their transforms, each instance a copy; points and lines
/// are no triangles and are passed over, in OBJ too.
///
/// OBJ, PLY and STL are read by zkd, strictly, and where the program has tinyobjloader or Assimp
/// once more by that: both must see the same mesh. glTF needs Assimp.
///
/// Throws LoadError for a file that cannot be read, ends early, contradicts its own counts, has a
/// coordinate that is not a finite number in float, has an index that names no vertex, or has no
/// triangle at all, or for want of memory (std::bad_alloc where there is none for the message).
/// Draws a Progress.
[[nodiscard]] Mesh load_mesh(const std::filesystem::path& file);

/// Whether this program was built with Assimp, without which a glTF file is a LoadError.
[[nodiscard]] bool can_read_gltf() noexcept;

}  // namespace zkd::scene
