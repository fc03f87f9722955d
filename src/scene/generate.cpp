// SPDX-License-Identifier: Apache-2.0
//
// Generated meshes and rays: no libm but the square root, one order of operations.
#include "scene/generate.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "scene/random.hpp"

namespace zkd::scene {
namespace {

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(what);
}

/// A triangle with vertices of its own.
void add(Mesh& mesh, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c});
  mesh.faces.emplace_back(first, first + 1, first + 2);
}

Mesh reserved(std::uint64_t triangles, std::uint64_t positions) {
  require(triangles <= max_count && positions <= max_count, "more triangles than 2147483647");
  Mesh mesh;
  mesh.positions.reserve(positions);
  mesh.faces.reserve(triangles);
  return mesh;
}

/// About n^(-1/3), by doubling: within a factor of two, which is all a size needs.
float spacing(std::uint32_t n) {
  float side = 1.0F;
  while (static_cast<double>(side) * side * side * n > 1.0) side *= 0.5F;
  return side;
}

/// A direction of length 1: a point of the ball, pushed outward.
glm::vec3 direction(Random& random) {
  while (true) {
    const glm::vec3 p = random.point(-1.0F, 1.0F);
    const float square = p.x * p.x + p.y * p.y + p.z * p.z;
    if (square > 1.0F || square < 0x1p-8F) continue;
    const float length = std::sqrt(square);
    return {p.x / length, p.y / length, p.z / length};
  }
}

glm::vec3 cross(const glm::vec3& a, const glm::vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A power of two as a product: exact, and not from libm.
double power_of_two(int exponent) {
  double result = 1.0;
  for (int i = 0; i < std::abs(exponent); ++i) result *= exponent > 0 ? 2.0 : 0.5;
  return result;
}

/// The unit cube for an empty box; otherwise the box grown to twice its size round its centre.
Box surroundings(const Box& box, bool grown) {
  Box result{{0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 1.0F}};
  if (!box.empty()) result = box;
  if (!grown) return result;
  float largest = 0.0F;
  for (int a = 0; a < 3; ++a) largest = std::max(largest, result.hi[a] - result.lo[a]);
  for (int a = 0; a < 3; ++a) {
    // A flat box is looked at from outside its plane too.
    const float margin = 0.5F * largest;
    result.lo[a] -= margin;
    result.hi[a] += margin;
  }
  return result;
}

glm::vec3 point_in(const Box& box, Random& random) {
  glm::vec3 p;
  for (int a = 0; a < 3; ++a) p[a] = random.between(box.lo[a], box.hi[a]);
  return p;
}

const glm::vec3& corner(const Mesh& mesh, Random& random) {
  const glm::uvec3& face = mesh.faces[random.below(static_cast<std::uint32_t>(mesh.faces.size()))];
  return mesh.positions[face[static_cast<int>(random.below(3))]];
}

}  // namespace

Mesh soup(std::uint32_t n, std::uint64_t seed) {
  Mesh mesh = reserved(n, 3 * std::uint64_t{n});
  Random random(seed);
  const float side = spacing(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    const glm::vec3 base = random.point(0.0F, 1.0F - side);
    std::array<glm::vec3, 3> corners;
    for (glm::vec3& c : corners) {
      const glm::vec3 d = random.point(0.0F, side);
      c = {base.x + d.x, base.y + d.y, base.z + d.z};
    }
    add(mesh, corners[0], corners[1], corners[2]);
  }
  return mesh;
}

