// SPDX-License-Identifier: Apache-2.0
//
// The integer lattice that Morton codes and split planes live on.
#pragma once

#include <cstdint>

#include <zkd/config.hpp>

namespace zkd {

/// A box of 2^bits[a] cells along each axis a. Cell size and origin are powers of two and multiples
/// of them, so that every plane between two cells is a float without rounding and a coordinate and
/// a plane can never disagree about which side it is on:
///
///     cell size   2^exponent[a]
///     plane k     (origin[a] + k) * 2^exponent[a]        k = 0 .. 2^bits[a]
///     cell of x   floor(x * 2^-exponent[a]) - origin[a]  evaluated in double, exact
///
/// |origin| and |origin + 2^bits| are at most 2^24, and cells are not so small that a plane would
/// underflow in tree space (TreeView::scale). An axis along which nothing extends has no bits; its
/// only cell has no planes and need not hold the box.
///
/// A Morton code of `code_bits` bits interleaves the cell coordinates; level 0 is its most
/// significant bit and splits axis `axis[0]`, and so on down.
///
///     level      0   1   2   3   4   5  ...  code_bits-1
///     axis[]     x   x   y   x   z   y  ...               (an example)
///     code       xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx   bit code_bits-1 .. bit 0
struct Lattice {
  std::int32_t exponent[3] = {0, 0, 0};
  std::int32_t origin[3] = {0, 0, 0};
  std::uint32_t bits[3] = {0, 0, 0};
  std::uint32_t code_bits = 0;        ///< bits[0] + bits[1] + bits[2], at most 64
  std::uint64_t mask[3] = {0, 0, 0};  ///< the bits of a code that belong to each axis
  std::uint8_t axis[64] = {};         ///< axis split at each level
};

}  // namespace zkd
