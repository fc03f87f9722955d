// SPDX-License-Identifier: Apache-2.0
//
// A file that our own reader has read is read once more by a library, where there is one, and the
// two must agree: a mesh that two readers see differently is trusted by neither. Private to the
// loaders.
#pragma once

#include <cmath>

#include "scene/source_file.hpp"

namespace zkd::scene {

/// Whether a library's rounding of a coordinate is the one of `exact` give or take a few ulp.
[[nodiscard]] inline bool nearly_equal(const glm::vec3& exact, float x, float y, float z) {
  const auto near = [](float a, float b) {
    return std::fabs(a - b) <= 1e-5F * std::fabs(a) + 1e-30F;
  };
  return near(exact.x, x) && near(exact.y, y) && near(exact.z, z);
}

/// Each throws LoadError where the library reads something else; without the library it does
/// nothing.
#if defined(ZKD_SCENE_ASSIMP)
void compare_ply_with_assimp(const SourceFile& file, const Reading& reading);
void compare_stl_with_assimp(const SourceFile& file, const Mesh& mesh);
#else
inline void compare_ply_with_assimp(const SourceFile&, const Reading&) {}
inline void compare_stl_with_assimp(const SourceFile&, const Mesh&) {}
#endif
#if defined(ZKD_SCENE_TINYOBJLOADER)
void compare_obj_with_tinyobjloader(SourceFile& file, const Reading& reading, Progress& progress);
#else
inline void compare_obj_with_tinyobjloader(SourceFile&, const Reading&, Progress&) {}
#endif

}  // namespace zkd::scene
