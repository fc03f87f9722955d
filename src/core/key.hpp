// SPDX-License-Identifier: Apache-2.0
//
// Keys of triangles and trunks, their levels and prefixes: the conceptual complete binary tree,
// which is never built.
#pragma once

#include <cstdint>

#include <zkd/traversal/arithmetic.hpp>
#include <zkd/tree.hpp>
#include <zkd/trunk_key.hpp>

namespace zkd::core {

using stages::first_fine_level;
using stages::TrunkKey;

/// Levels of a key: 64 of the code, 32 of the second round, 32 of crowded leaves' references.
inline constexpr std::uint32_t level_count = 128;

/// The first of the levels inside crowded leaves. Those above may all split once; how many a leaf
/// may use is what these leave of max_depth.
inline constexpr std::uint32_t first_reference_level = 96;

static_assert(max_depth == first_reference_level, "every level above may split once");

/// The level at which two keys first differ; level_count if they are equal. The node of the
/// conceptual tree at which they part has a prefix of this many bits.
ZKD_HOST_DEVICE inline std::uint32_t parting_level(const TrunkKey& a, const TrunkKey& b) {
  const std::uint64_t code = a.code ^ b.code;
  if (code != 0) return leading_zeros(code);
  const std::uint64_t fine = a.fine ^ b.fine;
  return fine != 0 ? first_fine_level + leading_zeros(fine) : level_count;
}

/// The lowest key below the node of the conceptual tree that has the first `level` bits of `key`.
ZKD_HOST_DEVICE inline TrunkKey lowest_below(const TrunkKey& key, std::uint32_t level) {
  if (level < first_fine_level) return {level == 0 ? 0 : key.code & (~0ull << (64 - level)), 0};
  const std::uint32_t fine = level - first_fine_level;
  return {key.code, fine == 0 ? 0 : key.fine & (~0ull << (64 - fine))};
}

/// The highest key below that node.
ZKD_HOST_DEVICE inline TrunkKey highest_below(const TrunkKey& key, std::uint32_t level) {
  if (level < first_fine_level) return {key.code | (~0ull >> level), ~0ull};
  return {key.code, key.fine | (~0ull >> (level - first_fine_level))};
}

/// Sorted keys of triangles as the sort leaves them: right-aligned codes, and second-round codes
/// (32 bits, left-aligned) if any trunk was crowded.
template <class Code>
struct SortedKeys {
  const Code* codes;
  const std::uint32_t* fine;       ///< null: no trunk was crowded
  const std::uint32_t* code_bits;  ///< of the lattice
  std::uint32_t align = 0;

  ZKD_HOST_DEVICE void load() { align = smaller(64 - *code_bits, 63u); }

  ZKD_HOST_DEVICE TrunkKey operator[](std::uint32_t i) const {
    return {static_cast<std::uint64_t>(codes[i]) << align,
            fine != nullptr ? static_cast<std::uint64_t>(fine[i]) << 32 : 0};
  }
};

/// The same in one number, for codes of at most 32 bits: the code aligned to the left, then the
/// second-round code. Levels differ from those of a TrunkKey, but compare in the same way, which is
/// all that finding trunks needs, with half the work.
struct PackedKeys {
  SortedKeys<std::uint32_t> keys;

  ZKD_HOST_DEVICE void load() { keys.load(); }

  ZKD_HOST_DEVICE std::uint64_t operator[](std::uint32_t i) const {
    return static_cast<std::uint64_t>(keys.codes[i]) << keys.align |
           (keys.fine != nullptr ? keys.fine[i] : 0);
  }
};

ZKD_HOST_DEVICE inline std::uint32_t parting_level(std::uint64_t a, std::uint64_t b) {
  return a != b ? leading_zeros(a ^ b) : level_count;
}

/// Writes down the i-th key, for those who call the stage by itself.
template <class Code>
struct WriteKey {
  SortedKeys<Code> keys;
  TrunkKey* out;

  ZKD_HOST_DEVICE void load() { keys.load(); }
  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const { out[i] = keys[i]; }
};

}  // namespace zkd::core
