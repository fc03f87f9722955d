// SPDX-License-Identifier: Apache-2.0
//
// The stages of the Morton builder, one public function each, in the order of the poster. build()
// gives the bytes of their composition. They are there to time one, to put another in its place,
// and to test each by itself.
//
// Every function runs where its executor says: a cpu::Executor, or a cuda::Executor (include
// zkd/cuda/executor.hpp). The library zkd::zkd has all of them for cpu::Executor, zkd::cuda for
// cuda::Executor; with any other type a program does not link. A braced list ({.threads = 2}, or
// {}) is a cpu::Executor.
//
// Arrays are spans the caller owns: host memory for cpu::Executor, memory of the device for
// cuda::Executor, and so are those that a TriangleView or a Skeleton names. Everything else,
// results included, is a value on the host. A call blocks until done, on CUDA too: there it waits
// for the stream, several times. Scratch comes from the executor's memory (its workspace is left
// alone). Spans must not overlap. n is the number of triangles that the function is given.
//
// All throw Error: invalid_view for a span of the wrong length, invalid_option for a number outside
// its range, too_many_triangles for spans longer than max_count, out_of_memory; on CUDA
// backend_unavailable and device_failure; beyond those, what each says. Values that contradict each
// other (codes not sorted, a level that is not that of its trunks) are not found out.
#pragma once

#include <cstdint>
#include <span>

#include <zkd/config.hpp>
#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/options.hpp>
#include <zkd/tree.hpp>
#include <zkd/trunk_key.hpp>

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
template <class Executor = cpu::Executor>
ZKD_API SceneSummary triangle_boxes(const Executor& executor, const TriangleView& triangles,
                                    InvalidTriangles invalid, std::span<Box> boxes);

/// Stage 2, the lattice over `bounds` (in the caller's units) with `code_bits` bits (1 to 64) at
/// most, dealt to the axes as `order` says. An empty box gives a lattice without bits. O(1), no
/// executor. Throws Error invalid_option.
[[nodiscard]] ZKD_API Lattice make_lattice(const Box& bounds, std::uint32_t code_bits,
                                           AxisOrder order = AxisOrder::by_extent);

/// Between stages 2 and 3: whether build() splits triangles before it codes them, by `policy`:
/// never for `once`, always for `budget`; for `automatic` and `all` where the scene is uneven:
/// where large triangles lie among small ones, for `all` from less on, but not where dozens of
/// boxes lie in each other. `boxes` are stage 1's. Equal for every order of the triangles. O(n).
template <class Executor = cpu::Executor>
[[nodiscard]] ZKD_API bool pays_to_split(const Executor& executor, std::span<const Box> boxes,
                                         References policy);

/// What split_triangles() made.
struct Fragments {
  std::uint32_t places = 0;  ///< some of which may stay empty: not every triangle can be cut often
  std::uint32_t count = 0;   ///< boxes that are not empty
};

/// Between stages 2 and 3, where it pays: triangles whose boxes hold much besides them are cut on
/// planes of the lattice, the most useful first (Karras, Aila, HPG 2013, section 4), into at most
/// `budget` fragments for each box that is not empty, as BuildOptions::budget says.
///
/// fragments[k] becomes the box of fragment k, or an empty one, owners[k] its triangle, in order of
/// triangles; as many are written as fit, so a call with empty spans asks for their number. From
/// there on fragments are coded, sorted and made trunks of in place of triangles: `boxes` of stages
/// 3 and 5 are theirs, and n is Fragments::count. `boxes` here are stage 1's, `lattice` stage 2's,
/// over all of them.
///
/// Throws Error invalid_view. O(n + fragments).
template <class Executor = cpu::Executor>
ZKD_API Fragments split_triangles(const Executor& executor, const TriangleView& triangles,
                                  std::span<const Box> boxes, const Lattice& lattice, float budget,
                                  std::span<Box> fragments, std::span<std::uint32_t> owners);

/// Stage 3, Morton encoding: codes of the centres of the boxes that are not empty, in their order,
/// and the indices of those boxes in `ids`. Both spans are as long as there are such boxes
/// (SceneSummary::valid); the centres must lie inside the lattice. Codes are right-aligned: the low
/// lattice.code_bits bits. The 32-bit form needs lattice.code_bits <= 32. O(n).
template <class Executor = cpu::Executor>
ZKD_API void morton_encode(const Executor& executor, std::span<const Box> boxes,
                           const Lattice& lattice, std::span<std::uint32_t> codes,
                           std::span<std::uint32_t> ids);
