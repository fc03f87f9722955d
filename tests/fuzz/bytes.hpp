// SPDX-License-Identifier: Apache-2.0
//
// How the fuzz targets read meshes, rays and options out of bytes. Every string of bytes is some
// input, and a byte near the end changes little: what is read last is the list of triangles.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>

#include "scene/generate.hpp"
#include "scene/mesh.hpp"
#include "scene/random.hpp"

namespace zkd::fuzz {

/// The bytes, from the front; zeros behind their end.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}

  [[nodiscard]] std::size_t left() const { return rest_.size(); }

  std::uint8_t byte() {
    if (rest_.empty()) return 0;
    const std::uint8_t value = rest_.front();
    rest_ = rest_.subspan(1);
    return value;
  }

  std::uint32_t bits32() {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value |= std::uint32_t{byte()} << (8 * i);
    return value;
  }

  /// 0 .. bound - 1; bound is at most 256.
  std::uint32_t below(std::uint32_t bound) { return byte() % bound; }

  /// -most .. most.
  float integer(int most) {
    return static_cast<float>(static_cast<int>(below(2 * static_cast<std::uint32_t>(most) + 1)) -
                              most);
  }

  bool one_in(std::uint32_t count) { return below(count) == count - 1; }

  /// Any float whatever.
  float any_float() { return std::bit_cast<float>(bits32()); }

  glm::vec3 integers(int most) {
    const float x = integer(most);
    const float y = integer(most);
    const float z = integer(most);
    return {x, y, z};
  }

  glm::vec3 any_floats() {
    const float x = any_float();
    const float y = any_float();
    const float z = any_float();
    return {x, y, z};
  }

 private:
  std::span<const std::uint8_t> rest_;
};

/// A number that another byte makes another one.
inline std::uint32_t checksum(const std::uint8_t* data, std::size_t size) {
  std::uint32_t sum = 2166136261u;
  for (const std::uint8_t byte : std::span(data, size)) sum = (sum ^ byte) * 16777619u;
  return sum >> 8;
}

inline constexpr std::size_t most_faces = 96;
inline constexpr std::uint32_t most_rays = 16;

// ---- Options ------------------------------------------------------------------------------------

/// Weights of the surface-area heuristic, in their ranges.
inline SahOptions valid_sah_options(Bytes& bytes) {
  constexpr std::array<float, 6> costs = {1.0F, 0.5F, 2.0F, 0.25F, 8.0F, 0.0625F};
  constexpr std::array<float, 4> bonuses = {0.0F, 0.2F, 0.5F, 0.875F};
  SahOptions sah;
  sah.visit_cost = costs[bytes.below(costs.size())];
  sah.test_cost = costs[bytes.below(costs.size())];
  sah.areas = bytes.one_in(2) ? SahAreas::cells : SahAreas::tight;
  sah.empty_bonus = bonuses[bytes.below(bonuses.size())];
  return sah;
}

