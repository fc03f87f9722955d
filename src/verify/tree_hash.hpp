// SPDX-License-Identifier: Apache-2.0
//
// Two trees are the same tree exactly when their hashes are equal.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <zkd/tree.hpp>

namespace zkd::verify {

/// XXH3-128 of the tree, 32 hexadecimal digits, high half first.
///
/// What is hashed, in this order, each as four bytes, little-endian (floats by their bits):
///
///     leaf_count, reference_count, root, bounds.lo[0..2], bounds.hi[0..2], scale
///     each node:  bounds[0][0..3], bounds[1][0..3], bounds[2][0..3], child[0], child[1],
///                 plane, axis
///     leaf_offsets[0 .. leaf_count]  (nothing for an empty tree)
///     references
///
/// Live elements only: no padding, no capacity behind the end. O(size).
[[nodiscard]] std::string tree_hash(const TreeView& tree);

/// The same with ids mapped, then sorted within each leaf: equal for trees of permuted input.
/// A reference r counts as new_id_of_old[r]; an empty span leaves ids as they are. An id outside
/// the span throws std::out_of_range.
[[nodiscard]] std::string tree_hash_mapped(const TreeView& tree,
                                           std::span<const std::uint32_t> new_id_of_old);

}  // namespace zkd::verify
