// SPDX-License-Identifier: Apache-2.0
//
// The camera's frame and its rays, in double.
#include "scene/camera.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace zkd::scene {
namespace {

struct Double3 {
  double x, y, z;
};

Double3 widen(const glm::vec3& v) { return {v.x, v.y, v.z}; }
Double3 operator+(const Double3& a, const Double3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Double3 operator-(const Double3& a, const Double3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Double3 operator*(double s, const Double3& v) { return {s * v.x, s * v.y, s * v.z}; }
double dot(const Double3& a, const Double3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Double3 cross(const Double3& a, const Double3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// `v` at length 1. Throws when it has no direction.
Double3 unit(const Double3& v, const char* what) {
  const double length = std::sqrt(dot(v, v));
  if (!(length > 0.0) || !std::isfinite(length)) {
    throw std::invalid_argument(std::string("camera: ") + what);
  }
  return (1.0 / length) * v;
}

double half_tangent(double vfov_deg) { return std::tan(vfov_deg * (std::numbers::pi / 360.0)); }

}  // namespace

Camera fit_camera(const Box& box) {
  Double3 lo{-0.5, -0.5, -0.5};
  Double3 hi{0.5, 0.5, 0.5};
  if (!box.empty()) {
    lo = {box.lo[0], box.lo[1], box.lo[2]};
    hi = {box.hi[0], box.hi[1], box.hi[2]};
  }
  const Double3 centre = 0.5 * (lo + hi);
  double radius = 0.5 * std::sqrt(dot(hi - lo, hi - lo));
  // A single point still needs an eye that is somewhere else.
  if (!(radius > 0.0)) radius = std::sqrt(dot(centre, centre)) * 1e-3 + 1e-3;

  Camera camera;
  // The sphere round the box fits when the eye is radius / sin(vfov / 2) away.
  const double tangent = half_tangent(double{camera.vfov_deg});
  const double sine = tangent / std::sqrt(1.0 + tangent * tangent);
  const double distance = 1.02 * radius / sine;
  const Double3 from = unit({0.0, 0.2, 1.0}, "");
  const Double3 eye = centre + distance * from;
  camera.eye = {static_cast<float>(eye.x), static_cast<float>(eye.y), static_cast<float>(eye.z)};
  camera.look_at = {static_cast<float>(centre.x), static_cast<float>(centre.y),
                    static_cast<float>(centre.z)};
  return camera;
}

std::vector<Ray> primary_rays(const Camera& camera, unsigned size) {
  const double vfov = double{camera.vfov_deg};
  if (!(vfov > 0.0 && vfov < 180.0)) {
    throw std::invalid_argument("camera: the field of view must lie between 0 and 180 degrees");
  }
  const Double3 forward = unit(widen(camera.look_at) - widen(camera.eye),
                               "eye and look_at must be two different finite points");
  const Double3 right = unit(cross(forward, unit(widen(camera.up), "up must have a direction")),
                             "up must not be parallel to the view");
  const Double3 up = cross(right, forward);
  const double half = half_tangent(vfov);

  std::vector<Ray> rays;
  rays.reserve(std::size_t{size} * size);
  for (unsigned row = 0; row < size; ++row) {
    const double y = half * (1.0 - (2.0 * row + 1.0) / size);
    for (unsigned column = 0; column < size; ++column) {
      const double x = half * ((2.0 * column + 1.0) / size - 1.0);
      const Double3 direction = unit(forward + x * right + y * up, "no direction");
      Ray ray;
      ray.origin = camera.eye;
      ray.direction = {static_cast<float>(direction.x), static_cast<float>(direction.y),
                       static_cast<float>(direction.z)};
      rays.push_back(ray);
    }
  }
  return rays;
}

}  // namespace zkd::scene
