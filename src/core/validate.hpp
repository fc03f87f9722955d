// SPDX-License-Identifier: Apache-2.0
//
// Stage 1, validation: which triangles go into the tree, their boxes, and the box of the scene.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>

#include "core/triangle_lanes.hpp"

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

/// One triangle: writes its box (empty if left out) and adds to a report. Calls look(lanes) if it
/// is valid.
struct ValidateTriangle {
  TriangleView triangles;
  Box* boxes;

  ZKD_HOST_DEVICE void operator()(std::uint32_t triangle, ValidationReport& report) const {
    (*this)(triangle, report, [](const TriangleLanes&) {});
  }
  template <class Look>
  ZKD_HOST_DEVICE void operator()(std::uint32_t triangle, ValidationReport& report,
                                  Look look) const {
    Box& box = boxes[triangle];
    bool in_range = true;
    if (triangles.indices != nullptr)
      for (int corner = 0; corner < 3; ++corner)
        in_range = in_range && triangles.index(triangle, corner) < triangles.position_count;
    if (!in_range) {
      report.first_out_of_range = smaller(report.first_out_of_range, triangle);
      box = Box{};
      return;
    }
    const Corners corners = corners_of(triangles, triangle);
    const TriangleLanes lanes(corners);
    const Fault fault = lanes.is_surely_valid() ? Fault::none : fault_of(corners);
    if (fault == Fault::none) {
      ++report.valid;
      lanes.write_box(box);
      include(report.bounds, box);
      look(lanes);
      return;
    }
    box = Box{};
    if (fault == Fault::zero_area) {
      ++report.zero_area;
    } else {
      ++report.non_finite;
      report.first_non_finite = smaller(report.first_non_finite, triangle);
    }
  }

 private:
  enum class Fault : std::uint8_t { none, non_finite, zero_area };

  /// For the few triangles whose area is not certain: out of the way of the others.
  [[gnu::noinline]] static ZKD_HOST_DEVICE Fault fault_of(const Corners& corners) {
    if (!all_finite(corners)) return Fault::non_finite;
    return has_zero_area_exactly(corners) ? Fault::zero_area : Fault::none;
  }
};

/// Boxes that are already made: only their union, and how many are not empty, for those who call a
/// later stage by itself.
struct IncludeBox {
  const Box* boxes;
  ZKD_HOST_DEVICE void operator()(std::uint32_t triangle, ValidationReport& report) const {
    include(report.bounds, boxes[triangle]);
    if (!boxes[triangle].empty()) ++report.valid;
  }
};

/// A triangle goes into the tree if its box was written as not empty.
struct IsListed {
  const Box* boxes;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t triangle) const { return !boxes[triangle].empty(); }
};

}  // namespace zkd::core
