// SPDX-License-Identifier: Apache-2.0
//
// --check: answers held against the exact oracle.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include <zkd/cpu/executor.hpp>
#include <zkd/tree.hpp>

#include "results.hpp"
#include "scene/camera.hpp"
#include "scene/mesh.hpp"
#include "verify/oracle.hpp"

namespace zkd::bench {

/// What a check needs to know about its scene.
struct CheckedScene {
  const scene::Mesh& mesh;
  const verify::Oracle& oracle;
  const scene::Camera& camera;
  std::vector<RayKind> kinds;
  unsigned size;        ///< of the timed image: its rays are taken where they are enough
  std::uint64_t count;  ///< rays of each kind
  std::uint64_t seed;
};

/// Traces `scene.count` rays of each kind through `tree` and judges every answer. Shadow rays are
/// asked for their nearest hit as well, and any_hit must agree with it: where it does not, that
/// counts as missed or phantom outside the band.
[[nodiscard]] std::map<RayKind, Check> check_tree(const CheckedScene& scene, const Tree& tree,
                                                  const cpu::Executor& executor);

/// All kinds in one. t_ulp_p999 is the largest of theirs, which that of all rays together cannot
/// exceed.
[[nodiscard]] Check all_kinds(const std::map<RayKind, Check>& checks);

/// Whether every edge belongs to two faces that run along it in opposite directions. By index:
/// vertices that only coincide do not close a mesh.
[[nodiscard]] bool is_closed(const scene::Mesh& mesh);

/// Rays that leave the inside of a closed mesh: `scene.count` rays from just below the surface, of
/// which those count that the oracle sees hit and zkd does not.
[[nodiscard]] std::uint64_t count_leaks(const CheckedScene& scene, const Tree& tree,
                                        const cpu::Executor& executor);

}  // namespace zkd::bench
