// SPDX-License-Identifier: Apache-2.0
//
// What the references of a strict tree list while it is being made: two stores, and numbers into
// them, so that what is not changed when crowded leaves are split need not be moved either.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>

namespace zkd::core {

/// In a reference's number: it was found when crowded leaves were split.
inline constexpr std::uint32_t found_again = 0x80000000u;
static_assert(max_count < found_again);

/// What references list, by their numbers: what was found by walks of triangles, and, numbered by
/// itself, what was found by those of crowded leaves' references.
struct ListedParts {
  const std::uint32_t* ids;  ///< of triangles
  const Box* inside;         ///< what lies in the leaf's cell, in tree space
  const std::uint32_t* ids_again;
  const Box* inside_again;

  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t id(std::uint32_t number) const {
    return number < found_again ? ids[number] : ids_again[number - found_again];
  }
  [[nodiscard]] ZKD_HOST_DEVICE const Box& box(std::uint32_t number) const {
    return number < found_again ? inside[number] : inside_again[number - found_again];
  }
};

/// to[i]: the triangle of reference i
struct GatherIds {
  ListedParts listed;
  const std::uint32_t* numbers;
  std::uint32_t* to;
  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const { to[i] = listed.id(numbers[i]); }
};

}  // namespace zkd::core
