// SPDX-License-Identifier: Apache-2.0
//
// What the stages mean, written down a second time: plain, slow, serial, and recursive wherever the
// poster thinks recursively. The tests hold the library against these definitions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/stages.hpp>
#include <zkd/tree.hpp>

namespace zkd::test {

// ---- Validation ---------------------------------------------------------------------------------

/// Whether the terms sum to zero in exact arithmetic (Shewchuk's growing expansions, 1997).
inline bool exact_sum_is_zero(std::span<const double> terms) {
  std::vector<double> expansion;
  for (const double term : terms) {
    double carry = term;
    for (double& part : expansion) {
      const double sum = carry + part;
      const double virtual_part = sum - carry;
      const double error = (carry - (sum - virtual_part)) + (part - virtual_part);
      part = error;
      carry = sum;
    }
    expansion.push_back(carry);
  }
  return std::all_of(expansion.begin(), expansion.end(), [](double part) { return part == 0.0; });
}

/// Whether the triangle has exactly zero area: (b - a) x (c - a) == 0 over the real numbers. The
/// product of two floats is exact in double.
inline bool has_zero_area(const float* a, const float* b, const float* c) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const auto product = [&](const float* p, const float* q) {
      return static_cast<double>(p[i]) * static_cast<double>(q[j]);
    };
    const std::array<double, 6> terms = {product(b, c),  -product(b, a), -product(a, c),
                                         -product(c, b), product(a, b),  product(c, a)};
    if (!exact_sum_is_zero(terms)) return false;
  }
  return true;
}

// ---- Lattice ------------------------------------------------------------------------------------

/// Plane k of axis a, exact in double.
inline double lattice_plane(const Lattice& lattice, int a, std::int64_t k) {
  return std::ldexp(static_cast<double>(lattice.origin[a] + k), lattice.exponent[a]);
}

/// The cell that x lies in along axis a; may lie outside the lattice.
inline std::int64_t lattice_cell(const Lattice& lattice, int a, double x) {
  return static_cast<std::int64_t>(std::floor(std::ldexp(x, -lattice.exponent[a]))) -
         lattice.origin[a];
}

inline double centre(const Box& box, int a) {
  return (static_cast<double>(box.lo[a]) + static_cast<double>(box.hi[a])) / 2.0;
}

// ---- Morton codes -------------------------------------------------------------------------------

/// Takes one bit a level, from the coordinate whose turn it is, most significant first.
inline std::uint64_t plain_code(const Lattice& lattice, const Box& box) {
  std::int64_t cell[3] = {0, 0, 0};
  std::uint32_t left[3];
  for (int a = 0; a < 3; ++a) {
    if (lattice.bits[a] > 0) cell[a] = lattice_cell(lattice, a, centre(box, a));
    left[a] = lattice.bits[a];
  }
  std::uint64_t code = 0;
  for (std::uint32_t level = 0; level < lattice.code_bits; ++level) {
    const std::uint8_t a = lattice.axis[level];
    --left[a];
    code = (code << 1) | (static_cast<std::uint64_t>(cell[a] >> left[a]) & 1u);
  }
  return code;
}

// ---- Keys ---------------------------------------------------------------------------------------

inline bool key_bit(const stages::TrunkKey& key, std::uint32_t level) {
  return level < 64 ? ((key.code >> (63 - level)) & 1u) != 0
                    : ((key.fine >> (127 - level)) & 1u) != 0;
}

inline std::uint32_t first_difference(const stages::TrunkKey& a, const stages::TrunkKey& b) {
  std::uint32_t level = 0;
  while (level < 128 && key_bit(a, level) == key_bit(b, level)) ++level;
  return level;
}

// ---- Trunks -------------------------------------------------------------------------------------

/// Descends the conceptual complete tree bit by bit. A node that holds at most leaf_size triangles,
/// or one key, is a trunk. Appends the first position of each.
inline void plain_trunks(std::span<const stages::TrunkKey> keys, std::size_t begin, std::size_t end,
                         std::uint32_t level, std::uint32_t leaf_size,
                         std::vector<std::uint32_t>& first) {
  if (begin == end) return;
  if (end - begin <= leaf_size || keys[begin] == keys[end - 1]) {
    first.push_back(static_cast<std::uint32_t>(begin));
    return;
  }
  std::size_t middle = begin;
  while (middle < end && !key_bit(keys[middle], level)) ++middle;
  plain_trunks(keys, begin, middle, level + 1, leaf_size, first);
  plain_trunks(keys, middle, end, level + 1, leaf_size, first);
}

inline std::vector<std::uint32_t> plain_trunks(std::span<const stages::TrunkKey> keys,
                                               std::uint32_t leaf_size) {
  std::vector<std::uint32_t> first;
  plain_trunks(keys, 0, keys.size(), 0, leaf_size, first);
  return first;
}

// ---- Path compression ---------------------------------------------------------------------------

/// The complete binary tree over all prefixes of the trunks' keys, with its redundant nodes left
/// out on the way up: a node with one child is that child; a node with two is the essential node
/// between the last trunk of one and the first of the other.
inline Link plain_compression(std::span<const stages::TrunkKey> keys, std::size_t begin,
                              std::size_t end, std::uint32_t level, std::vector<Link>& children) {
  if (end - begin == 1) return Link::leaf(static_cast<std::uint32_t>(begin));
  std::size_t middle = begin;
  while (middle < end && !key_bit(keys[middle], level)) ++middle;
  if (middle == begin || middle == end) {
    return plain_compression(keys, begin, end, level + 1, children);
  }
  const auto node = static_cast<std::uint32_t>(middle - 1);
  children[2 * node] = plain_compression(keys, begin, middle, level + 1, children);
  children[2 * node + 1] = plain_compression(keys, middle, end, level + 1, children);
  return Link::node(node);
}

inline Link plain_compression(std::span<const stages::TrunkKey> keys, std::vector<Link>& children) {
  children.assign(keys.empty() ? 0 : 2 * (keys.size() - 1), Link{});
  return keys.empty() ? Link{} : plain_compression(keys, 0, keys.size(), 0, children);
}

// ---- Split planes -------------------------------------------------------------------------------

struct PlainPlane {
  std::uint32_t axis = 0;
  double position = 0.0;
};

/// The plane below the cell that the first level + 1 bits of `above` name.
inline PlainPlane plain_plane(const stages::TrunkKey& above, std::uint32_t level,
                              const Lattice& scene, const Lattice* crowded) {
  const bool fine = level >= stages::first_fine_level;
  const Lattice& lattice = fine ? *crowded : scene;
  const std::uint32_t top = fine ? stages::first_fine_level : 0;
  const std::uint32_t axis = lattice.axis[level - top];
  std::int64_t cell = 0;
  std::uint32_t left = lattice.bits[axis];
  for (std::uint32_t l = top; l <= level; ++l) {
    if (lattice.axis[l - top] != axis) continue;
    --left;
    cell |= static_cast<std::int64_t>(key_bit(above, l)) << left;
  }
  return {axis, lattice_plane(lattice, static_cast<int>(axis), cell)};
}

}  // namespace zkd::test
