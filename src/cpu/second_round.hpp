// SPDX-License-Identifier: Apache-2.0
//
// Stage 5 on the CPU, trunk by trunk: one thread boxes, codes, sorts and places all triangles of a
// crowded trunk while they are in its cache. The bytes are those of the passes of core/recode.hpp.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

#include "core/recode.hpp"

namespace zkd::cpu {

/// Sorts numbers no two of which are equal, by insertion.
inline void sort_few(std::uint64_t* numbers, std::uint32_t count) {
  for (std::uint32_t i = 1; i < count; ++i) {
    const std::uint64_t number = numbers[i];
    std::uint32_t to = i;
    for (; to > 0 && numbers[to - 1] > number; --to) numbers[to] = numbers[to - 1];
    numbers[to] = number;
  }
}

/// Sorts codes, in the upper halves, each with its place in the lower half, which ascends: so the
/// order of equal codes stays. Returns which of the two arrays has the result.
inline std::uint64_t* sort_codes(std::uint64_t* codes, std::uint64_t* other, std::uint32_t count) {
  constexpr std::uint32_t few = 16;
  constexpr std::uint32_t some = 256;
  constexpr int digits = 4;
  if (count <= few) {
    sort_few(codes, count);
    return codes;
  }
  std::uint32_t counts[digits][256] = {};
  const auto digit = [](std::uint64_t code, int d) { return (code >> (32 + 8 * d)) & 0xFF; };
  const auto scatter = [&](int d) {
    std::uint32_t place = 0;
    for (std::uint32_t& of_digit : counts[d]) place += std::exchange(of_digit, place);
    for (std::uint32_t i = 0; i < count; ++i) other[counts[d][digit(codes[i], d)]++] = codes[i];
    std::swap(codes, other);
  };
  if (count <= some) {
    // The first eight levels tell most triangles apart.
    for (std::uint32_t i = 0; i < count; ++i) ++counts[digits - 1][digit(codes[i], digits - 1)];
    scatter(digits - 1);
    sort_few(codes, count);
    return codes;
  }
  for (std::uint32_t i = 0; i < count; ++i)
    for (int d = 0; d < digits; ++d) ++counts[d][digit(codes[i], d)];
  for (int d = 0; d < digits; ++d)
    if (counts[d][digit(codes[0], d)] != count) scatter(d);
  return codes;
}

/// MortonCoder::encode of the centres of some boxes: cells first, then the bits of all of them,
/// which compilers do in vectors.
class EncodeBlock {
 public:
  static constexpr std::uint32_t most = 64;

  explicit EncodeBlock(const core::MortonCoder& coder) : coder_(coder) {}

  void operator()(const Box* boxes, const std::uint32_t* ids, std::uint32_t count,
                  std::uint32_t (&codes)[most]) const {
    std::uint32_t cells[3][most] = {};
    for (std::uint32_t i = 0; i < count; ++i) {
      const Box& box = boxes[ids[i]];
      for (int a = 0; a < 3; ++a) {
        const double at = core::centre(box, a) * coder_.inverse_cell[a];
        cells[a][i] = static_cast<std::uint32_t>(core::floor_to_int(at) - coder_.origin[a]);
      }
    }
    for (std::uint32_t& code : codes) code = 0;
    for (int a = 0; a < 3; ++a)
      for (std::uint32_t i = 0; i < most; ++i)
        codes[i] |= coder_.dealer[a].deal<std::uint32_t>(cells[a][i]);
  }

 private:
  core::MortonCoder coder_;  // a copy, for the compiler to know that nobody writes to it
};

/// One crowded trunk, start to end.
template <class Code>
struct RecodeTrunk {
  core::CrowdedTrunks<Code> trunks;

  void operator()(std::uint32_t c, std::uint32_t count) const {
    const core::RecodeWorkspace& work = trunks.work;
    const std::uint32_t offset = work.offsets[c];
    std::uint32_t* const ids = trunks.ids + work.first[c];
    std::uint32_t* const fine = work.fine + work.first[c];
    std::uint32_t* const old_ids = work.sort.values + offset;
    std::memcpy(old_ids, ids, count * sizeof *ids);

    core::WideBox centres;
    for (std::uint32_t i = 0; i < count; ++i) {
      const Box& box = trunks.boxes[old_ids[i]];
      centres.include({core::centre(box, 0), core::centre(box, 1), core::centre(box, 2)});
    }
    const Lattice lattice =
        core::make_lattice(centres, trunks.bits(c), trunks.order, trunks.frame->finest);
    const core::MortonCoder coder(lattice);
    work.lattices[c] = lattice;
    work.coders[c] = coder;

    std::uint64_t* const codes = work.sort.keys + offset;
    const EncodeBlock encode(coder);
    for (std::uint32_t begin = 0; begin < count; begin += EncodeBlock::most) {
      const std::uint32_t n = std::min(EncodeBlock::most, count - begin);
      std::uint32_t block[EncodeBlock::most];
      encode(trunks.boxes, old_ids + begin, n, block);
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint64_t code = std::uint64_t{block[i]} << (core::fine_bits - lattice.code_bits);
        codes[begin + i] = code << 32 | (begin + i);
      }
    }
    const std::uint64_t* const sorted = sort_codes(codes, work.sort.other_keys + offset, count);
    for (std::uint32_t i = 0; i < count; ++i) {
      ids[i] = old_ids[static_cast<std::uint32_t>(sorted[i])];
      fine[i] = static_cast<std::uint32_t>(sorted[i] >> 32);
    }
  }
};

}  // namespace zkd::cpu
