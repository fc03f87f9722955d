// SPDX-License-Identifier: Apache-2.0
//
// Doubles to floats outwards, so that boxes hold what they are made for.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>

namespace zkd::core::sah {

/// The smallest float that is not below x. Never -0; |x| must be that of a float.
ZKD_HOST_DEVICE inline float float_above(double x) {
  const float nearest = static_cast<float>(x) + 0.0F;
  if (static_cast<double>(nearest) >= x) return nearest;
  const std::uint32_t bits = bits_of(nearest);
  return float_of(nearest >= 0.0F ? bits + 1 : bits - 1) + 0.0F;
}

/// The largest float that is not above x; likewise.
ZKD_HOST_DEVICE inline float float_below(double x) { return -float_above(-x) + 0.0F; }

/// A box of the caller's units in tree space, where scaling may underflow.
ZKD_HOST_DEVICE inline Box in_tree_space(const Box& box, double scale) {
  Box scaled;
  for (int a = 0; a < 3; ++a) {
    scaled.lo[a] = float_below(static_cast<double>(box.lo[a]) * scale);
    scaled.hi[a] = float_above(static_cast<double>(box.hi[a]) * scale);
  }
  return scaled;
}

}  // namespace zkd::core::sah
