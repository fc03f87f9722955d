// SPDX-License-Identifier: Apache-2.0
//
// Tree space: the scene brought near scale 1 by a power of two (TreeView::scale).
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>

namespace zkd::core {

/// log2 of TreeView::scale for a scene inside `bounds`.
ZKD_HOST_DEVICE inline int scale_exponent(const Box& bounds) {
  if (bounds.empty()) return 0;
  double largest = 0.0;
  for (int a = 0; a < 3; ++a) {
    largest = larger(largest, static_cast<double>(magnitude(bounds.lo[a])));
    largest = larger(largest, static_cast<double>(magnitude(bounds.hi[a])));
  }
  if (largest == 0.0) return 0;
  const int exponent = exponent_of(largest);
  if (exponent >= -16 && exponent < 32) return 0;
  // 2^-126 and 2^127 are the smallest and largest powers of two that are normal floats.
  return smaller(larger(-exponent, -126), 127);
}

/// Exponent of the smallest cell whose planes are floats in tree space too.
ZKD_HOST_DEVICE inline std::int32_t finest_cell(int scale_exponent) {
  return scale_exponent < 0 ? -149 - scale_exponent : -149;
}

/// The scene as queries and later stages see it: in tree space (TreeView::scale).
struct SceneFrame {
  Box bounds;
  double scale = 1.0;
  double largest = 0.0;        ///< magnitude of any coordinate
  std::int32_t exponent = 0;   ///< log2 of scale
  std::int32_t finest = -149;  ///< see finest_cell

  SceneFrame() = default;
  ZKD_HOST_DEVICE explicit SceneFrame(const Box& scene) : exponent(scale_exponent(scene)) {
    scale = power_of_two(exponent);
    finest = finest_cell(exponent);
    for (int a = 0; a < 3; ++a) {
      bounds.lo[a] = scene.lo[a] * static_cast<float>(scale) + 0.0F;
      bounds.hi[a] = scene.hi[a] * static_cast<float>(scale) + 0.0F;
      largest = larger(largest, static_cast<double>(magnitude(bounds.lo[a])));
      largest = larger(largest, static_cast<double>(magnitude(bounds.hi[a])));
    }
  }
};

}  // namespace zkd::core
