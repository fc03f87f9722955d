// SPDX-License-Identifier: Apache-2.0
//
// A second form of a finished tree, for rays on the CPU: nodes with up to eight children and leaves
// with copies of their triangles, laid out for vector instructions.
//
// It is optional. `widen` makes it from any Tree, whoever built that, and every answer through it
// has the bits of the query on the tree itself (zkd/query.hpp, whose rules hold here word for
// word). On one thread it takes 50 to 150 ns for each triangle, and then a ray takes half of the
// time or less: it pays once there are about as many rays as triangles. A scene that is traced
// less, or that changes with every frame, is traced through its Tree.
//
// It is a snapshot: it owns copies of the triangles' positions and needs neither the tree nor the
// triangles any more. What changes there later does not reach it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <zkd/config.hpp>
#include <zkd/cpu/executor.hpp>
#include <zkd/cpu/tree_form.hpp>
#include <zkd/geometry.hpp>
#include <zkd/query.hpp>
#include <zkd/tree.hpp>

namespace zkd::cpu {

/// Children of a node, and triangles of a block: floats in a register of AVX2.
inline constexpr int wide = 8;

/// A node: several levels of nodes of the tree in one. Boxes are in tree space
/// (TreeView::scale); those that are unused are empty (+inf, -inf) and stand at the end.
///
///     byte   0  bounds[0]  x: eight lows, eight highs
///           64  bounds[1]  y
///          128  bounds[2]  z
///          192  child      a node, or a leaf: the number of its first block
struct alignas(32) WideNode {
  float bounds[3][2][wide];
  Link child[wide];
};
static_assert(sizeof(WideNode) == 224);

/// Up to eight triangles of a leaf. A leaf is one or more blocks in a row, the last of them marked.
struct alignas(64) TriangleBlock {
  static constexpr std::uint32_t last_bit = 0x80000000u;
  static constexpr std::uint32_t unused = 0x7FFFFFFFu;  ///< the id of a lane without a triangle

  float positions[3][3][wide];  ///< corner, axis; as the caller gave them; NaN where unused
  std::uint32_t ids[wide];      ///< of ids[0], bit 31: the leaf ends with this block

  [[nodiscard]] bool is_last() const { return (ids[0] & last_bit) != 0; }
  [[nodiscard]] std::uint32_t id(std::uint32_t lane) const { return ids[lane] & ~last_bit; }
};
static_assert(sizeof(TriangleBlock) == 320);

/// A non-owning view of a wide tree: plain, valid as long as its owner.
struct WideTreeView {
  const TreeHeader* header = nullptr;     ///< that of the tree, but for `root`; null: empty
  const WideNode* nodes = nullptr;        ///< the root first, a subtree depth first
  const TriangleBlock* blocks = nullptr;  ///< near the node that they hang on
  std::uint32_t node_count = 0;
  std::uint32_t block_count = 0;

  [[nodiscard]] Link root() const { return header != nullptr ? header->root : Link{}; }
};

/// Owns a wide tree. Of bytes() there are 320 for each block and 224 for each node. On the scenes of
/// the benchmark there is a node for every five blocks, in trees of References::all for 11 to 16,
/// and that is 60 to 75 bytes for each triangle where it is referenced once, and 110 to 240 for
/// trees of References::all and Builder::sah.
using WideTree = TreeForm<WideTreeView>;

/// The wide form of `tree`, which was built from `triangles` (or a copy of its data at other
/// addresses), by any builder. Bytes are the same for any number of threads and instruction set.
///
/// Parts of the tree that list eight different triangles or fewer (in at most 32 references) become
/// one leaf. Of the nodes above them those become wide ones whose surfaces add up to the least, which
/// random lines would meet the fewest of (Ylitie, Karras, Laine: Efficient Incoherent Ray Traversal on GPUs Through Compressed
/// Wide BVHs, HPG 2017, section 3.1, with the leaves given). O(references) work.
///
/// Takes from `executor.memory` what the result holds and, while it works, 4 bytes for each node of
/// the tree and at most 512 KB besides.
///
/// Throws Error: invalid_view, invalid_option as build(); index_out_of_range naming a reference
/// to a triangle that `triangles` does not have; out_of_memory. Then nothing is held.
[[nodiscard]] ZKD_API WideTree widen(const Executor& executor, const TreeView& tree,
                                     const TriangleView& triangles);

/// zkd::closest_hit of the tree that it was made from, bit for bit.
[[nodiscard]] ZKD_API std::optional<Hit> closest_hit(
    const WideTreeView& tree, const Ray& ray,
    Intersector intersector = Intersector::watertight) noexcept;

/// zkd::any_hit likewise.
[[nodiscard]] ZKD_API bool any_hit(const WideTreeView& tree, const Ray& ray,
                                   Intersector intersector = Intersector::watertight) noexcept;

/// zkd::closest_hit for each ray, on all threads of the executor. Of `costs`, node_visits counts
/// nodes of eight children, and triangle_tests each triangle in the blocks that were looked at.
ZKD_API void closest_hit(const Executor& executor, const WideTreeView& tree,
                         std::span<const Ray> rays, std::span<Hit> hits,
                         std::span<TraversalCost> costs = {},
                         Intersector intersector = Intersector::watertight) noexcept;

/// zkd::any_hit for each ray. As above otherwise.
ZKD_API void any_hit(const Executor& executor, const WideTreeView& tree, std::span<const Ray> rays,
                     std::span<std::uint8_t> occluded, std::span<TraversalCost> costs = {},
                     Intersector intersector = Intersector::watertight) noexcept;

}  // namespace zkd::cpu
