// SPDX-License-Identifier: Apache-2.0
//
// Run time against error: every setting on one scene, with Embree beside.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <zkd/cpu/executor.hpp>

#include "results.hpp"
#include "runner.hpp"
#include "scenes.hpp"
#include "score.hpp"
#include "settings.hpp"

namespace zkd::bench::accuracy {

/// One setting, one scene, one group of rays.
struct Point {
  std::string scene;
  std::string setting;
  std::string family;
  std::string rays;  ///< "workload" or "adversarial"
  bool peer = false;
  bool cuda = false;
  bool by_intersector = false;  ///< the defaults, with some intersector
  bool stand_in = false;
  std::uint64_t triangles = 0;
  double references_per_triangle = 0.0;  ///< 0: unknown (a peer)
  Spread build_ms;
  Spread trace_ms;
  double ns_per_ray = 0.0;  ///< at the median, on all threads
  Score score;
  bool pareto = false;  ///< of all on this scene, these rays and this device, none is faster (build
                        ///< and trace) without being worse, or better without being slower

  [[nodiscard]] double build_and_trace_ms() const { return build_ms.median + trace_ms.median; }
  /// E1 + E2.
  [[nodiscard]] double error() const;
};

struct CurveOptions {
  unsigned repeat = 3;
  /// A setting whose rays would take longer than this on one repetition is measured on every k-th
  /// ray only.
  double longest_ms = 10000.0;
  Beside beside;
  bool intersectors_only = false;  ///< of zkd the defaults alone, with each intersector
};

/// Builds and traces every setting `repeat` times, interleaved, and holds the answers of the first
/// against the truth of `sets`. All rays are asked for their nearest hit, shadow rays too.
[[nodiscard]] std::vector<Point> measure_curves(const TestScene& scene,
                                                const std::vector<RaySet>& sets,
                                                const verify::Oracle& oracle,
                                                const cpu::Executor& executor,
                                                const CurveOptions& options);

}  // namespace zkd::bench::accuracy
