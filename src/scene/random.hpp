// SPDX-License-Identifier: Apache-2.0
//
// Random numbers that are the same everywhere: integers only, no libm, no std distributions.
#pragma once

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

 private:
  std::uint64_t state_;
};

}  // namespace zkd::scene
