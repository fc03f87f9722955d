// SPDX-License-Identifier: Apache-2.0
//
// The dice of the tests: those of the generators, and a few throws more. Integers only, so that
// every machine and standard library throws the same.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <glm/ext/vector_float3.hpp>

#include "scene/random.hpp"

namespace zkd::test {

class Random : public scene::Random {
 public:
  using scene::Random::Random;

  /// lo .. hi, both included.
  int integer(int lo, int hi) {
    return lo + static_cast<int>(below(static_cast<std::uint32_t>(hi - lo + 1)));
  }

  bool one_in(std::uint32_t count) { return below(count) == 0; }

  /// A multiple of 2^-23 in [-1, 1).
  float signed_unit() { return 2.0F * unit() - 1.0F; }

  glm::vec3 in_cube() { return point(-1.0F, 1.0F); }

  /// Any finite float, all bit patterns alike: denormals, both zeros, both signs, 1e38.
  float any_finite() {
    for (;;) {
      const float x = std::bit_cast<float>(bits32());
      if (std::isfinite(x)) return x;
    }
  }
};

/// The float `steps` representable values above (below, if negative) x.
inline float ulps(float x, int steps) {
  const float towards =
      steps < 0 ? -std::numeric_limits<float>::infinity() : std::numeric_limits<float>::infinity();
  for (int i = steps < 0 ? -steps : steps; i > 0; --i) x = std::nextafter(x, towards);
  return x;
}

}  // namespace zkd::test
