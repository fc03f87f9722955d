// SPDX-License-Identifier: Apache-2.0
//
// The small meshes that trees and queries are tried on: one of each kind that has ever been hard,
// about 300 triangles each, any number of them by seed.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "scene/generate.hpp"
#include "scene/mesh.hpp"
#include "scene/random.hpp"

namespace zkd::scene {

/// Corners on a small integer grid: coplanar, duplicate, edge-sharing and zero-area triangles
/// abound, and everything is decidable.
inline Mesh integer_mesh(std::uint32_t n, int half_width, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (std::uint32_t i = 0; i < n; ++i) {
    for (int c = 0; c < 3; ++c) {
      const auto x = static_cast<float>(random.integer(-half_width, half_width));
      const auto y = static_cast<float>(random.integer(-half_width, half_width));
      const auto z = static_cast<float>(random.integer(-half_width, half_width));
      mesh.positions.emplace_back(x, y, z);
    }
    mesh.faces.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

/// Every position moved by some ulps.
inline Mesh jittered(Mesh mesh, int most, std::uint64_t seed) {
  Random random(seed);
  for (glm::vec3& p : mesh.positions) {
    for (int a = 0; a < 3; ++a) p[a] = ulps(p[a], random.integer(-most, most));
  }
  return mesh;
}

/// Shells inside each other, `steps` ulps apart at radius 1.
inline Mesh nested_shells(int shells, int steps) {
  Mesh mesh;
  for (int i = 0; i < shells; ++i) {
    Mesh shell = sphere(1);
    for (glm::vec3& p : shell.positions) p *= ulps(1.0F, i * steps);
    mesh = joined(std::move(mesh), shell);
  }
  return mesh;
}

/// Triangles of all sizes from 2^-20 to 2^3 of each other.
inline Mesh many_scales(std::uint32_t n, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (std::uint32_t i = 0; i < n; ++i) {
    const float size = std::ldexp(1.0F, random.integer(-20, 3));
    const glm::vec3 at = random.in_cube();
    for (int c = 0; c < 3; ++c) mesh.positions.push_back(at + size * random.in_cube());
    mesh.faces.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

/// A few ulps wide, far from the origin.
inline Mesh few_ulps(std::uint32_t n, float at, int width, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (std::uint32_t i = 0; i < n; ++i) {
    for (int c = 0; c < 3; ++c) {
      const float x = ulps(at, random.integer(0, width));
      const float y = ulps(-at, random.integer(0, width));
      const float z = ulps(at, random.integer(0, width));
      mesh.positions.emplace_back(x, y, z);
    }
    mesh.faces.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

/// Coordinates that are small multiples of the smallest float.
inline Mesh denormals(std::uint32_t n, int half_width, std::uint64_t seed) {
  Mesh mesh = integer_mesh(n, half_width, seed);
  for (glm::vec3& p : mesh.positions) p *= std::numeric_limits<float>::denorm_min();
  return mesh;
}

/// Three triangles on every edge of a strip.
inline Mesh book(std::uint32_t pages) {
  Mesh mesh;
  mesh.positions = {{0, 0, -1}, {0, 0, 1}};
  for (std::uint32_t i = 0; i < pages; ++i) {
    const auto x = static_cast<float>(i % 17) - 8.0F;
    const auto y = static_cast<float>(i % 23) - 11.0F;
    mesh.positions.emplace_back(x / 8, y / 8, static_cast<float>(i % 5) - 2.0F);
    mesh.faces.emplace_back(0, 1, i + 2);
  }
  return mesh;
}

struct NamedMesh {
  std::string name;
  Mesh mesh;
};

inline constexpr int small_mesh_kinds = 32;

/// Kinds whose rays take several times as long as those of others, through any tree: all triangles
/// are in one place, or their coordinates are denormal, which is slow on some processors.
inline constexpr bool is_slow_small_mesh(int kind) {
  switch (kind) {
    case 6:   // same centre
    case 10:  // small in large 1e6
    case 11:  // fan
    case 13:  // identical
    case 14:  // integers, 2 wide
    case 22:  // few ulps at 1e6
    case 25:  // sphere times 2^-130
    case 27:  // denormals
    case 28:  // random bits
    case 29:  // book
      return true;
    default:
      return false;
  }
}

/// Mesh number `kind` (0 .. small_mesh_kinds - 1), varied by `seed`. May hold zero-area and, in
/// "random bits", non-finite triangles.
inline NamedMesh small_mesh(int kind, std::uint64_t seed) {
  Random random(1000 * seed + static_cast<std::uint64_t>(kind));
  const std::uint64_t own = random.bits64();
  const std::uint32_t n = 250 + random.below(100);
  const glm::vec3 far_away = {random.one_in(2) ? 1e6F : -1e6F, 148376.0F, 0.0F};
  switch (kind) {
    case 0:
      return {"soup", soup(n, own)};
    case 1:
      return {"grid", grid(1 + random.below(3))};
    case 2:
      return {"sphere", sphere(random.below(3))};
    case 3:
      return {"slivers 1e2", slivers(n, 1e2F, own)};
    case 4:
      return {"slivers 1e5", slivers(n, 1e5F, own)};
    case 5:
      return {"slivers 1e7", slivers(n, 1e7F, own)};
    case 6:
      return {"same centre", same_centre(n, own)};
    case 7:
      return {"flat", flat(n, static_cast<int>(seed % 3), own)};
    case 8:
      return {"needles", needles(n / 2, own)};
    case 9:
      return {"small in large 1e3", small_in_large(n, 1e3F, own)};
    case 10:
      return {"small in large 1e6", small_in_large(n, 1e6F, own)};
    case 11:
      return {"fan", fan(n)};
    case 12:
      return {"staircase", staircase(60)};
    case 13:
      return {"identical", identical(n / 4)};
    case 14:
      return {"integers, 2 wide", integer_mesh(n, 1, own)};
    case 15:
      return {"integers, 8 wide", integer_mesh(n, 4, own)};
    case 16:
      return {"grid moved by an ulp", jittered(grid(3), 1, own)};
    case 17:
      return {"shells an ulp apart", nested_shells(4, 1 + random.integer(0, 3))};
    case 18: {
      Mesh once = soup(n / 2, own);
      return {"duplicates", joined(once, once)};
    }
    case 19:
      return {"many scales", many_scales(n, own)};
    case 20:
      return {"soup at 1e6", offset(soup(n, own), far_away)};
    case 21:
      return {"sphere at 1.6e7", offset(sphere(2), glm::vec3(1.6e7F))};
    case 22:
      return {"few ulps at 1e6", few_ulps(n, 1e6F, random.integer(1, 4), own)};
    case 23:
      return {"soup times 2^-100", scaled(soup(n, own), -100)};
    case 24:
      return {"soup times 2^100", scaled(soup(n, own), 100)};
    case 25:
      return {"sphere times 2^-130", scaled(sphere(2), -130)};
    case 26:
      return {"sphere times 2^127", scaled(sphere(2), 127)};
    case 27:
      return {"denormals", denormals(n, 1 + random.integer(0, 9), own)};
    case 28:
      return {"random bits", random_bits(n, own)};
    case 29:
      return {"book", book(n)};
    case 30:
      return {"one triangle", soup(1, own)};
    default:
      return {"two triangles", soup(2, own)};
  }
}

}  // namespace zkd::scene