/// Options that every version must build with: nothing out of range, nothing unsupported.
inline BuildOptions valid_options(Bytes& bytes) {
  constexpr std::array<std::uint32_t, 8> leaf_sizes = {4, 1, 2, 3, 9, 32, 100, 1024};
  BuildOptions options;
  options.references = bytes.one_in(2) ? References::all : References::once;
  options.leaf_size = leaf_sizes[bytes.below(leaf_sizes.size())];
  options.code_bits = bytes.below(65);
  options.axis_order = bytes.one_in(2) ? AxisOrder::cyclic : AxisOrder::by_extent;
  options.recode_crowded = !bytes.one_in(4);
  options.measure_quality = bytes.one_in(4);
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

/// Any values at all, most of them in their ranges.
inline BuildOptions any_options(Bytes& bytes) {
  BuildOptions options = valid_options(bytes);
  const auto any = [&bytes] { return static_cast<int>(bytes.bits32()); };
  options.invalid_triangles = static_cast<InvalidTriangles>(bytes.below(2));
  switch (bytes.below(32)) {
    case 1:
      options.references = static_cast<References>(any());
      break;
    case 2:
      options.references = static_cast<References>(bytes.below(5));
      break;
    case 3:
      options.builder = static_cast<Builder>(bytes.below(4));
      break;
    case 4:
      options.quality = static_cast<Quality>(bytes.below(4));
      break;
    case 5:
      options.invalid_triangles = static_cast<InvalidTriangles>(any());
      break;
    case 6:
      options.axis_order = static_cast<AxisOrder>(any());
      break;
    case 7:
      options.leaf_size = bytes.bits32();
      break;
    case 8:
      options.code_bits = bytes.bits32();
      break;
    case 9:
      options.budget = bytes.any_float();
      break;
    case 11:
    case 12:
      options.builder = Builder::wu2011;
      options.sah = valid_sah_options(bytes);
      break;
    case 10:
      options.reference_capacity = std::uint64_t{bytes.bits32()} << bytes.below(33);
      break;
    default:
      break;
  }
  return options;
}

// ---- Meshes -------------------------------------------------------------------------------------

/// A mesh and rays on a small lattice: integers times a power of two, moved by integers. All of it
/// is exact in float, and what a ray hits can be decided.
struct LatticeInput {
  scene::Mesh mesh;
  std::vector<Ray> rays;
};

/// Triangles from the corners that there are, until the bytes end.
inline void append_faces(Bytes& bytes, scene::Mesh& mesh) {
  const auto corners = static_cast<std::uint32_t>(mesh.positions.size());
  while (bytes.left() > 0 && mesh.faces.size() < most_faces) {
    const std::uint32_t a = bytes.below(corners);
    const std::uint32_t b = bytes.below(corners);
    const std::uint32_t c = bytes.below(corners);
    mesh.faces.emplace_back(a, b, c);
  }
}

/// From and along small integers and halves, or from there to a corner; an interval of quarters.
inline Ray lattice_ray(Bytes& bytes, const std::vector<glm::vec3>& corners) {
  Ray ray;
  ray.origin = 0.5F * bytes.integers(40);
  const std::uint32_t kind = bytes.byte();
  ray.direction =
      kind % 2 == 0 ? bytes.integers(8) : corners[bytes.below(32) % corners.size()] - ray.origin;
  if (kind % 8 == 7) {
    ray.t_min = 0.25F * bytes.integer(20);
    ray.t_max = 0.25F * bytes.integer(20);
  }
  if (kind % 16 == 8) ray.t_min = -std::numeric_limits<float>::infinity();
  return ray;
}

/// `with_rays` or not.
inline LatticeInput lattice_input(Bytes& bytes, bool with_rays) {
  constexpr std::array<int, 4> half_widths = {2, 1, 5, 16};
  constexpr std::array<int, 8> exponents = {0, 0, 0, 0, -100, -30, 30, 90};
  LatticeInput input;
  const int half_width = half_widths[bytes.below(4)];
  const int exponent = exponents[bytes.below(8)];
  const glm::vec3 by = bytes.one_in(8) ? 4096.0F * bytes.integers(127) : glm::vec3(0.0F);
  const std::uint32_t corners = 3 + bytes.below(30);
  std::vector<glm::vec3>& positions = input.mesh.positions;
  for (std::uint32_t i = 0; i < corners; ++i) positions.push_back(bytes.integers(half_width));
  const std::uint32_t rays = with_rays ? 1 + bytes.below(most_rays) : 0;
  for (std::uint32_t i = 0; i < rays; ++i) input.rays.push_back(lattice_ray(bytes, positions));
  append_faces(bytes, input.mesh);

  const float scale = std::ldexp(1.0F, exponent);
  for (glm::vec3& p : positions) p = scale * (p + by);
  for (Ray& ray : input.rays) {
    ray.origin = scale * (ray.origin + by);
    ray.direction *= scale;
  }
  return input;
}

/// Copies of `mesh` side by side, on the same lattice, until there are at least `faces` triangles:
/// more than one thread's share.
inline scene::Mesh repeated(const scene::Mesh& mesh, std::size_t faces) {
  scene::Mesh all;
  const Box box = scene::bounds(mesh);
  float step = 0.0F;
  for (int a = 0; a < 3; ++a) step = std::max(step, box.hi[a] - box.lo[a]);
  for (std::uint32_t i = 0; !mesh.faces.empty() && all.faces.size() < faces; ++i) {
    scene::Mesh copy = mesh;
    for (glm::vec3& p : copy.positions) {
      for (int a = 0; a < 3; ++a) {
        // Every third copy lies on the one before.
        p[a] += static_cast<float>(((i - i / 3) >> (3 * a)) & 7u) * step;
      }
    }
    all = scene::joined(std::move(all), copy);
  }
  return all;
}

/// Corners of any bits; indices of any bits in one mesh of four.
inline scene::Mesh any_mesh(Bytes& bytes) {
  scene::Mesh mesh;
  const std::uint32_t corners = bytes.below(24);
  // Coordinates of one size are rare among all floats: half of the meshes are of one size.
  const bool tame = bytes.one_in(2);
  const auto exponent = static_cast<std::uint32_t>(bytes.byte()) << 23;
  for (std::uint32_t i = 0; i < corners; ++i) {
    glm::vec3 p = bytes.any_floats();
    for (int a = 0; a < 3 && tame; ++a) {
      const std::uint32_t low = std::bit_cast<std::uint32_t>(p[a]) & 0x81FFFFFFu;
      p[a] = std::bit_cast<float>(low ^ exponent);
    }
    mesh.positions.push_back(p);
  }
  if (corners > 0 && bytes.one_in(4)) {  // rare among all floats as well
    mesh.positions[bytes.below(corners)].y = std::numeric_limits<float>::infinity();
  }
  if (corners > 0 && !bytes.one_in(4)) {
    append_faces(bytes, mesh);
    return mesh;
  }
  while (bytes.left() > 0 && mesh.faces.size() < most_faces) {
    glm::uvec3 face(0);
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t index = bytes.byte();
      face[c] = index == 255 ? bytes.bits32() : index % (corners + 1);
    }
    mesh.faces.push_back(face);
  }
  return mesh;
}

/// Rays of any bits, half of them at corners.
inline std::vector<Ray> any_rays(Bytes& bytes, const std::vector<glm::vec3>& corners) {
  std::vector<Ray> rays(1 + bytes.below(most_rays));
  for (Ray& ray : rays) {
    const std::uint32_t kind = bytes.byte();
    ray.origin = kind % 8 < 2 && !corners.empty() ? corners[bytes.below(32) % corners.size()]
                                                  : bytes.any_floats();
    ray.direction = kind % 2 == 0 || corners.empty()
                        ? bytes.any_floats()
                        : corners[bytes.below(32) % corners.size()] - ray.origin;
    if (kind % 4 == 3) {
      ray.t_min = bytes.any_float();
      ray.t_max = bytes.any_float();
    }
  }
  return rays;
}

}  // namespace zkd::fuzz
