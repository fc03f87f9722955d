// SPDX-License-Identifier: Apache-2.0
//
// A mesh whose every triangle is valid and known by its number, to be spoilt.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include <zkd/geometry.hpp>

namespace zkd::test {

/// A strip of `count` triangles.
struct Strip {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;

  explicit Strip(std::uint32_t count) {
    for (std::uint32_t i = 0; i < count + 2; ++i) {
      vertices.emplace_back(static_cast<float>(i / 2), static_cast<float>(i % 2), 0.0F);
    }
    for (std::uint32_t i = 0; i < count; ++i) faces.emplace_back(i, i + 1, i + 2);
  }
  [[nodiscard]] TriangleView view() const { return {vertices, faces}; }
};

}  // namespace zkd::test