template <class Executor = cpu::Executor>
ZKD_API void morton_encode(const Executor& executor, std::span<const Box> boxes,
                           const Lattice& lattice, std::span<std::uint64_t> codes,
                           std::span<std::uint32_t> ids);

/// Stage 4, stable radix sort of (code, value) pairs by the low `bits` bits of the codes; the
/// result is in the same two spans. One pass for every 8 bits; on the CPU a digit that is equal in
/// all codes needs none. Returns how many passes were left out: on CUDA always 0. O(n * bits).
template <class Executor = cpu::Executor>
ZKD_API std::uint32_t radix_sort(const Executor& executor, std::span<std::uint32_t> codes,
                                 std::span<std::uint32_t> values, std::uint32_t bits = 32);
template <class Executor = cpu::Executor>
ZKD_API std::uint32_t radix_sort(const Executor& executor, std::span<std::uint64_t> codes,
                                 std::span<std::uint32_t> values, std::uint32_t bits = 64);

/// In no crowded trunk.
inline constexpr std::uint32_t no_crowd = 0xFFFFFFFFu;

/// Stage 5, crowded trunks. Where more than `leaf_size` triangles share one code (a crowded trunk),
/// they are coded again, with up to 32 bits on a lattice over their own centres, and sorted by that
/// code among themselves. On return keys[i] is the key of triangle ids[i], ascending, and crowd[i]
/// the number of its crowded trunk, counted from 0 in the order of the codes, or no_crowd.
///
/// `boxes` are those of all triangles, `codes` and `ids` what the sort left; ids are permuted
/// within crowded trunks. Returns the number of crowded trunks, n / (leaf_size + 1) at most; their
/// lattices are written to `lattices` in order, as many as fit. With `enabled` false, keys are made
/// and nothing else. O(n).
template <class Executor = cpu::Executor>
ZKD_API std::uint32_t recode_crowded(const Executor& executor, std::span<const Box> boxes,
                                     const Lattice& lattice, std::span<const std::uint64_t> codes,
                                     std::span<std::uint32_t> ids, std::uint32_t leaf_size,
                                     AxisOrder order, bool enabled, std::span<TrunkKey> keys,
                                     std::span<std::uint32_t> crowd, std::span<Lattice> lattices);

/// Stage 6, trunks: the largest nodes of the conceptual tree (the complete binary tree over all
/// keys) that hold at most `leaf_size` triangles, 1 to 1024, or a single key. first[t] becomes the
/// position of the first triangle of trunk t. `first` is as long as `keys`; returns the number of
/// trunks, the rest of `first` is unspecified. O(n * leaf_size).
template <class Executor = cpu::Executor>
ZKD_API std::uint32_t find_trunks(const Executor& executor, std::span<const TrunkKey> keys,
                                  std::uint32_t leaf_size, std::span<std::uint32_t> first);

/// Stage 7, essential nodes. levels[j] becomes the level at which trunks j and j + 1 first differ:
/// the essential node between them. `trunk_keys` holds the key of each trunk's first triangle,
/// keys[first[t]]; `levels` is one shorter. O(trunks).
template <class Executor = cpu::Executor>
ZKD_API void essential_nodes(const Executor& executor, std::span<const TrunkKey> trunk_keys,
                             std::span<std::uint8_t> levels);

/// Stage 8, path compression: links every essential node and every trunk directly to the essential
/// node above it, leaving out the redundant nodes between. children[2j] and [2j + 1] become the
/// links of node j, below and above its plane. Returns the root: a leaf for one trunk, none for no
/// trunk. O(trunks * log trunks) at worst; most nodes are settled by looking at a few neighbours.
template <class Executor = cpu::Executor>
ZKD_API Link path_compression(const Executor& executor, std::span<const TrunkKey> trunk_keys,
                              std::span<const std::uint8_t> levels, std::span<Link> children);

/// Stage 9, split planes: axis and position (in the caller's units, exact) of each essential node,
/// from the key of trunk j + 1, the first above the plane, with the bits after the node's level
/// cleared. crowd[t] is the crowded trunk that trunk t belongs to, or no_crowd: stage 5's at
/// position first[t]. `lattices` are those of stage 5, all of them. O(trunks).
template <class Executor = cpu::Executor>
ZKD_API void split_planes(const Executor& executor, std::span<const TrunkKey> trunk_keys,
                          std::span<const std::uint8_t> levels,
                          std::span<const std::uint32_t> crowd, const Lattice& lattice,
                          std::span<const Lattice> lattices, std::span<std::uint32_t> axes,
                          std::span<float> planes);

