// SPDX-License-Identifier: Apache-2.0
//
// What every finished tree must fulfil, whatever the scene.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/tree.hpp>

namespace zkd::verify {

/// Checks a finished tree over `triangles`; returns what it violates, at most one message a
/// property and kind of violation, each naming the first offender. Empty: all is well.
///
/// 1. Inner nodes are leaves - 1; every node and leaf is reached once from the root; node j
///    separates leaves up to j from those behind; links and axes are in range.
/// 2. (`all`) Every plane lies strictly inside its cell, so that cells of siblings are disjoint and
///    leaf cells tile the scene box. A plane may lie on the upper face of the scene box itself:
///    the cell above it is then flat. (`sah`: on any face of a cell that is not flat itself.)
/// 3. `once`: every valid triangle is listed once, others never. `all`: every valid triangle is
///    listed in every leaf cell that it overlaps, decided exactly, at most once a leaf; in other
///    cells only where a gap of at most 1e-12 times the largest coordinate separates it. (`sah`: in
///    every leaf cell that a piece of it with an area lies in; one that lies in a plane, on either
///    side of it.)
/// 4. Leaf offsets start at 0, never decrease, and end at reference_count; no leaf of `once` is
///    empty; ids are in range.
/// 5. The scene box is the box of the valid triangles. The box of a child contains the boxes of the
///    triangles below it (`all`: each cut to its leaf cell); for `once` it is their union. Planes
///    of `once` separate centres: below child 0 centre < plane, below child 1 centre >= plane.
///    (`sah`: the box of a leaf contains what lies in its cell of the triangles it lists, decided
///    exactly, and is contained in their boxes cut to the cell; that of a node contains those of
///    its children.)
///
/// What is said of `once`, and in 2 and 5 of `all`, is the Morton builder's own. Later properties
/// are left out where an earlier one that they stand on is violated.
/// O(n log n) for `once`; O((n + references) * depth) for `all`.
[[nodiscard]] std::vector<std::string> check_tree(const Tree& tree, const TriangleView& triangles);

/// The same for a view; `references` is `once` or, for `sah` always, `all`.
[[nodiscard]] std::vector<std::string> check_tree(const TreeView& tree, References references,
                                                  const TriangleView& triangles,
                                                  Builder builder = Builder::morton);

/// Edges from the root to the deepest leaf; 0 for a single leaf and for an empty tree. The tree
/// must be well-formed (property 1). O(nodes).
[[nodiscard]] std::uint32_t tree_depth(const TreeView& tree);

}  // namespace zkd::verify
