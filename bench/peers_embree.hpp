// SPDX-License-Identifier: Apache-2.0
//
// Embree as a contender: three build qualities, each plain and ROBUST, single rays and 8-packets.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "contender.hpp"
#include "scene/mesh.hpp"

namespace zkd::bench {

/// An Embree build with the memory it took, by Embree's own account.
class EmbreeContender : public Contender {
 public:
  struct Memory {
    std::uint64_t held = 0;
    std::uint64_t peak = 0;
  };

  /// Nearest hit of each ray, one ray at a time, as trace() does for all kinds but shadow rays.
  virtual void closest_hit(std::span<const Ray> rays, std::span<Hit> hits) = 0;

  /// Of the last build().
  [[nodiscard]] virtual Memory memory() const = 0;
};

/// Embree LOW, MEDIUM, HIGH, each plain and ROBUST, on this many threads. Copies the mesh once for
/// all of them (Embree reads past the last vertex), so building starts from raw arrays.
///
/// Throws UsageError where this program was built without Embree, and Error backend_unavailable
/// when Embree does not start.
[[nodiscard]] std::vector<std::unique_ptr<EmbreeContender>> embree_contenders(
    const scene::Mesh& mesh, int threads);

}  // namespace zkd::bench
