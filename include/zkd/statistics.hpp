// SPDX-License-Identifier: Apache-2.0
//
// What a build reports about itself.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <zkd/config.hpp>

namespace zkd {

/// The stages of a build, in the order of the poster. Validation is timed with the lattice.
/// Builder::sah and wu2011 have four: validate, sort (of events), split_planes (with references and
/// boxes) and references (from the parts of all threads to one tree).
enum class Stage : std::uint8_t {
  validate,          ///< checks, triangle boxes, scene box, lattice
  split,             ///< triangles cut into fragments, where that is done
  encode,            ///< Morton codes
  sort,              ///< stable radix sort on the codes
  clusters,          ///< the upper part of the tree by SAH, with Quality::balanced
  recode,            ///< crowded trunks coded again in their own box
  trunks,            ///< ranges of codes that become leaves
  essential_nodes,   ///< where neighbouring trunks first differ
  path_compression,  ///< essential nodes linked directly
  split_planes,      ///< axis and position of each essential node
  references,        ///< which triangles each leaf lists
  tight_boxes,       ///< boxes of what is really inside, from the leaves up
  count,
};

/// "validate", "encode", ... Static storage.
ZKD_API const char* to_string(Stage stage) noexcept;

/// Work that a scene may not need, and that is then left out without changing any answer.
enum class Skip : std::uint8_t {
  radix_passes,  ///< digits equal in every code; amount: passes left out
  flat_axes,     ///< axes without extent get no bits; amount: axes
  wide_codes,    ///< few triangles: 32-bit codes instead of 64; amount: bits
  splitting,     ///< with References::automatic or all: no triangle is split; amount: 1
  recoding,      ///< no crowded trunk, no second round; amount: 1
  compaction,    ///< no triangle left out, ids need no renumbering; amount: 1
  subtrees,      ///< no crowded leaf, none is split, with References::all; amount: 1
  count,
};

/// "radix passes", "flat axes", ... Static storage.
ZKD_API const char* to_string(Skip skip) noexcept;

/// Why it was taken: "every code has the same digit there"; or why not. Static storage.
ZKD_API const char* reason(Skip skip, bool taken) noexcept;

/// One skip: whether it was taken, how much work it left out, and what that would have cost.
struct SkipReport {
  /// Whether the build looked for it: not where its options, its builder or its backend rule it
  /// out. (Devices sort by every digit. Passes over no triangle at all are taken for left out.)
  bool considered = false;
  bool taken = false;
  std::uint32_t amount = 0;  ///< in the unit named at the enumerator

  /// Wall time that it saved, by what the same work took elsewhere in this build. Nothing where
  /// that was not done, so that nobody knows: of all skips, radix_passes alone has like passes.
  std::optional<double> saved_ms;
};

/// What one build found, made and took. Bytes are as asked of the memory resource.
struct Statistics {
  std::uint64_t triangles = 0;           ///< as given
  std::uint64_t skipped_zero_area = 0;   ///< exactly zero area: never hit, not in the tree
  std::uint64_t skipped_non_finite = 0;  ///< only with InvalidTriangles::skip
  std::uint32_t code_bits = 0;           ///< as used
  std::uint64_t crowded_trunks = 0;      ///< codes shared by more than leaf_size triangles; 0
                                         ///< without BuildOptions::recode_crowded
  std::uint64_t crowded_triangles = 0;   ///< triangles in them
  std::uint64_t crowded_leaves = 0;      ///< leaves of `all` that were coded again, because they
                                         ///< listed more than 8 * leaf_size triangles
  std::uint64_t crowded_references = 0;  ///< references that they had
  std::uint64_t nodes = 0;               ///< inner nodes
  std::uint64_t leaves = 0;
  std::uint64_t references = 0;
  std::uint64_t largest_leaf = 0;  ///< references; with measure_quality, else 0

  /// Edges from the root to the deepest leaf; 0 for a single leaf. With measure_quality, else 0.
  std::uint32_t depth = 0;

  /// Expected cost of a random long ray: sum of area(box) / area(root box) over inner nodes (times
  /// 1) and over leaves (times their references), areas of tight boxes (MacDonald and Booth 1990).
  /// With measure_quality, else 0.
  double sah_cost = 0.0;

  std::uint64_t tree_bytes = 0;       ///< the finished tree
  std::uint64_t workspace_bytes = 0;  ///< most that was held besides, freed when build returns

  /// Wall time of the build, allocation and measure_quality included: more than the sum of the
  /// stages.
  double total_ms = 0.0;
  std::array<double, static_cast<std::size_t>(Stage::count)> stage_ms{};

  /// Most bytes that the build held during each stage, the parts of the tree among them. Nothing
  /// where the backend does not know: Builder::sah, and devices, which plan all memory beforehand.
  std::array<std::optional<std::uint64_t>, static_cast<std::size_t>(Stage::count)> stage_bytes{};

  std::array<SkipReport, static_cast<std::size_t>(Skip::count)> skips{};

  [[nodiscard]] double ms(Stage stage) const { return stage_ms[static_cast<std::size_t>(stage)]; }
  [[nodiscard]] std::optional<std::uint64_t> bytes(Stage stage) const {
    return stage_bytes[static_cast<std::size_t>(stage)];
  }
  [[nodiscard]] const SkipReport& skip(Skip what) const {
    return skips[static_cast<std::size_t>(what)];
  }
};

}  // namespace zkd
