// SPDX-License-Identifier: Apache-2.0
//
// What holds of trees whose references are clipped triangles (Builder::sah, Builder::wu2011),
// decided exactly. For check_tree(), which has found the tree well-formed; everything is in tree
// space.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <zkd/tree.hpp>

#include "verify/exact.hpp"

namespace zkd::verify {

struct ClippedTree {
  const TreeView& tree;
  const std::vector<std::optional<Corners>>& corners;  ///< of valid triangles
  const std::vector<ExactBox>& cells;                  ///< of leaves
};

/// Whether a triangle is listed (in the leaves `listed`, ascending) in every leaf cell that a piece
/// of it with an area lies in; where it lies in a split plane, on one side of that plane.
[[nodiscard]] bool covered(const ClippedTree& of, const ExactBox& scene, const Corners& triangle,
                           std::span<const std::uint32_t> listed);

/// Whether the box of each leaf holds what lies in its cell of the triangles that it lists and is
/// no larger than their boxes cut to the cell, and that of each node those of its children. Empty,
/// or what is wrong.
[[nodiscard]] std::string clipped_boxes(const ClippedTree& of);

}  // namespace zkd::verify
