// SPDX-License-Identifier: Apache-2.0
//
// Edges sorted, and met in pairs.
#include "scene/closed.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

namespace zkd::scene {

bool is_closed(const scene::Mesh& mesh) {
  std::vector<std::tuple<std::uint32_t, std::uint32_t, bool>> edges;
  edges.reserve(3 * mesh.faces.size());
  for (const glm::uvec3& face : mesh.faces) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t from = face[corner];
      const std::uint32_t to = face[(corner + 1) % 3];
      if (from == to) return false;
      edges.emplace_back(std::min(from, to), std::max(from, to), from < to);
    }
  }
  if (edges.empty() || edges.size() % 2 != 0) return false;
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    const auto& [low, high, forward] = edges[i];
    const auto& [next_low, next_high, next_forward] = edges[i + 1];
    if (low != next_low || high != next_high || forward == next_forward) return false;
    const bool third = i + 2 < edges.size() && std::get<0>(edges[i + 2]) == low &&
                       std::get<1>(edges[i + 2]) == high;
    if (third) return false;
  }
  return true;
}

}  // namespace zkd::scene
