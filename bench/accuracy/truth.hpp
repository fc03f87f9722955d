// SPDX-License-Identifier: Apache-2.0
//
// What a set of rays hits exactly: asked of the oracle once, held against the answers of every
// setting.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <zkd/geometry.hpp>

#include "verify/oracle.hpp"

namespace zkd::bench::accuracy {

/// Where a ray's nearest hit lies (verify::HitClass), or that there is none.
enum class RayClass : std::uint8_t { interior, edge, vertex, duplicate, miss };
inline constexpr std::size_t ray_classes = 5;

/// "interior", ..., "miss". Static storage.
[[nodiscard]] const char* to_string(RayClass value) noexcept;

class Truth {
 public:
  /// The exact answer to one ray. On a miss t is infinite.
  struct Answer {
    double t;
    /// |d| |n| / |d . n| for the first triangle of the tie set: 1 for a ray along its normal,
    /// infinite for one in its plane.
    double condition;
    /// Largest distance along an axis from the origin to a corner of it, in units of t.
    double reach;
    double u;  ///< where the first triangle of the tie set is hit, as in Hit
    double v;
    RayClass ray_class;
  };

  /// Asks the oracle about every ray, on `threads` threads. `rays` and `triangles` must outlive it.
  Truth(const verify::Oracle& oracle, const TriangleView& triangles, std::span<const Ray> rays,
        int threads);

  [[nodiscard]] std::span<const Ray> rays() const { return rays_; }
  [[nodiscard]] const Answer& answer(std::size_t ray) const { return answers_[ray]; }

  /// Every triangle at exactly the nearest t, ascending; empty on a miss.
  [[nodiscard]] std::span<const std::uint32_t> ties(std::size_t ray) const {
    return {ties_.data() + first_tie_[ray], ties_.data() + first_tie_[ray + 1]};
  }

  /// Processor time that the oracle took, of all threads together.
  [[nodiscard]] double oracle_seconds() const { return oracle_seconds_; }

 private:
  std::span<const Ray> rays_;
  std::vector<Answer> answers_;
  std::vector<std::size_t> first_tie_;
  std::vector<std::uint32_t> ties_;
  double oracle_seconds_ = 0.0;
};

}  // namespace zkd::bench::accuracy
