// SPDX-License-Identifier: Apache-2.0
//
// Surfaces of boxes, which say how many random lines meet them.
#pragma once

#include <zkd/config.hpp>
#include <zkd/geometry.hpp>

namespace zkd::core {

/// Half of a box's surface, in double; of an empty box it means nothing.
ZKD_HOST_DEVICE inline double half_area(const Box& box) {
  double side[3];
  for (int a = 0; a < 3; ++a)
    side[a] = static_cast<double>(box.hi[a]) - static_cast<double>(box.lo[a]);
  return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

}  // namespace zkd::core
