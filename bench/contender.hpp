// SPDX-License-Identifier: Apache-2.0
//
// Something that builds a structure over a mesh and traces rays through it, under a clock. zkd and
// its peers look the same from here, so that all are measured by the same loop.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <zkd/geometry.hpp>

#include "results.hpp"
#include "spread.hpp"

namespace zkd::bench {

/// Milliseconds since it was made.
class Stopwatch {
 public:
  [[nodiscard]] double ms() const {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin_).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_ = Clock::now();
};

/// Rays that hit something.
[[nodiscard]] inline std::uint64_t count_hits(std::span<const Hit> hits) {
  return static_cast<std::uint64_t>(std::count_if(
      hits.begin(), hits.end(), [](const Hit& hit) { return hit.triangle != no_triangle; }));
}
[[nodiscard]] inline std::uint64_t count_hits(std::span<const std::uint8_t> occluded) {
  return static_cast<std::uint64_t>(std::count(occluded.begin(), occluded.end(), std::uint8_t{1}));
}

class Contender {
 public:
  Contender() = default;
  virtual ~Contender() = default;
  Contender(const Contender&) = delete;             // owns structures and devices
  Contender& operator=(const Contender&) = delete;  // likewise

  /// The ways it can trace what it built, each reported by itself; at least one.
  [[nodiscard]] virtual std::vector<std::string> names() const = 0;

  /// Builds from raw arrays in memory to a structure that can be traced; returns the milliseconds
  /// of that alone. What was built before is gone.
  virtual double build() = 0;

  struct Timing {
    double ms = 0.0;
    std::uint64_t hits = 0;
  };

  /// Nearest hit of each ray (shadow rays: any hit), in way number `way` of names(), on all
  /// threads. The hits are written to memory within the time.
  virtual Timing trace(std::size_t way, RayKind kind, std::span<const Ray> rays) = 0;

  /// Frees what was built, or keeps its memory for the next build() where that is how it builds.
  virtual void clear() = 0;
};

}  // namespace zkd::bench
