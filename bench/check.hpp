// SPDX-License-Identifier: Apache-2.0
//
// --check: answers held against the exact oracle.
#pragma once

#include <memory>

#include "contender_zkd.hpp"
#include "options.hpp"
#include "results.hpp"
#include "scene/camera.hpp"
#include "scene/mesh.hpp"

namespace zkd::bench {

/// The oracle of one scene.
class Checker {
 public:
  Checker() = default;
  virtual ~Checker() = default;
  Checker(const Checker&) = delete;             // holds the scene and a tree of its own over it
  Checker& operator=(const Checker&) = delete;  // likewise

  /// Traces options.check rays of each kind through the tree that `contender` has built, judges
  /// every answer, and writes Result::checks and Result::check.
  ///
  /// Shadow rays are asked for their nearest hit as well, and any_hit must agree with it: where it
  /// does not, that counts as missed or phantom outside the band. On a closed mesh (every edge
  /// belongs to two faces that run along it in opposite directions, by index) as many rays start
  /// just below the surface, and those that leave count as leaks.
  virtual void check(ZkdContender& contender, Result& result) const = 0;
};

/// All arguments must outlive it. `threads`: of the oracle.
///
/// Throws UsageError where this program was built without GMP.
[[nodiscard]] std::unique_ptr<Checker> make_checker(const scene::Mesh& mesh,
                                                    const scene::Camera& camera,
                                                    const Options& options, int threads);

}  // namespace zkd::bench
