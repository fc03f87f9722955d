// SPDX-License-Identifier: Apache-2.0
//
// The colours of heat maps.
#include "scene/image.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace zkd::scene {
namespace {

float to_linear(float srgb) {
  return srgb <= 0.04045F ? srgb / 12.92F : std::pow((srgb + 0.055F) / 1.055F, 2.4F);
}

}  // namespace

glm::vec3 heat(float x) {
  // sRGB, evenly spaced; chosen so that lightness (CIE L*) rises by nearly the same from each to
  // the next while the hue goes from violet over red to yellow.
  constexpr std::array<std::array<float, 3>, 7> stops{{
      {0.010F, 0.010F, 0.020F},
      {0.220F, 0.060F, 0.360F},
      {0.480F, 0.110F, 0.460F},
      {0.760F, 0.200F, 0.400F},
      {0.940F, 0.400F, 0.300F},
      {0.995F, 0.680F, 0.380F},
      {0.990F, 0.970F, 0.720F},
  }};
  const float at = (x > 0.0F ? std::min(x, 1.0F) : 0.0F) * static_cast<float>(stops.size() - 1);
  const std::size_t below = std::min(static_cast<std::size_t>(at), stops.size() - 2);
  const float part = at - static_cast<float>(below);
  glm::vec3 colour;
  for (std::size_t c = 0; c < 3; ++c) {
    const float srgb = stops[below][c] + part * (stops[below + 1][c] - stops[below][c]);
    colour[static_cast<int>(c)] = to_linear(srgb);
  }
  return colour;
}

}  // namespace zkd::scene
