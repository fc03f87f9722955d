// SPDX-License-Identifier: Apache-2.0
//
// The stages of the Morton builder, one public function each, in the order of the poster. build()
// gives the bytes of their composition; researchers swap or time one, tests use the same door.
//
// Every function dispatches on the executor it is given, works on spans the caller owns (host
// memory for cpu::Executor), runs on all threads of the executor, and blocks until done. Scratch
// comes from the executor's memory. Spans must not overlap unless it says so; a span of the wrong
// length is ErrorCode::invalid_view. All throw Error out_of_memory.
#pragma once

#include <cstdint>
#include <span>

#include <zkd/config.hpp>
#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/options.hpp>
#include <zkd/tree.hpp>

namespace zkd::stages {

/// What validation found.
struct SceneSummary {
  Box bounds;                    ///< of the valid triangles
  std::uint32_t valid = 0;       ///< triangles that go into the tree
  std::uint32_t zero_area = 0;   ///< left out: exactly zero area
  std::uint32_t non_finite = 0;  ///< left out: NaN or infinite coordinate
};

/// Stage 1, validation and scene box. boxes[i] becomes the box of triangle i, or an empty box if
/// the triangle is left out; -0 becomes +0. Length: triangles.triangle_count.
///
/// Throws Error invalid_view, index_out_of_range, and non_finite_vertex unless `invalid` is skip;
/// each names the first offender. Zero area is decided exactly. O(n).
ZKD_API SceneSummary triangle_boxes(const cpu::Executor& executor, const TriangleView& triangles,
                                    InvalidTriangles invalid, std::span<Box> boxes);

/// Stage 2, the lattice over `bounds` with `code_bits` bits (1 to 64) at most, axes ordered as
/// `order` says. An empty box gives a lattice without bits. O(1), no executor.
[[nodiscard]] ZKD_API Lattice make_lattice(const Box& bounds, std::uint32_t code_bits,
                                           AxisOrder order = AxisOrder::by_extent);

/// Stage 3, Morton encoding: codes of the centres of the boxes that are not empty, in their order,
/// and their indices in `ids`. Both spans as long as there are such boxes. Codes are right-aligned:
/// lattice.code_bits low bits. The 32-bit form needs code_bits <= 32. O(n).
ZKD_API void morton_encode(const cpu::Executor& executor, std::span<const Box> boxes,
                           const Lattice& lattice, std::span<std::uint32_t> codes,
                           std::span<std::uint32_t> ids);
ZKD_API void morton_encode(const cpu::Executor& executor, std::span<const Box> boxes,
                           const Lattice& lattice, std::span<std::uint64_t> codes,
                           std::span<std::uint32_t> ids);

/// Stage 4, stable radix sort of (code, value) pairs by the low `bits` bits of the codes, in place
/// as seen from outside. Digits that are equal in all codes cost nothing. Returns the passes that
/// were left out. O(n * bits / digit).
ZKD_API std::uint32_t radix_sort(const cpu::Executor& executor, std::span<std::uint32_t> codes,
                                 std::span<std::uint32_t> values, std::uint32_t bits = 32);
ZKD_API std::uint32_t radix_sort(const cpu::Executor& executor, std::span<std::uint64_t> codes,
                                 std::span<std::uint32_t> values, std::uint32_t bits = 64);

/// The key of a trunk: the Morton code and, behind it, the code of the second round.
///
///     bit 127 .. 64   code, aligned to the left: level 0 is bit 127
///     bit  63 .. 32   second-round code, aligned to the left; 0 where the trunk is not crowded
///     bit  31 ..  0   0
///
/// Keys compare as numbers. A level is the number of a bit counted from bit 127: levels 0 to 63
/// split the lattice of the scene, levels 64 to 95 the lattice of one crowded trunk.
struct TrunkKey {
  std::uint64_t code = 0;
  std::uint64_t fine = 0;

  friend ZKD_HOST_DEVICE bool operator<(const TrunkKey& a, const TrunkKey& b) {
    return a.code != b.code ? a.code < b.code : a.fine < b.fine;
  }
  friend ZKD_HOST_DEVICE bool operator==(const TrunkKey& a, const TrunkKey& b) {
    return a.code == b.code && a.fine == b.fine;
  }
};

/// Levels below this one split the scene's lattice, the others a crowded trunk's.
inline constexpr std::uint32_t first_fine_level = 64;

/// Stage 5, crowded trunks. Triangles that share a code with more than `leaf_size` others less one
/// are coded again with up to 32 bits on a lattice over their own centres, and sorted by that code
/// within their trunk. On return keys[i] is the key of ids[i], sorted; crowd[i] is the number of
/// the crowded trunk (from 0) of position i or no_crowd.
///
/// `codes` and `ids` are what the sort left; ids are permuted within crowded trunks. Returns the
/// number of crowded trunks; their lattices are written to `lattices` in order, as many as fit.
/// With `enabled` false, keys are made and nothing else. O(n).
inline constexpr std::uint32_t no_crowd = 0xFFFFFFFFu;
ZKD_API std::uint32_t recode_crowded(const cpu::Executor& executor, std::span<const Box> boxes,
                                     const Lattice& lattice, std::span<const std::uint64_t> codes,
                                     std::span<std::uint32_t> ids, std::uint32_t leaf_size,
                                     AxisOrder order, bool enabled, std::span<TrunkKey> keys,
                                     std::span<std::uint32_t> crowd, std::span<Lattice> lattices);

/// Stage 6, trunks. Conceptually, the largest nodes of the complete binary tree over all keys that
/// hold at most `leaf_size` triangles (or one key). first[t] becomes the position of the first
/// triangle of trunk t. `first` is as long as `keys`; returns how many were written.
/// O(n * leaf_size).
ZKD_API std::uint32_t find_trunks(const cpu::Executor& executor, std::span<const TrunkKey> keys,
                                  std::uint32_t leaf_size, std::span<std::uint32_t> first);

/// Stage 7, essential nodes. levels[j] becomes the level at which trunks j and j + 1 first differ:
/// the essential node between them. `trunk_keys` holds the key of each trunk's first triangle;
/// levels is one shorter. O(trunks).
ZKD_API void essential_nodes(const cpu::Executor& executor, std::span<const TrunkKey> trunk_keys,
                             std::span<std::uint8_t> levels);

/// Stage 8, path compression: links every essential node and every trunk directly to the essential
/// node above it, leaving out the redundant nodes between. children[2j] and [2j + 1] become the
/// links of node j. Returns the root. O(trunks * log trunks) at worst, searches are local.
ZKD_API Link path_compression(const cpu::Executor& executor, std::span<const TrunkKey> trunk_keys,
                              std::span<const std::uint8_t> levels, std::span<Link> children);

/// Stage 9, split planes: axis and position (in the caller's units, exact) of each essential node,
/// from the key of the trunk above the plane, cut behind the level of the node. `crowd[t]` is the
/// crowded trunk that trunk t belongs to, or no_crowd. O(trunks).
ZKD_API void split_planes(const cpu::Executor& executor, std::span<const TrunkKey> trunk_keys,
                          std::span<const std::uint8_t> levels,
                          std::span<const std::uint32_t> crowd, const Lattice& lattice,
                          std::span<const Lattice> lattices, std::span<std::uint32_t> axes,
                          std::span<float> planes);

}  // namespace zkd::stages
