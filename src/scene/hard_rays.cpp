// SPDX-License-Identifier: Apache-2.0
//
// Rays at features of a mesh and of a tree over it.
#include "scene/hard_rays.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/generate.hpp"

namespace zkd::scene {

Ray ray_between(const glm::vec3& from, const glm::vec3& to) {
  Ray ray;
  ray.origin = from;
  ray.direction = to - from;
  return ray;
}

RayMaker::RayMaker(const Mesh& mesh, const TreeView& tree, std::uint64_t seed)
    : mesh_(mesh), tree_(tree), random_(seed) {
  for (int a = 0; a < 3; ++a) {
    lo_[a] = tree.bounds().empty() ? -1.0F : tree.bounds().lo[a];
    extent_[a] = tree.bounds().empty() ? 2.0F : tree.bounds().hi[a] / 2 - tree.bounds().lo[a] / 2;
  }
  size_ = std::max({extent_.x, extent_.y, extent_.z, std::numeric_limits<float>::denorm_min()});
}

std::vector<Ray> RayMaker::all_kinds(std::uint32_t count) {
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i < count; ++i) {
    Ray ray = of_kind(static_cast<int>(i % kinds));
    if (random_.one_in(8)) {
      ray.t_min = 2.0F * random_.unit();
      ray.t_max = random_.one_in(4) ? ray.t_min : ray.t_min + random_.unit();
    }
    if (random_.one_in(16)) ray.t_min = -std::numeric_limits<float>::infinity();
    rays.push_back(ray);
  }
  return rays;
}

Ray RayMaker::of_kind(int kind) {
  switch (kind) {
    case 0:
      return ray_between(around(), inside());
    case 1:
      return ray_between(around(), vertex());
    case 2:
      return ray_between(around(), on_edge());
    case 3:
      return ray_between(around(), moved(vertex(), 8));
    case 4:
      return along_axis(random_.one_in(2) ? vertex() : moved(vertex(), 1));
    case 5:
      return in_plane();
    case 6:
      return ray_between(around(), cell_corner());
    case 7:
      return nearly_parallel();
    case 8:
      return from_afar();
    case 9:
      return from_surface();
    case 10:
      return ray_between(inside(), random_.one_in(2) ? vertex() : on_edge());
    default: {  // any length of direction
      Ray ray = ray_between(around(), on_face());
      ray.direction *= std::ldexp(1.0F, random_.integer(-60, 60)) * (1.0F + random_.unit());
      return ray;
    }
  }
}

glm::vec3 RayMaker::inside() {
  glm::vec3 p;
  for (int a = 0; a < 3; ++a) p[a] = lo_[a] + 2.0F * extent_[a] * random_.unit();
  return p;
}

glm::vec3 RayMaker::around() {
  glm::vec3 p = inside();
  for (int a = 0; a < 3; ++a) p[a] += 2.0F * size_ * random_.signed_unit();
  return p;
}

const glm::uvec3& RayMaker::face() {
  return mesh_.faces[random_.below(static_cast<std::uint32_t>(mesh_.faces.size()))];
}

glm::vec3 RayMaker::vertex() {
  if (mesh_.faces.empty()) return inside();
  return mesh_.positions[face()[random_.integer(0, 2)]];
}

glm::vec3 RayMaker::on_edge() {
  if (mesh_.faces.empty()) return inside();
  const glm::uvec3& f = face();
  const int corner = random_.integer(0, 2);
  const glm::vec3& a = mesh_.positions[f[corner]];
  const glm::vec3& b = mesh_.positions[f[(corner + 1) % 3]];
  return a + random_.unit() * (b - a);
}

glm::vec3 RayMaker::on_face() {
  if (mesh_.faces.empty()) return inside();
  const glm::uvec3& f = face();
  const glm::vec3& a = mesh_.positions[f[0]];
  const float u = random_.unit();
  const float v = (1.0F - u) * random_.unit();
  return a + u * (mesh_.positions[f[1]] - a) + v * (mesh_.positions[f[2]] - a);
}

glm::vec3 RayMaker::moved(glm::vec3 p, int most) {
  for (int a = 0; a < 3; ++a) p[a] = ulps(p[a], random_.integer(-most, most));
  return p;
}

float RayMaker::signed_zero() { return random_.one_in(2) ? 0.0F : -0.0F; }

Ray RayMaker::along_axis(const glm::vec3& through) {
  const int axis = random_.integer(0, 2);
  Ray ray;
  ray.origin = through;
  ray.direction = {signed_zero(), signed_zero(), signed_zero()};
  const bool forward = random_.one_in(2);
  ray.direction[axis] = forward ? 1.0F : -1.0F;
  ray.origin[axis] = forward ? lo_[axis] - size_ : lo_[axis] + 2.0F * extent_[axis] + size_;
  return ray;
}

/// A split plane: axis and position in the caller's units.
float RayMaker::plane(std::uint32_t& axis) {
  if (tree_.node_count() == 0) {
    axis = random_.below(3);
    return lo_[static_cast<int>(axis)];
  }
  const Node& node = tree_.nodes[random_.below(tree_.node_count())];
  axis = node.axis;
  return node.plane / tree_.scale();
}

Ray RayMaker::in_plane() {
  std::uint32_t axis = 0;
  const float at = plane(axis);
  Ray ray = ray_between(around(), random_.one_in(2) ? vertex() : inside());
  const int a = static_cast<int>(axis);
  ray.origin[a] = at;
  ray.direction[a] = signed_zero();
  if (random_.one_in(3)) ray.direction[(a + 1) % 3] = signed_zero();
  return ray;
}

glm::vec3 RayMaker::cell_corner() {
  glm::vec3 corner = inside();
  for (int i = 0; i < 6; ++i) {
    std::uint32_t axis = 0;
    const float at = plane(axis);
    corner[static_cast<int>(axis)] = at;
  }
  return corner;
}

Ray RayMaker::nearly_parallel() {
  const glm::vec3 through = random_.one_in(2) ? vertex() : cell_corner();
  Ray ray = along_axis(through);
  for (int a = 0; a < 3; ++a) {
    if (ray.direction[a] != 0.0F || random_.one_in(4)) continue;
    static constexpr float small[] = {1e-7F, 1e-10F, 1e-16F, 1e-25F, 1e-38F, 1e-45F};
    ray.direction[a] = (random_.one_in(2) ? 1.0F : -1.0F) * small[random_.below(6)];
  }
  return ray;
}

Ray RayMaker::from_afar() {
  const glm::vec3 to = random_.one_in(2) ? on_face() : vertex();
  const glm::vec3 away = random_.in_cube();
  return ray_between(to + away * (size_ * 1e7F), to);
}

Ray RayMaker::from_surface() {
  const glm::vec3 from = random_.one_in(2) ? vertex() : on_face();
  Ray ray = ray_between(from, random_.one_in(2) ? inside() : vertex());
  return ray;
}

std::vector<Ray> hard_rays(const Mesh& mesh, const TreeView& tree, std::uint32_t count,
                           std::uint64_t seed) {
  std::vector<Ray> rays = RayMaker(mesh, tree, seed).all_kinds(count);
  const auto append = [&](const std::vector<Ray>& more) {
    rays.insert(rays.end(), more.begin(), more.end());
  };
  append(random_rays(tree.bounds(), count / 4, seed));
  if (mesh.faces.empty()) return rays;
  append(rays_at_features(mesh, count / 4, seed));
  append(axis_rays(mesh, count / 4, seed));
  return rays;
}

}  // namespace zkd::scene
