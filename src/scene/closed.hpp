// SPDX-License-Identifier: Apache-2.0
//
// Which meshes have an inside.
#pragma once

#include "scene/mesh.hpp"

namespace zkd::scene {

/// Whether every edge belongs to exactly two faces that run along it in opposite directions, by
/// index: a closed, oriented surface. False for a mesh without faces. O(n log n).
[[nodiscard]] bool is_closed(const Mesh& mesh);

}  // namespace zkd::scene
