// SPDX-License-Identifier: Apache-2.0
//
// Triangles that own their memory: what loaders and generators return.
#pragma once

#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>
#include <vector>

#include <zkd/geometry.hpp>

namespace zkd::scene {

/// Positions and, for each triangle, three indices into them.
struct Mesh {
  std::vector<glm::vec3> positions;
  std::vector<glm::uvec3> faces;

  /// The same triangles for zkd. Valid as long as this mesh lives and is not changed.
  [[nodiscard]] TriangleView view() const { return TriangleView(positions, faces); }
};

/// The box of all positions, whether a face names them or not; coordinates that are NaN or infinite
/// do not count. Empty for a mesh without positions.
[[nodiscard]] Box bounds(const Mesh& mesh);

}  // namespace zkd::scene
