// SPDX-License-Identifier: Apache-2.0
//
// Builds a tree over a rippled sheet, traces a picture of it on all threads, and prints the picture
// as text together with what the build reports about itself.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <zkd/zkd.hpp>

namespace {

struct Mesh {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;
};

// Height of a sheet over [-1, 1] x [-1, 1]: rings round the middle.
Mesh rippled_sheet(std::uint32_t cells) {
  Mesh mesh;
  for (std::uint32_t row = 0; row <= cells; ++row) {
    for (std::uint32_t column = 0; column <= cells; ++column) {
      const float x = 2.0F * static_cast<float>(column) / static_cast<float>(cells) - 1.0F;
      const float z = 2.0F * static_cast<float>(row) / static_cast<float>(cells) - 1.0F;
      const float from_middle = std::sqrt(x * x + z * z);
      mesh.vertices.emplace_back(x, 0.15F * std::cos(12.0F * from_middle), z);
    }
  }
  for (std::uint32_t row = 0; row < cells; ++row) {
    for (std::uint32_t column = 0; column < cells; ++column) {
      const std::uint32_t corner = row * (cells + 1) + column;
      mesh.faces.emplace_back(corner, corner + cells + 1, corner + 1);
      mesh.faces.emplace_back(corner + 1, corner + cells + 1, corner + cells + 2);
    }
  }
  return mesh;
}

// Parallel rays that look down on the sheet at a slant, one for each character.
std::vector<zkd::Ray> camera_rays(int width, int height) {
  std::vector<zkd::Ray> rays;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float across = 2.4F * (static_cast<float>(x) + 0.5F) / static_cast<float>(width) - 1.2F;
      const float up = 0.9F - 1.8F * (static_cast<float>(y) + 0.5F) / static_cast<float>(height);
      rays.push_back({.origin = {across, 3.0F + up, 3.0F}, .direction = {0.0F, -1.0F, -1.0F}});
    }
  }
  return rays;
}

// Brightness of a triangle lit from the left.
float brightness(const Mesh& mesh, std::uint32_t triangle) {
  const glm::uvec3 face = mesh.faces[triangle];
  const glm::vec3 a = mesh.vertices[face.x];
  const glm::vec3 p = mesh.vertices[face.y] - a;
  const glm::vec3 q = mesh.vertices[face.z] - a;
  const glm::vec3 normal(p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x);
  const float length = std::sqrt(normal.x * normal.x + normal.y * normal.y + normal.z * normal.z);
  return std::max(0.0F, (0.6F * normal.y - 0.8F * normal.x) / length);
}

}  // namespace

int main() try {
  const Mesh mesh = rippled_sheet(200);
  const zkd::TriangleView triangles{mesh.vertices, mesh.faces};

  const zkd::cpu::Executor cpu;  // all threads, default memory
  const zkd::Tree tree = zkd::build(cpu, triangles, {.measure_quality = true});

  constexpr int width = 72;
  constexpr int height = 28;
  const std::vector<zkd::Ray> rays = camera_rays(width, height);
  std::vector<zkd::Hit> hits(rays.size());
  zkd::closest_hit(cpu, tree.view(), triangles, rays, hits);

  constexpr char shades[] = ".:-=+*#%@";
  for (std::size_t i = 0; i < hits.size(); ++i) {
    char pixel = ' ';
    if (hits[i].triangle != zkd::no_triangle) {
      constexpr int darkest = static_cast<int>(sizeof(shades)) - 2;
      pixel = shades[static_cast<int>(brightness(mesh, hits[i].triangle) * darkest)];
    }
    std::putchar(pixel);
    if ((i + 1) % width == 0) std::putchar('\n');
  }

  const zkd::Statistics& statistics = tree.statistics();
  std::printf("%llu triangles, %llu nodes, %llu leaves, depth %u, SAH cost %.1f, %.2f ms\n",
              static_cast<unsigned long long>(statistics.triangles),
              static_cast<unsigned long long>(statistics.nodes),
              static_cast<unsigned long long>(statistics.leaves), statistics.depth,
              statistics.sah_cost, statistics.total_ms);
  for (std::size_t stage = 0; stage < statistics.stage_ms.size(); ++stage) {
    std::printf("  %-16s %8.3f ms\n", zkd::to_string(static_cast<zkd::Stage>(stage)),
                statistics.stage_ms[stage]);
  }
  return 0;
} catch (const zkd::Error& error) {
  std::fprintf(stderr, "%s: %s\n", zkd::to_string(error.code()), error.what());
  return 1;
}
