// SPDX-License-Identifier: Apache-2.0
//
// Stage 3, Morton encoding: interleaved lattice coordinates of a triangle's centre, and back.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>

namespace zkd::core {

/// Moves the low bits of a number to the set bits of a mask and back (Warren, Hacker's Delight,
/// 7-4 and 7-5: compress and expand with the moves computed once). Unlike pdep and pext it runs in
/// vectors, on the device, and at the same speed on every processor.
struct BitDealer {
  std::uint64_t mask = 0;
  std::uint64_t moves[6] = {};

  BitDealer() = default;

  ZKD_HOST_DEVICE explicit BitDealer(std::uint64_t the_mask) : mask(the_mask) {
    std::uint64_t m = mask;
    std::uint64_t to_count = ~m << 1;  // bits below which there are unset ones
    for (int i = 0; i < 6; ++i) {
      std::uint64_t parity = to_count ^ (to_count << 1);
      for (int shift = 2; shift < 64; shift *= 2) parity ^= parity << shift;
      moves[i] = parity & m;
      m = (m ^ moves[i]) | (moves[i] >> (1 << i));
      to_count &= ~parity;
    }
  }

  /// expand: bit i of `x` goes to the i-th set bit of the mask.
  template <class Code>
  [[nodiscard]] ZKD_HOST_DEVICE Code deal(Code x) const {
    constexpr int steps = sizeof(Code) == 4 ? 5 : 6;
    for (int i = steps - 1; i >= 0; --i) {
      const Code move = static_cast<Code>(moves[i]);
      const Code shifted = static_cast<Code>(x << (1 << i));
      x = (x & ~move) | (shifted & move);
    }
    return x & static_cast<Code>(mask);
  }

  /// compress: the i-th set bit of the mask in `x` becomes bit i.
  [[nodiscard]] ZKD_HOST_DEVICE std::uint64_t collect(std::uint64_t x) const {
    x &= mask;
    for (int i = 0; i < 6; ++i) {
      const std::uint64_t moved = x & moves[i];
      x = (x ^ moved) | (moved >> (1 << i));
    }
    return x;
  }
};

/// A lattice made ready for many codes.
struct MortonCoder {
  double inverse_cell[3];
  std::int32_t origin[3];
  std::uint32_t code_bits;
  BitDealer dealer[3];

  MortonCoder() = default;

  ZKD_HOST_DEVICE explicit MortonCoder(const Lattice& lattice) {
    for (int a = 0; a < 3; ++a) {
      inverse_cell[a] = power_of_two(-lattice.exponent[a]);
      origin[a] = lattice.origin[a];
      dealer[a] = BitDealer(lattice.mask[a]);
    }
    code_bits = lattice.code_bits;
  }

  /// The first level of the lattice that has a plane which touches the closed box, or code_bits if
  /// none has. The box lies inside the lattice.
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t first_level_across(const Box& box) const {
    std::uint64_t differ = 0;
    for (int a = 0; a < 3; ++a) {
      const double lo = static_cast<double>(box.lo[a]) * inverse_cell[a];
      const double hi = static_cast<double>(box.hi[a]) * inverse_cell[a];
      // A box that begins on a plane touches the cell below it too, unless there is none.
      const std::int32_t first = floor_to_int(lo) - origin[a];
      const bool on_plane = static_cast<double>(first + origin[a]) == lo;
      const std::int32_t below = on_plane && first > 0 ? first - 1 : first;
      const std::int32_t last = floor_to_int(hi) - origin[a];
      const auto cells = static_cast<std::uint32_t>(below) ^ static_cast<std::uint32_t>(last);
      // Only the highest differing bit of an axis counts.
      if (cells != 0) {
        const std::uint64_t highest = std::uint64_t{1} << (63 - leading_zeros(cells));
        differ |= dealer[a].template deal<std::uint64_t>(highest);
      }
    }
    return differ != 0 ? leading_zeros(differ) - (64 - code_bits) : code_bits;
  }

  /// The code of a point inside the lattice, right-aligned. An axis without bits adds none.
  template <class Code>
  [[nodiscard]] ZKD_HOST_DEVICE Code encode(const double (&point)[3]) const {
    Code code = 0;
    for (int a = 0; a < 3; ++a) {
      const std::int32_t cell = floor_to_int(point[a] * inverse_cell[a]) - origin[a];
      code |= dealer[a].template deal<Code>(static_cast<Code>(static_cast<std::uint32_t>(cell)));
    }
    return code;
  }

  /// Coordinate along axis `a` of the cell that `code` names.
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t cell(std::uint64_t code, int a) const {
    return static_cast<std::uint32_t>(dealer[a].collect(code));
  }
};

/// One triangle, named by `ids`: the code of its box's centre.
template <class Code>
struct EncodeTriangle {
  const Box* boxes;
  const std::uint32_t* ids;
  const MortonCoder* scene_coder;
  Code* codes;
  MortonCoder coder{};  // a copy: through the pointer it would be read again for every code

  ZKD_HOST_DEVICE void load() { coder = *scene_coder; }

  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const {
    const Box& box = boxes[ids[i]];
    const double point[3] = {centre(box, 0), centre(box, 1), centre(box, 2)};
    codes[i] = coder.template encode<Code>(point);
  }
};

}  // namespace zkd::core
