// SPDX-License-Identifier: Apache-2.0
//
// The finished tree: its memory layout, a view to pass around, and the owner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>

#include <zkd/config.hpp>
#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/options.hpp>
#include <zkd/statistics.hpp>

namespace zkd {

/// Names a child: an inner node or a leaf. `none` counts as a leaf too: where a link may be none,
/// ask is_none() first.
///
///     bit 31   1: leaf, 0: inner node
///     30..0    index into TreeView::nodes, or number of the leaf
struct Link {
  std::uint32_t bits = none;

  static constexpr std::uint32_t leaf_bit = 0x80000000u;
  static constexpr std::uint32_t none = 0xFFFFFFFFu;  ///< the root of an empty tree

  [[nodiscard]] static constexpr ZKD_HOST_DEVICE Link node(std::uint32_t index) { return {index}; }
  [[nodiscard]] static constexpr ZKD_HOST_DEVICE Link leaf(std::uint32_t index) {
    return {index | leaf_bit};
  }
  [[nodiscard]] constexpr ZKD_HOST_DEVICE bool is_none() const { return bits == none; }
  [[nodiscard]] constexpr ZKD_HOST_DEVICE bool is_leaf() const { return (bits & leaf_bit) != 0; }
  [[nodiscard]] constexpr ZKD_HOST_DEVICE std::uint32_t index() const { return bits & ~leaf_bit; }
  friend constexpr ZKD_HOST_DEVICE bool operator==(Link a, Link b) { return a.bits == b.bits; }
};

/// An inner node: an essential node of the poster, one cache line.
///
/// Node j is where trunk (leaf) j and trunk j + 1 first differ, so inner nodes stand in the order
/// of the leaves they separate; child 0 covers leaves up to j, child 1 leaves from j + 1. (So they
/// do with every builder: leaves are numbered depth first, child 0 first, and a subtree is one
/// range of leaves and one of nodes.) All positions are in tree space (TreeView::scale).
///
///     byte  0  bounds[0]  x: low of child 0, low of child 1, high of child 0, high of child 1
///          16  bounds[1]  y
///          32  bounds[2]  z
///          48  child[2]
///          56  plane      position of the split plane, exact
///          60  axis       0, 1, 2
struct alignas(64) Node {
  float bounds[3][4];  ///< tight boxes of both children; +inf, -inf for a leaf that lists nothing
  Link child[2];       ///< below and above the plane
  float plane;
  std::uint32_t axis;

  [[nodiscard]] ZKD_HOST_DEVICE float lo(int which, int along) const {
    return bounds[along][which];
  }
  [[nodiscard]] ZKD_HOST_DEVICE float hi(int which, int along) const {
    return bounds[along][2 + which];
  }
};
static_assert(sizeof(Node) == 64);

/// What a tree says about itself. It lies where the tree lies: a build on the device fills it in
/// there, and nothing has to come back to the host before rays are traced.
struct TreeHeader {
  Box bounds;          ///< tight box of all valid triangles, in the caller's units; empty for none
  float scale = 1.0F;  ///< TreeView::scale()
  Link root;           ///< a node; a leaf if there is only one; none if the tree is empty
  std::uint32_t leaf_count = 0;
  std::uint32_t reference_count = 0;
};

/// The longest path from the root to a leaf: what a stack for a walk has to hold.
inline constexpr std::uint32_t max_depth = 96;

/// A non-owning view of a finished tree: plain, to be passed to functions and kernels by value.
/// Valid as long as its owner. Arrays lie where the tree was built, on the host or the device, and
/// so does what the functions read: call those of a view of device memory on the device only.
struct TreeView {
  const TreeHeader* header = nullptr;           ///< null: an empty tree
  const Node* nodes = nullptr;                  ///< leaf_count - 1 of them (none for an empty tree)
  const std::uint32_t* leaf_offsets = nullptr;  ///< leaf_count + 1; leaf i lists references
                                                ///< [leaf_offsets[i], leaf_offsets[i + 1])
  const std::uint32_t* references = nullptr;    ///< triangle ids, leaf by leaf

  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t leaf_count() const {
    return header != nullptr ? header->leaf_count : 0;
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t node_count() const {
    return leaf_count() > 1 ? leaf_count() - 1 : 0;
  }
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t reference_count() const {
    return header != nullptr ? header->reference_count : 0;
  }
  [[nodiscard]] ZKD_HOST_DEVICE bool empty() const { return leaf_count() == 0; }

  /// See TreeHeader::root.
  [[nodiscard]] ZKD_HOST_DEVICE Link root() const {
    return header != nullptr ? header->root : Link{};
  }

  /// See TreeHeader::bounds.
  [[nodiscard]] ZKD_HOST_DEVICE Box bounds() const {
    return header != nullptr ? header->bounds : Box{};
  }

  /// Tree space: every position in `nodes` is the caller's times this power of two, 2^-126 to
  /// 2^127. It is 1 unless the scene's largest coordinate lies outside 2^-16 to 2^32; then that
  /// coordinate is brought near 1, so that products of three coordinates neither overflow nor
  /// lose digits. Scaling is exact but for what underflows: that is rounded to nearest.
  [[nodiscard]] ZKD_HOST_DEVICE float scale() const {
    return header != nullptr ? header->scale : 1.0F;
  }
};

/// Owns a finished tree in host memory: two blocks (header, nodes and leaf offsets; references)
/// from the memory resource it was built with. Movable, not copyable by accident: see clone(). A
/// tree moved from is an empty one. Reading one tree from several threads is safe.
class ZKD_API Tree {
 public:
  /// An empty tree: every ray misses.
  Tree() = default;
  Tree(Tree&& other) noexcept;
  Tree& operator=(Tree&& other) noexcept;
  Tree(const Tree&) = delete;             // a tree is megabytes: copies are spelled out
  Tree& operator=(const Tree&) = delete;  // likewise
  ~Tree();

  /// A copy whose memory comes from `memory` (null: the default resource).
  /// Throws Error out_of_memory.
  [[nodiscard]] Tree clone(std::pmr::memory_resource* memory = nullptr) const;

  /// What queries take. Valid until this tree is destroyed, assigned or moved from.
  [[nodiscard]] const TreeView& view() const noexcept { return view_; }

  [[nodiscard]] std::span<const Node> nodes() const noexcept {
    return {view_.nodes, view_.node_count()};
  }
  [[nodiscard]] std::span<const std::uint32_t> references() const noexcept {
    return {view_.references, view_.reference_count()};
  }
  /// Triangle ids that leaf `leaf` (below view().leaf_count()) lists.
  [[nodiscard]] std::span<const std::uint32_t> leaf(std::uint32_t leaf) const {
    return {view_.references + view_.leaf_offsets[leaf],
            view_.references + view_.leaf_offsets[leaf + 1]};
  }

  /// The lattice of the first round of codes; of no bits with other builders than
  /// morton.
  [[nodiscard]] const Lattice& lattice() const noexcept { return lattice_; }

  /// The options it was built with, every `automatic` replaced by what was chosen.
  [[nodiscard]] const BuildOptions& options() const noexcept { return options_; }

  [[nodiscard]] const Statistics& statistics() const noexcept { return statistics_; }

 private:
  friend struct TreeAssembler;
  struct Block {
    void* data = nullptr;
    std::size_t bytes = 0;
  };
  void swap(Tree& other) noexcept;

  TreeView view_;
  Lattice lattice_;
  BuildOptions options_;
  Statistics statistics_;
  Block node_block_;
  Block reference_block_;
  std::pmr::memory_resource* memory_ = nullptr;
};

}  // namespace zkd
