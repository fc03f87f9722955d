// SPDX-License-Identifier: Apache-2.0
//
// Where a picture is taken from, and the rays that take it.
#pragma once

#include <glm/ext/vector_float3.hpp>
#include <vector>

#include <zkd/geometry.hpp>

namespace zkd::scene {

/// A pinhole camera, right-handed, for square images.
struct Camera {
  glm::vec3 eye{0.0F, 0.0F, 1.0F};
  glm::vec3 look_at{0.0F};
  glm::vec3 up{0.0F, 1.0F, 0.0F};  ///< need not be perpendicular to the view
  float vfov_deg = 40.0F;          ///< full vertical field of view, degrees, in (0, 180)
};

/// A camera in front of the box (+z side, y up, slightly raised) that sees all of it. An empty box
/// is taken as the unit cube round 0.
[[nodiscard]] Camera fit_camera(const Box& box);

/// One ray through the centre of each of size * size pixels, row by row, row 0 on top. Directions
/// have unit length; t runs from 0 to infinity.
///
/// Computed in double with + - * / and square root, apart from one tangent, and rounded once: the
/// same rays on every machine as long as that tangent agrees.
///
/// Throws std::invalid_argument for a camera that looks nowhere (eye = look_at, up along the view,
/// a field of view outside (0, 180), anything not finite).
[[nodiscard]] std::vector<Ray> primary_rays(const Camera& camera, unsigned size);

}  // namespace zkd::scene