Mesh grid(std::uint32_t n) {
  require(n <= 700, "grid: at most 700 cells a side");
  const std::uint64_t side = std::uint64_t{n} + 1;
  Mesh mesh = reserved(6 * side * n * n, side * side * side);
  const auto vertex = [side](std::uint64_t x, std::uint64_t y, std::uint64_t z) {
    return static_cast<std::uint32_t>((z * side + y) * side + x);
  };
  for (std::uint64_t z = 0; z < side; ++z) {
    for (std::uint64_t y = 0; y < side; ++y) {
      for (std::uint64_t x = 0; x < side; ++x) {
        mesh.positions.emplace_back(static_cast<float>(x) * 0.125F, static_cast<float>(y) * 0.125F,
                                    static_cast<float>(z) * 0.125F);
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (std::uint64_t wall = 0; wall < side; ++wall) {
      for (std::uint64_t u = 0; u < n; ++u) {
        for (std::uint64_t v = 0; v < n; ++v) {
          const auto at = [&](std::uint64_t du, std::uint64_t dv) {
            return axis == 0   ? vertex(wall, u + du, v + dv)
                   : axis == 1 ? vertex(u + du, wall, v + dv)
                               : vertex(u + du, v + dv, wall);
          };
          mesh.faces.emplace_back(at(0, 0), at(1, 0), at(1, 1));
          mesh.faces.emplace_back(at(0, 0), at(1, 1), at(0, 1));
        }
      }
    }
  }
  if (n == 0) mesh.positions.clear();
  return mesh;
}

Mesh sphere(std::uint32_t subdivisions) {
  require(subdivisions <= 12, "sphere: at most 12 subdivisions");
  const float g = 0.5F * (1.0F + std::sqrt(5.0F));  // the golden ratio
  const auto on_sphere = [](const glm::vec3& p) {
    const float length = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
    return glm::vec3(p.x / length, p.y / length, p.z / length);
  };
  Mesh mesh;
  for (const glm::vec3& p : {glm::vec3{-1, g, 0},
                             {1, g, 0},
                             {-1, -g, 0},
                             {1, -g, 0},
                             {0, -1, g},
                             {0, 1, g},
                             {0, -1, -g},
                             {0, 1, -g},
                             {g, 0, -1},
                             {g, 0, 1},
                             {-g, 0, -1},
                             {-g, 0, 1}}) {
    mesh.positions.push_back(on_sphere(p));
  }
  mesh.faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (std::uint32_t step = 0; step < subdivisions; ++step) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
      if (is_new) {
        const glm::vec3 p = mesh.positions[a];
        const glm::vec3 q = mesh.positions[b];
        mesh.positions.push_back(on_sphere({p.x + q.x, p.y + q.y, p.z + q.z}));
      }
      return entry->second;
    };
    std::vector<glm::uvec3> finer;
    finer.reserve(4 * mesh.faces.size());
    for (const glm::uvec3& f : mesh.faces) {
      const std::uint32_t ab = middle(f.x, f.y);
      const std::uint32_t bc = middle(f.y, f.z);
      const std::uint32_t ca = middle(f.z, f.x);
      finer.insert(finer.end(), {{f.x, ab, ca}, {f.y, bc, ab}, {f.z, ca, bc}, {ab, bc, ca}});
    }
    mesh.faces = std::move(finer);
  }
  return mesh;
}

Mesh slivers(std::uint32_t n, float aspect, std::uint64_t seed) {
  require(aspect >= 1.0F && std::isfinite(aspect), "slivers: the aspect must be at least 1");
  Mesh mesh = reserved(n, 3 * std::uint64_t{n});
  Random random(seed);
  for (std::uint32_t i = 0; i < n; ++i) {
    const float length = random.between(0.05F, 0.25F);
    const float width = length / aspect;
    const glm::vec3 along = direction(random);
    glm::vec3 across{0.0F};
    float square = 0.0F;
    while (square < 0x1p-6F) {
      across = cross(along, direction(random));
      square = across.x * across.x + across.y * across.y + across.z * across.z;
    }
    const float to_width = width / std::sqrt(square);
    const glm::vec3 a = random.point(0.25F, 0.75F);
    const glm::vec3 b{a.x + length * along.x, a.y + length * along.y, a.z + length * along.z};
    const glm::vec3 c{a.x + to_width * across.x, a.y + to_width * across.y,
                      a.z + to_width * across.z};
    add(mesh, a, b, c);
  }
  return mesh;
}

Mesh identical(std::uint32_t n) {
  Mesh mesh = reserved(n, 3);
  mesh.positions = {{0.25F, 0.25F, 0.5F}, {0.75F, 0.25F, 0.5F}, {0.5F, 0.75F, 0.625F}};
  mesh.faces.assign(n, glm::uvec3(0, 1, 2));
  return mesh;
}

Mesh same_centre(std::uint32_t n, std::uint64_t seed) {
  Mesh mesh = reserved(n, 3 * std::uint64_t{n});
  Random random(seed);
  for (std::uint32_t i = 0; i < n; ++i) {
    const float size = static_cast<float>(power_of_two(-static_cast<int>(random.below(11))));
    // Each axis has one corner at -h and one at +h, so the box's centre is exactly 0.
    std::array<glm::vec3, 3> c;
    for (int axis = 0; axis < 3; ++axis) {
      const float h = size * random.between(0.125F, 0.5F);
      const std::uint32_t low = random.below(3);
      const std::uint32_t high = (low + 1 + random.below(2)) % 3;
      c[low][axis] = -h;
      c[high][axis] = h;
      c[3 - low - high][axis] = random.between(-h, h);
    }
    add(mesh, c[0], c[1], c[2]);
  }
  return mesh;
}

Mesh flat(std::uint32_t n, int axis, std::uint64_t seed) {
  require(axis >= 0 && axis <= 2, "flat: the axis must be 0, 1 or 2");
  Mesh mesh = soup(n, seed);
  for (glm::vec3& p : mesh.positions) p[axis] = 0.5F;
  return mesh;
}

