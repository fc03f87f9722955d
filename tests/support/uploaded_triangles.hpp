// SPDX-License-Identifier: Apache-2.0
//
// Triangles in the memory of a platform whose memory is not the host's. See support/platform.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <zkd/geometry.hpp>

namespace zkd::test {

/// The arrays of a view, copied, and the view of the copies.
template <template <class> class Array>
class UploadedTriangles {
 public:
  explicit UploadedTriangles(const TriangleView& host)
      : positions_(positions_of(host)), indices_(indices_of(host)), view_(host) {
    view_.positions = reinterpret_cast<const float*>(positions_.data());
    view_.indices = indices_.data();
  }
  operator const TriangleView&() const { return view_; }

 private:
  static std::span<const std::byte> positions_of(const TriangleView& view) {
    if (view.position_count == 0) return {};
    // The last position need not be followed by a whole stride.
    return {reinterpret_cast<const std::byte*>(view.positions),
            (view.position_count - 1) * view.position_stride + sizeof(glm::vec3)};
  }
  static std::span<const std::uint32_t> indices_of(const TriangleView& view) {
    if (view.indices == nullptr) return {};
    return {view.indices, 3 * view.triangle_count};
  }

  Array<std::byte> positions_;
  Array<std::uint32_t> indices_;
  TriangleView view_;
};

}  // namespace zkd::test
