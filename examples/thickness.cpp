// SPDX-License-Identifier: Apache-2.0
//
// How much of a solid each ray goes through: an X-ray of two spheres, one inside the other, from
// all hits of each ray in order.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <zkd/zkd.hpp>

namespace {

// Adds a closed sphere round the origin: rings from pole to pole.
void add_sphere(float radius, std::vector<glm::vec3>& vertices, std::vector<glm::uvec3>& faces) {
  constexpr std::uint32_t rings = 24;
  constexpr std::uint32_t sides = 48;
  constexpr float pi = 3.14159265F;
  const auto first = static_cast<std::uint32_t>(vertices.size());
  for (std::uint32_t ring = 1; ring < rings; ++ring) {
    for (std::uint32_t side = 0; side < sides; ++side) {
      const float up = pi * static_cast<float>(ring) / static_cast<float>(rings);
      const float round = 2.0F * pi * static_cast<float>(side) / static_cast<float>(sides);
      vertices.emplace_back(radius * std::sin(up) * std::cos(round), radius * std::cos(up),
                            radius * std::sin(up) * std::sin(round));
    }
  }
  const auto north = static_cast<std::uint32_t>(vertices.size());
  vertices.emplace_back(0.0F, radius, 0.0F);
  vertices.emplace_back(0.0F, -radius, 0.0F);
  for (std::uint32_t side = 0; side < sides; ++side) {
    const std::uint32_t next = (side + 1) % sides;
    const std::uint32_t last = first + (rings - 2) * sides;
    faces.emplace_back(north, first + next, first + side);
    faces.emplace_back(north + 1, last + side, last + next);
    for (std::uint32_t ring = 0; ring + 2 < rings; ++ring) {
      const std::uint32_t row = first + ring * sides;
      faces.emplace_back(row + side, row + next, row + sides + side);
      faces.emplace_back(row + next, row + sides + next, row + sides + side);
    }
  }
}

}  // namespace

int main() try {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;
  add_sphere(1.0F, vertices, faces);
  add_sphere(0.6F, vertices, faces);  // a hollow
  const zkd::TriangleView triangles{vertices, faces};
  const zkd::Tree tree = zkd::build(triangles);

  // Parallel rays, a character each, that keep off the vertices' rows and columns: a ray through an
  // edge would hit both triangles there, and cross the surface once.
  constexpr int width = 64;
  constexpr int height = 30;
  std::vector<zkd::Ray> rays;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      rays.push_back({.origin = {2.2F * (static_cast<float>(x) + 0.513F) / width - 1.1F,
                                 1.1F - 2.2F * (static_cast<float>(y) + 0.471F) / height, -2.0F},
                      .direction = {0.0F, 0.0F, 1.0F}});
    }
  }

  // In at one hit, out at the next.
  std::vector<float> thickness(rays.size());
  std::vector<int> crossings(rays.size());
  zkd::for_each_hit(zkd::cpu::Executor{}, tree.view(), triangles, rays,
                    [&](std::size_t ray, const zkd::Hit& hit) {
                      thickness[ray] += crossings[ray] % 2 == 0 ? -hit.t : hit.t;
                      ++crossings[ray];
                    });

  constexpr char shades[] = " .:-=+*#%@";
  constexpr float most = 1.6F;  // past the hollow's rim: sqrt(1 - 0.36) * 2
  bool closed = true;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    closed = closed && crossings[i] % 2 == 0;
    std::putchar(shades[std::clamp(static_cast<int>(thickness[i] / most * 9.0F + 0.5F), 0, 9)]);
    if ((i + 1) % width == 0) std::putchar('\n');
  }
  const std::size_t middle = rays.size() / 2 + width / 2;
  std::printf("%d hits and %.2f thick in the middle\n", crossings[middle],
              static_cast<double>(thickness[middle]));
  return closed && crossings[middle] == 4 ? 0 : 1;
} catch (const zkd::Error& error) {
  std::fprintf(stderr, "%s: %s\n", zkd::to_string(error.code()), error.what());
  return 1;
}