Mesh needles(std::uint32_t n, std::uint64_t seed) {
  Mesh mesh = reserved(n, 3 * std::uint64_t{n});
  Random random(seed);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t diagonal = random.below(4);
    glm::vec3 a = random.point(0.0F, 0.0625F);
    glm::vec3 b = random.point(0.9375F, 1.0F);
    if ((diagonal & 1u) != 0) std::swap(a.x, b.x);
    if ((diagonal & 2u) != 0) std::swap(a.y, b.y);
    const glm::vec3 d = random.point(-0x1p-10F, 0x1p-10F);
    add(mesh, a, b, {a.x + d.x, a.y + d.y, a.z + d.z});
  }
  return mesh;
}

Mesh small_in_large(std::uint32_t n, float ratio, std::uint64_t seed) {
  require(ratio >= 2.0F && std::isfinite(ratio), "small_in_large: the ratio must be at least 2");
  Mesh stadium;
  for (std::uint32_t i = 0; i < 8; ++i) {
    stadium.positions.emplace_back((i & 1u) != 0 ? ratio : 0.0F, (i & 2u) != 0 ? ratio : 0.0F,
                                   (i & 4u) != 0 ? ratio : 0.0F);
  }
  stadium.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  Random random(seed);
  const glm::vec3 place = random.point(0.0F, ratio - 1.0F);
  return joined(std::move(stadium), offset(soup(n, random.bits64()), place));
}

Mesh fan(std::uint32_t n) {
  require(n >= 3, "fan: at least 3 triangles");
  Mesh mesh = reserved(n, std::uint64_t{n} + 1);
  mesh.positions.emplace_back(0.0F, 0.0F, 0.5F);
  for (std::uint32_t i = 0; i < n; ++i) {
    // A quarter of the circle by its rational parametrisation, turned by quarters.
    const double turn = 4.0 * i / n;
    const int quarter = static_cast<int>(turn);
    const double t = turn - quarter;
    const double c = (1.0 - t * t) / (1.0 + t * t);
    const double s = 2.0 * t / (1.0 + t * t);
    const double x = quarter == 0 ? c : quarter == 1 ? -s : quarter == 2 ? -c : s;
    const double y = quarter == 0 ? s : quarter == 1 ? c : quarter == 2 ? -s : -c;
    mesh.positions.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.0F);
    mesh.faces.emplace_back(0, i + 1, i + 1 == n ? 1 : i + 2);
  }
  return mesh;
}

Mesh staircase(std::uint32_t levels) {
  require(levels <= 300, "staircase: at most 300 levels");
  Mesh mesh;
  const double finest = power_of_two(-static_cast<int>((levels + 2) / 3));
  for (std::uint32_t level = 0; level <= levels; ++level) {
    // Code bit `level` from the top alone is set: coordinate 2^-(level/3 + 1) on axis level % 3.
    // The last triangle has none, code 0.
    glm::vec3 p(0.0F);
    double place = 0.0;
    if (level < levels) {
      place = power_of_two(-static_cast<int>(level / 3 + 1));
      p[static_cast<int>(level % 3)] = static_cast<float>(place);
    }
    // Half a finest cell, or as small as float can tell from the place.
    const auto d = static_cast<float>(std::max(0.5 * finest, 0x1p-22 * place));
    add(mesh, p, {p.x + d, p.y, p.z}, {p.x, p.y + d, p.z + d});
  }
  return mesh;
}

Mesh random_bits(std::uint32_t n, std::uint64_t seed) {
  const std::uint32_t positions = n == 0 ? 0 : n / 2 + 3;
  Mesh mesh = reserved(n, positions);
  Random random(seed);
  for (std::uint32_t i = 0; i < positions; ++i) {
    const float x = std::bit_cast<float>(random.bits32());
    const float y = std::bit_cast<float>(random.bits32());
    const float z = std::bit_cast<float>(random.bits32());
    mesh.positions.emplace_back(x, y, z);
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t a = random.below(positions);
    const std::uint32_t b = random.below(positions);
    const std::uint32_t c = random.below(positions);
    mesh.faces.emplace_back(a, b, c);
  }
  return mesh;
}

Mesh offset(Mesh mesh, glm::vec3 by) {
  for (glm::vec3& p : mesh.positions) p = {p.x + by.x, p.y + by.y, p.z + by.z};
  return mesh;
}

Mesh scaled(Mesh mesh, int exponent) {
  require(exponent >= -400 && exponent <= 400, "scaled: the exponent must lie within -400 and 400");
  const double factor = power_of_two(exponent);
  for (glm::vec3& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) p[axis] = static_cast<float>(double{p[axis]} * factor);
  }
  return mesh;
}