/// What stages 5 to 9 made, for the last two: non-owning, all from one run.
struct Skeleton {
  std::span<const std::uint32_t> ids;    ///< triangles, or fragments, in the order of their keys
  std::span<const std::uint32_t> first;  ///< stage 6, as many as there are trunks
  std::span<const std::uint8_t> levels;  ///< stage 7
  std::span<const Link> children;        ///< stage 8
  Link root;                             ///< stage 8
  std::span<const std::uint32_t> axes;   ///< stage 9
  std::span<const float> planes;         ///< stage 9
  /// Triangle of each fragment, as split_triangles() wrote them; none where no triangle was split,
  /// and ids are those of triangles.
  std::span<const std::uint32_t> owners{};
};

/// Stage 10, references: which triangles each leaf (trunk) lists, by `policy`, once or all. Leaf t
/// lists references [leaf_offsets[t], leaf_offsets[t + 1]); `leaf_offsets` is one longer than there
/// are trunks. Returns how many references there are; as many are written as fit into `references`,
/// so a call with an empty span asks for the number. With `all`, `inside` gets the box of what of
/// each reference lies in its leaf's cell, in tree space, as many as fit. `boxes` are stage 1's,
/// `lattice` stage 2's. Where triangles were split, a leaf lists a triangle once, however many of
/// its fragments it has: so `once` over fragments is what `budget` builds.
///
/// Throws Error too_many_references, unsupported_option; and invalid_view where an index in the
/// skeleton is out of range. O(triangles) for once (with fragments times those in a leaf, up to
/// 1024), O((triangles + references) * depth) for all.
template <class Executor = cpu::Executor>
ZKD_API std::uint64_t list_references(const Executor& executor, const TriangleView& triangles,
                                      std::span<const Box> boxes, const Skeleton& skeleton,
                                      const Lattice& lattice, References policy,
                                      std::span<std::uint32_t> leaf_offsets,
                                      std::span<std::uint32_t> references,
                                      std::span<Box> inside = {});

/// Where split_crowded_leaves() writes; as many of each as fit.
struct StrictArrays {
  std::span<Node> nodes;                  ///< links, planes in tree space; no boxes yet
  std::span<std::uint32_t> leaf_offsets;  ///< one more than leaves
  std::span<std::uint32_t> references;
  std::span<Box> inside;
};

/// What it made: nodes are one less than leaves.
struct SplitLeaves {
  Link root;
  std::uint32_t leaves = 0;
  std::uint32_t references = 0;
};

/// Stage 10 again, crowded leaves of `all`: those that list more than 8 * leaf_size triangles are
/// split, unless the boxes of what lies in the cell are nearly the same: their areas add up to 7/8
/// or more of that of the box about them, times their number. What of them lies in the cell
/// (`inside`, with `leaf_offsets` and `references` as list_references() made them) is coded by the
/// centre of its box, with up to 32 bits on a lattice over these centres, and trunks of at most 2 *
/// leaf_size such codes become the leaf's subtree, in every cell of which the triangles are listed
/// that touch it. Other leaves stay as they are. `trunk_keys` are stage 7's. Call it with empty
/// spans first: the sizes are in what it returns.
///
/// Throws Error too_many_references; and invalid_view where an index is out of range.
/// O(references * depth).
template <class Executor = cpu::Executor>
ZKD_API SplitLeaves split_crowded_leaves(
    const Executor& executor, const TriangleView& triangles, std::span<const Box> boxes,
    std::span<const TrunkKey> trunk_keys, const Skeleton& skeleton,
    std::span<const std::uint32_t> leaf_offsets, std::span<const std::uint32_t> references,
    std::span<const Box> inside, std::uint32_t leaf_size, AxisOrder order, const StrictArrays& out);

/// Stage 11, tight boxes, of `once`: writes the finished nodes, with links, planes in tree space,
/// and the boxes of what is inside each child. Where triangles were split, `boxes` are those of
/// fragments, and so are `references`: the skeleton's ids, with stage 6's `first`, and the end, as
/// `leaf_offsets`. O(references + trunks).
///
/// Throws Error invalid_view where an index is out of range.
template <class Executor = cpu::Executor>
ZKD_API void tight_boxes(const Executor& executor, std::span<const Box> boxes,
                         const Skeleton& skeleton, std::span<const std::uint32_t> leaf_offsets,
                         std::span<const std::uint32_t> references, std::span<Node> nodes);

/// Stage 11 of `all`: writes the boxes of nodes that split_crowded_leaves() made: of what lies in
/// each child's cell.
template <class Executor = cpu::Executor>
ZKD_API void tight_boxes(const Executor& executor, Link root,
                         std::span<const std::uint32_t> leaf_offsets, std::span<const Box> inside,
                         std::span<Node> nodes);

}  // namespace zkd::stages
