// SPDX-License-Identifier: Apache-2.0
//
// E6 and E7: how good a tree is, and whether it is one and the same tree however it is built.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <zkd/cpu/executor.hpp>

#include "scenes.hpp"

namespace zkd::bench::accuracy {

/// E6: one tree of one scene.
struct TreeQuality {
  std::string scene;
  std::string tree;  ///< "once", "all", or "exact SAH": Builder::sah
  std::uint64_t triangles = 0;
  double sah_cost = 0.0;        ///< Statistics::sah_cost
  double sah_over_exact = 0.0;  ///< over that of the exact-SAH tree
  double node_visits_per_ray = 0.0;
  double triangle_tests_per_ray = 0.0;
  double references_per_triangle = 0.0;
  std::uint64_t tree_bytes = 0;
  std::uint32_t depth = 0;
  std::uint32_t deepest_stack = 0;  ///< entries that waited at once, over these rays
};

/// The exact-SAH tree, `once` and `all`, on the workload of `sets`.
[[nodiscard]] std::vector<TreeQuality> measure_quality(const TestScene& scene,
                                                       const std::vector<RaySet>& sets,
                                                       const cpu::Executor& executor);

/// E7: trees that should be one.
struct Determinism {
  std::uint64_t cases = 0;   ///< a mesh and a reference policy
  std::uint64_t builds = 0;  ///< over threads, instruction sets, backends and permutations
  /// Hashes beyond the first, over all cases.
  std::uint64_t hashes_too_many = 0;
  std::string first_offender;
  std::vector<std::string> backends;
};

/// The scenes and `small_meshes` small meshes, each built on 1, 2, 3 and 8 threads in both
/// instruction sets, with `cuda` on the device, and with its triangles in two other orders.
[[nodiscard]] Determinism compare_hashes(const std::vector<TestScene>& scenes,
                                         std::uint64_t small_meshes, std::uint64_t seed, bool cuda);

}  // namespace zkd::bench::accuracy
