// SPDX-License-Identifier: Apache-2.0
//
// What goes into a build and a query: triangles, boxes, rays, hits. All are plain values or
// non-owning views that may be passed to a kernel by value.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#if defined(__NVCC__)  // glm puts host and device markers on defaulted functions
#pragma nv_diagnostic push
#pragma nv_diag_suppress 20012
#endif
#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>
#if defined(__NVCC__)
#pragma nv_diagnostic pop
#endif

#include <zkd/config.hpp>

namespace zkd {

static_assert(sizeof(glm::vec3) == 3 * sizeof(float), "positions are three packed floats");
static_assert(sizeof(glm::uvec3) == 3 * sizeof(std::uint32_t), "faces are three packed indices");

/// Names no triangle: the id of a miss.
inline constexpr std::uint32_t no_triangle = 0xFFFFFFFFu;

/// The most triangles one tree takes, and the most references it holds: 2^31 - 1.
inline constexpr std::uint64_t max_count = 0x7FFFFFFFu;

/// The most triangles without indices: 32 bits count their positions.
inline constexpr std::uint64_t max_soup_count = 0xFFFFFFFFu / 3;

/// A non-owning view of triangles: positions in any unit, and three indices a triangle or none.
///
/// The arrays must outlive every build and query that is given the view, and must not change
/// between a build and the queries on its tree. Positions are three floats each, `position_stride`
/// bytes apart (a multiple of 4, at least 12; data aligned to 4). Triangle i has the indices 3i,
/// 3i+1, 3i+2, each below `position_count`. Without indices the view is a soup: triangle i has the
/// positions 3i, 3i+1, 3i+2.
struct TriangleView {
  const float* positions = nullptr;
  std::size_t position_count = 0;
  std::size_t position_stride = sizeof(glm::vec3);  ///< bytes from one position to the next
  const std::uint32_t* indices = nullptr;           ///< 3 * triangle_count; null: soup
  std::size_t triangle_count = 0;

  TriangleView() = default;

  /// Indexed triangles, packed positions.
  TriangleView(std::span<const glm::vec3> vertices, std::span<const glm::uvec3> faces)
      : positions(reinterpret_cast<const float*>(vertices.data())),
        position_count(vertices.size()),
        indices(reinterpret_cast<const std::uint32_t*>(faces.data())),
        triangle_count(faces.size()) {
    if (faces.empty()) indices = nullptr;
  }

  /// A soup: every three positions are a triangle, at most max_soup_count of them. A remainder of
  /// one or two is an error that `build` reports (ErrorCode::invalid_view); fewer than three
  /// positions are an empty view.
  explicit TriangleView(std::span<const glm::vec3> corners)
      : positions(reinterpret_cast<const float*>(corners.data())),
        position_count(corners.size()),
        triangle_count(corners.size() / 3) {}

  /// Indexed triangles whose positions lie inside larger vertices, `stride` bytes apart.
  static TriangleView strided(const float* first_position, std::size_t count, std::size_t stride,
                              std::span<const glm::uvec3> faces) {
    TriangleView view;
    view.positions = first_position;
    view.position_count = count;
    view.position_stride = stride;
    view.indices = faces.empty() ? nullptr : reinterpret_cast<const std::uint32_t*>(faces.data());
    view.triangle_count = faces.size();
    return view;
  }

  /// Index of corner `corner` (0, 1, 2) of triangle `triangle`. No check.
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t index(std::size_t triangle, int corner) const {
    const std::size_t at = 3 * triangle + static_cast<std::size_t>(corner);
    return indices != nullptr ? indices[at] : static_cast<std::uint32_t>(at);
  }

  /// The three floats of position `vertex`. No check.
  [[nodiscard]] ZKD_HOST_DEVICE const float* position(std::size_t vertex) const {
    return reinterpret_cast<const float*>(reinterpret_cast<const char*>(positions) +
                                          vertex * position_stride);
  }
};

/// An axis-aligned box, closed: its sides belong to it. Empty when `lo > hi` on some axis.
struct Box {
  float lo[3] = {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
                 std::numeric_limits<float>::infinity()};
  float hi[3] = {-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                 -std::numeric_limits<float>::infinity()};

  [[nodiscard]] ZKD_HOST_DEVICE bool empty() const {
    return !(lo[0] <= hi[0] && lo[1] <= hi[1] && lo[2] <= hi[2]);
  }
};

/// The points origin + t * direction, t in [t_min, t_max].
///
/// The direction may have any length; t is in units of that length. A ray with a NaN anywhere, an
/// infinite origin or direction, a zero direction, or t_min > t_max is a miss, at once. t_max (and
/// t_min) may be infinite; a hit whose t is too large for a float is none.
struct Ray {
  glm::vec3 origin{0.0F};
  float t_min = 0.0F;
  glm::vec3 direction{0.0F, 0.0F, 1.0F};
  float t_max = std::numeric_limits<float>::infinity();
};

/// Where a ray meets a triangle (a, b, c): at origin + t * direction, which is
/// (1 - u - v) * a + u * b + v * c.
struct Hit {
  float t = std::numeric_limits<float>::infinity();
  float u = 0.0F;
  float v = 0.0F;
  std::uint32_t triangle = no_triangle;  ///< index into the TriangleView; no_triangle: a miss
};

}  // namespace zkd
