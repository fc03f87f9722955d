// SPDX-License-Identifier: Apache-2.0
//
// Random numbers that are the same everywhere: integers only, no libm, no std distributions.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <glm/ext/vector_float3.hpp>

namespace zkd::scene {

/// SplitMix64 (Steele, Lea, Flood: Fast Splittable Pseudorandom Number Generators, OOPSLA 2014).
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) noexcept : state_(seed) {}

  constexpr std::uint64_t bits64() noexcept {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }

  constexpr std::uint32_t bits32() noexcept { return static_cast<std::uint32_t>(bits64() >> 32); }

  /// An integer in [0, bound); bound > 0. Off from even by less than bound / 2^32.
  constexpr std::uint32_t below(std::uint32_t bound) noexcept {
    return static_cast<std::uint32_t>((std::uint64_t{bits32()} * bound) >> 32);
  }

  /// A multiple of 2^-24 in [0, 1).
  constexpr float unit() noexcept { return static_cast<float>(bits64() >> 40) * 0x1p-24F; }

  /// lo + unit() * (hi - lo), each operation rounded to float.
  constexpr float between(float lo, float hi) noexcept {
    const float part = unit() * (hi - lo);
    return lo + part;
  }

  /// Three of between(), x first.
  glm::vec3 point(float lo = 0.0F, float hi = 1.0F) noexcept {
    const float x = between(lo, hi);
    const float y = between(lo, hi);
    const float z = between(lo, hi);
    return {x, y, z};
  }

  /// lo .. hi, both included.
  int integer(int lo, int hi) noexcept {
    return lo + static_cast<int>(below(static_cast<std::uint32_t>(hi - lo + 1)));
  }

  bool one_in(std::uint32_t count) noexcept { return below(count) == 0; }

  /// A multiple of 2^-23 in [-1, 1).
  float signed_unit() noexcept { return 2.0F * unit() - 1.0F; }

  glm::vec3 in_cube() noexcept { return point(-1.0F, 1.0F); }

  /// Any finite float, all bit patterns alike: denormals, both zeros, both signs, 1e38.
  float any_finite() noexcept {
    for (;;) {
      const auto x = std::bit_cast<float>(bits32());
      if (std::isfinite(x)) return x;
    }
  }

 private:
  std::uint64_t state_;
};

/// The float `steps` representable values above (below, if negative) x, both zeros being one;
/// infinity where there are no more. x must not be NaN.
[[nodiscard]] inline float ulps(float x, int steps) noexcept {
  constexpr std::int64_t infinite = 0x7F800000;
  const auto bits = std::bit_cast<std::int32_t>(x);
  const std::int64_t order = bits >= 0 ? bits : -std::int64_t{bits & 0x7FFFFFFF};
  const std::int64_t moved = std::clamp(order + steps, -infinite, infinite);
  const auto magnitude = static_cast<std::uint32_t>(moved >= 0 ? moved : -moved);
  return std::bit_cast<float>(magnitude | (moved < 0 ? 0x80000000u : 0u));
}

}  // namespace zkd::scene
