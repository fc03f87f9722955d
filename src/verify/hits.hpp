// SPDX-License-Identifier: Apache-2.0
//
// Hits compared bit by bit, and rays printed so that they can be shot again.
#pragma once

#include <bit>
#include <cstdint>
#include <cstdio>
#include <string>

#include <zkd/geometry.hpp>

namespace zkd::verify {

inline bool same_bits(const Hit& a, const Hit& b) {
  return std::bit_cast<std::uint32_t>(a.t) == std::bit_cast<std::uint32_t>(b.t) &&
         std::bit_cast<std::uint32_t>(a.u) == std::bit_cast<std::uint32_t>(b.u) &&
         std::bit_cast<std::uint32_t>(a.v) == std::bit_cast<std::uint32_t>(b.v) &&
         a.triangle == b.triangle;
}

inline bool is_hit(const Hit& hit) { return hit.triangle != no_triangle; }

inline std::string print(const Hit& hit) {
  char text[128];
  std::snprintf(text, sizeof text, "{triangle %u, t %a, u %a, v %a}", hit.triangle,
                static_cast<double>(hit.t), static_cast<double>(hit.u), static_cast<double>(hit.v));
  return text;
}

inline std::string print(const Ray& ray) {
  char text[256];
  const auto d = [](float x) { return static_cast<double>(x); };
  std::snprintf(text, sizeof text, "{{%aF, %aF, %aF}, %aF, {%aF, %aF, %aF}, %aF}", d(ray.origin.x),
                d(ray.origin.y), d(ray.origin.z), d(ray.t_min), d(ray.direction.x),
                d(ray.direction.y), d(ray.direction.z), d(ray.t_max));
  return text;
}

}  // namespace zkd::verify