Mesh shuffled(Mesh mesh, std::uint64_t seed, std::vector<std::uint32_t>* permutation) {
  const auto count = static_cast<std::uint32_t>(mesh.faces.size());
  std::vector<std::uint32_t> order(count);
  for (std::uint32_t i = 0; i < count; ++i) order[i] = i;
  Random random(seed);
  for (std::uint32_t i = count; i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  std::vector<glm::uvec3> faces;
  faces.reserve(count);
  for (const std::uint32_t from : order) faces.push_back(mesh.faces[from]);
  mesh.faces = std::move(faces);
  if (permutation != nullptr) *permutation = std::move(order);
  return mesh;
}

Mesh joined(Mesh first, const Mesh& second) {
  require(first.positions.size() + second.positions.size() <= max_count &&
              first.faces.size() + second.faces.size() <= max_count,
          "joined: more triangles than 2147483647");
  const auto base = static_cast<std::uint32_t>(first.positions.size());
  first.positions.insert(first.positions.end(), second.positions.begin(), second.positions.end());
  for (const glm::uvec3& f : second.faces) {
    first.faces.emplace_back(f.x + base, f.y + base, f.z + base);
  }
  return first;
}

std::vector<Ray> random_rays(const Box& box, std::uint32_t n, std::uint64_t seed) {
  const Box from = surroundings(box, true);
  const Box to = surroundings(box, false);
  Random random(seed);
  std::vector<Ray> rays(n);
  for (Ray& ray : rays) {
    ray.origin = point_in(from, random);
    const glm::vec3 target = point_in(to, random);
    ray.direction = {target.x - ray.origin.x, target.y - ray.origin.y, target.z - ray.origin.z};
  }
  return rays;
}

std::vector<Ray> rays_at_features(const Mesh& mesh, std::uint32_t n, std::uint64_t seed) {
  require(!mesh.faces.empty(), "rays_at_features: the mesh has no faces");
  const Box from = surroundings(bounds(mesh), true);
  Random random(seed);
  std::vector<Ray> rays(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    const glm::uvec3& face =
        mesh.faces[random.below(static_cast<std::uint32_t>(mesh.faces.size()))];
    const std::uint32_t first = random.below(3);
    const glm::vec3& a = mesh.positions[face[static_cast<int>(first)]];
    const glm::vec3& b = mesh.positions[face[static_cast<int>((first + 1) % 3)]];
    const glm::vec3& c = mesh.positions[face[static_cast<int>((first + 2) % 3)]];
    float u = random.unit();
    float v = random.unit();
    if (u + v > 1.0F) {
      u = 1.0F - u;
      v = 1.0F - v;
    }
    const auto steps = static_cast<int>(random.below(8)) + 1;
    const std::uint32_t signs = random.bits32();
    glm::vec3 target = a;
    for (int axis = 0; axis < 3; ++axis) {
      const float along = u * (b[axis] - a[axis]);
      const float across = v * (c[axis] - a[axis]);
      switch (i % 4) {
        case 0:
          break;
        case 1:
          target[axis] = a[axis] + along;
          break;
        case 2:
          target[axis] = a[axis] + along + across;
          break;
        default:
          target[axis] = ulps(a[axis], ((signs >> axis) & 1u) != 0 ? steps : -steps);
          break;
      }
    }
    rays[i].origin = point_in(from, random);
    rays[i].direction = {target.x - rays[i].origin.x, target.y - rays[i].origin.y,
                         target.z - rays[i].origin.z};
  }
  return rays;
}

std::vector<Ray> axis_rays(const Mesh& mesh, std::uint32_t n, std::uint64_t seed) {
  require(!mesh.faces.empty(), "axis_rays: the mesh has no faces");
  const Box from = surroundings(bounds(mesh), true);
  Random random(seed);
  std::vector<Ray> rays(n);
  for (Ray& ray : rays) {
    const glm::vec3& target = corner(mesh, random);
    const auto axis = static_cast<int>(random.below(3));
    const bool up = random.below(2) == 0;
    ray.origin = target;
    ray.origin[axis] = up ? from.lo[axis] : from.hi[axis];
    for (int a = 0; a < 3; ++a) {
      const std::uint32_t chance = random.below(4);
      if (a == axis) {
        ray.direction[a] = up ? 1.0F : -1.0F;
        continue;
      }
      ray.direction[a] = (chance & 1u) != 0 ? -0.0F : 0.0F;
      // Half of the rays pass the vertex by one float.
      if (random.below(4) == 0) {
        ray.origin[a] = ulps(ray.origin[a], (chance & 2u) != 0 ? 1 : -1);
      }
    }
  }
  return rays;
}

}  // namespace zkd::scene
