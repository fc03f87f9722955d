// SPDX-License-Identifier: Apache-2.0
//
// Triangles put side by side, for vector instructions.
#pragma once

#include <cstdint>
#include <limits>

#include <zkd/cpu/wide_tree.hpp>
#include <zkd/geometry.hpp>

namespace zkd::cpu {

/// Fills a block with `count` triangles, at most eight: id(lane) is that of each.
template <class Id>
inline void fill(TriangleBlock& block, const TriangleView& triangles, std::uint32_t count, Id id) {
  for (std::uint32_t lane = 0; lane < static_cast<std::uint32_t>(wide); ++lane) {
    const bool used = lane < count;
    block.ids[lane] = used ? id(lane) : TriangleBlock::unused;
    for (int corner = 0; corner < 3; ++corner) {
      const float* p =
          used ? triangles.position(triangles.index(block.ids[lane], corner)) : nullptr;
      for (int a = 0; a < 3; ++a)
        block.positions[corner][a][lane] = used ? p[a] : std::numeric_limits<float>::quiet_NaN();
    }
  }
}

}  // namespace zkd::cpu
