// SPDX-License-Identifier: Apache-2.0
//
// Rays that have ever been hard, made from the mesh and the tree they are shot at.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include <zkd/geometry.hpp>
#include <zkd/tree.hpp>

#include "scene/mesh.hpp"
#include "scene/random.hpp"

namespace zkd::scene {

/// The ray from one point towards another, which is at t = 1 but for rounding.
[[nodiscard]] Ray ray_between(const glm::vec3& from, const glm::vec3& to);

/// Makes rays at `mesh`; the tree lends its planes and cell corners. Both must outlive it. Where
/// the mesh has no faces, points inside its box stand for vertices, edges and faces.
class RayMaker {
 public:
  RayMaker(const Mesh& mesh, const TreeView& tree, std::uint64_t seed);

  /// `count` rays of all kinds in turn, each with t in [0, infinity) or a random interval.
  std::vector<Ray> all_kinds(std::uint32_t count);

  /// One of `kinds` kinds.
  static constexpr int kinds = 12;
  Ray of_kind(int kind);

  // ---- Points

  glm::vec3 inside();   ///< the scene box
  glm::vec3 around();   ///< the scene box, outside it more often than not
  glm::vec3 vertex();   ///< of a random face
  glm::vec3 on_edge();  ///< rounded
  glm::vec3 on_face();  ///< rounded
  glm::vec3 cell_corner();
  glm::vec3 moved(glm::vec3 p, int most);  ///< by up to so many ulps on each axis

  // ---- Rays

  /// Along or against an axis from outside the box; the other components are +0 or -0.
  Ray along_axis(const glm::vec3& through);
  /// Its origin and direction lie in a split plane.
  Ray in_plane();
  /// As along_axis, but the other components may be 1e-7 to 1e-45.
  Ray nearly_parallel();
  /// From 10^7 times the size of the scene.
  Ray from_afar();
  /// From a vertex or a point of a face.
  Ray from_surface();

  Random& random() { return random_; }
  /// Largest half side of the box.
  [[nodiscard]] float size() const { return size_; }

 private:
  const glm::uvec3& face();
  float signed_zero();
  float plane(std::uint32_t& axis);

  const Mesh& mesh_;
  const TreeView tree_;
  Random random_;
  glm::vec3 lo_{0.0F};
  glm::vec3 extent_{0.0F};  // half of it, so that it cannot overflow
  float size_ = 1.0F;
};

/// All of the above and those of generate.hpp: `count` rays of RayMaker's kinds, a quarter as many
/// of random_rays, rays_at_features and axis_rays each (the latter two where there are faces).
[[nodiscard]] std::vector<Ray> hard_rays(const Mesh& mesh, const TreeView& tree,
                                         std::uint32_t count, std::uint64_t seed);

}  // namespace zkd::scene
