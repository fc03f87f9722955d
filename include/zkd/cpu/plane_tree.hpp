// SPDX-License-Identifier: Apache-2.0
//
// A third form of a finished tree, for rays on the CPU: the kd-tree of the textbooks, split planes
// alone, in nodes of eight bytes (Wald, Realtime Ray Tracing and Interactive Global Illumination,
// 2004, section 7.2; Pharr, Jakob, Humphreys, Physically Based Rendering, 2016, section 4.4).
//
// It is the smallest form, for programs with more triangles than memory. It is only for strict
// trees (References::all, Builder::sah and wu2011): where a leaf lists what its cell holds, a ray
// needs no box. `strip_boxes` makes it, and every answer through it has the bits of the query on
// the tree itself (zkd/query.hpp, whose rules hold here word for word).
//
// Trees of Builder::sah with SahOptions{.test_cost = 1, .areas = SahAreas::cells, .empty_bonus =
// 0.2} are made for it: on Sibenik one of 2.9 MB (9.1 with boxes) traced primary, diffuse and
// shadow rays at 1.5, 1.1 and 1.8 times the speed of the tree itself, on Bunny at 1.6, 1.2 and 1.6
// times. Other trees count on their tight boxes to cut off what is empty: through their planes
// alone rays take 1.4 to 6 times as long.
//
// It does not need the tree any more, and keeps its references, but no copy of the triangles:
// queries take them as those on a Tree do.
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

/// An inner node or a leaf. Nodes are in depth-first order, the one below a plane right behind the
/// one that has it.
///
///     value  inner: the plane in tree space (TreeView::scale), a float's bits
///            leaf: the number of its first reference
///     bits   1..0   the plane's axis 0, 1, 2; 3: a leaf
///            31..2  inner: the number of the node above the plane
///                   leaf: how many references it lists
struct PlaneNode {
  std::uint32_t value;
  std::uint32_t bits;

  static constexpr std::uint32_t leaf = 3;
  static constexpr std::uint32_t most = (std::uint32_t{1} << 30) - 1;  ///< in bits 31..2

  [[nodiscard]] bool is_leaf() const { return (bits & 3u) == leaf; }
  [[nodiscard]] std::uint32_t axis() const { return bits & 3u; }
  [[nodiscard]] std::uint32_t above_or_count() const { return bits >> 2; }
};
static_assert(sizeof(PlaneNode) == 8);

/// A non-owning view of a plane tree: plain, valid as long as its owner.
struct PlaneTreeView {
  const TreeHeader* header = nullptr;         ///< that of the tree; null: empty
  const PlaneNode* nodes = nullptr;           ///< 2 * leaf_count - 1, from the root
  const std::uint32_t* references = nullptr;  ///< triangle ids, leaf by leaf
  Box bounds;                                 ///< of the scene, in tree space

  [[nodiscard]] std::uint32_t node_count() const {
    return header != nullptr ? 2 * header->leaf_count - 1 : 0;
  }
};

/// Owns a plane tree. Of bytes() there are 16 for each leaf and 4 for each reference, where the
/// tree has 68 and 4.
using PlaneTree = TreeForm<PlaneTreeView>;

/// The planes of a strict tree, whoever built it, in host memory. Bytes are the same for any number
/// of threads and instruction set.
///
/// Takes from `executor.memory` what the result holds and, while it works, at most 512 KB besides.
/// O(leaves + references) work.
///
/// Throws Error: unsupported_option for a tree whose cells do not hold its triangles (References::
/// once and budget); invalid_option as build(); too_many_references for more than 2^29 leaves, or
/// 2^30 - 1 references in one; out_of_memory. Then nothing is held.
[[nodiscard]] ZKD_API PlaneTree strip_boxes(const Executor& executor, const Tree& tree);

/// zkd::closest_hit of the tree that it was made from, bit for bit. `triangles` are those that it
/// was built from.
[[nodiscard]] ZKD_API std::optional<Hit> closest_hit(
    const PlaneTreeView& tree, const TriangleView& triangles, const Ray& ray,
    Intersector intersector = Intersector::watertight) noexcept;

/// zkd::any_hit likewise.
[[nodiscard]] ZKD_API bool any_hit(const PlaneTreeView& tree, const TriangleView& triangles,
                                   const Ray& ray,
                                   Intersector intersector = Intersector::watertight) noexcept;

/// zkd::closest_hit for each ray, on all threads of the executor. Of `costs`, node_visits counts
/// inner nodes, and triangle_tests a triangle for each leaf that lists it.
ZKD_API void closest_hit(const Executor& executor, const PlaneTreeView& tree,
                         const TriangleView& triangles, std::span<const Ray> rays,
                         std::span<Hit> hits, std::span<TraversalCost> costs = {},
                         Intersector intersector = Intersector::watertight) noexcept;

/// zkd::any_hit for each ray. As above otherwise.
ZKD_API void any_hit(const Executor& executor, const PlaneTreeView& tree,
                     const TriangleView& triangles, std::span<const Ray> rays,
                     std::span<std::uint8_t> occluded, std::span<TraversalCost> costs = {},
                     Intersector intersector = Intersector::watertight) noexcept;

}  // namespace zkd::cpu
