// SPDX-License-Identifier: Apache-2.0
//
// Stage 1, validation: which triangles go into the tree, their boxes, and the box of the scene.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>

namespace zkd::core {

inline constexpr std::uint32_t none_found = 0xFFFFFFFFu;

/// What validation found, over some triangles; the scene's is the combination of all.
struct ValidationReport {
  Box bounds;
  std::uint32_t valid = 0;
  std::uint32_t zero_area = 0;
  std::uint32_t non_finite = 0;
  std::uint32_t first_out_of_range = none_found;
  std::uint32_t first_non_finite = none_found;

  ZKD_HOST_DEVICE void combine(const ValidationReport& other) {
    include(bounds, other.bounds);
    valid += other.valid;
    zero_area += other.zero_area;
    non_finite += other.non_finite;
    first_out_of_range = smaller(first_out_of_range, other.first_out_of_range);
    first_non_finite = smaller(first_non_finite, other.first_non_finite);
  }
};

/// One triangle: writes its box (empty if left out) and adds to a report.
struct ValidateTriangle {
  TriangleView triangles;
  Box* boxes;

  ZKD_HOST_DEVICE void operator()(std::uint32_t triangle, ValidationReport& report) const {
    Box box;
    bool in_range = true;
    if (triangles.indices != nullptr)
      for (int corner = 0; corner < 3; ++corner)
        in_range = in_range && triangles.index(triangle, corner) < triangles.position_count;
    if (!in_range) {
      report.first_out_of_range = smaller(report.first_out_of_range, triangle);
    } else {
      const Corners c = corners_of(triangles, triangle);
      if (!all_finite(c)) {
        ++report.non_finite;
        report.first_non_finite = smaller(report.first_non_finite, triangle);
      } else if (has_zero_area(c)) {
        ++report.zero_area;
      } else {
        ++report.valid;
        for (int a = 0; a < 3; ++a) {
          // Adding +0 turns -0 into +0, so that equal coordinates have equal bits.
          const float x = c.p[0][a] + 0.0F;
          const float y = c.p[1][a] + 0.0F;
          const float z = c.p[2][a] + 0.0F;
          box.lo[a] = smaller(x, smaller(y, z));
          box.hi[a] = larger(x, larger(y, z));
        }
        include(report.bounds, box);
      }
    }
    boxes[triangle] = box;
  }
};

/// Boxes that are already made: only their union, for those who call a later stage by itself.
struct IncludeBox {
  const Box* boxes;
  ZKD_HOST_DEVICE void operator()(std::uint32_t triangle, ValidationReport& report) const {
    include(report.bounds, boxes[triangle]);
  }
};

/// A triangle goes into the tree if its box was written as not empty.
struct IsListed {
  const Box* boxes;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t triangle) const { return !boxes[triangle].empty(); }
};

}  // namespace zkd::core
