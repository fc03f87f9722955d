// SPDX-License-Identifier: Apache-2.0
//
// What becomes of the binary tree: which of its nodes are the children of one wide node, and which
// parts of it are leaves.
//
// Parts that one block holds are leaves. Of the nodes above them, some become wide ones: those whose
// surfaces add up to the least, since the surface of a box says how many random lines meet it (Ylitie,
// Karras, Laine: Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, HPG 2017,
// section 3.1, with the leaves given). What is below a node of the tree may take one to eight
// places in a wide node above it; for each number of them the least is found from those of its two
// halves, from the leaves up.
#pragma once

#include <algorithm>
#include <cstdint>

#include <zkd/cpu/wide_tree.hpp>
#include <zkd/geometry.hpp>
#include <zkd/tree.hpp>

#include "core/area.hpp"

namespace zkd::cpu {

/// A subtree: leaves [begin, end) of the tree, of which node j separates j and j + 1.
struct Part {
  Link link;
  std::uint32_t begin;
  std::uint32_t end;

  [[nodiscard]] std::uint32_t references(const TreeView& tree) const {
    return tree.leaf_offsets[end] - tree.leaf_offsets[begin];
  }
};

/// The triangles of a part, each once, as long as they fit into a block.
class PartTriangles {
 public:
  PartTriangles(const TreeView& tree, const Part& part) {
    const std::uint32_t n = part.references(tree);
    const std::uint32_t* const first = tree.references + tree.leaf_offsets[part.begin];
    // Not more than a few times as many are looked at.
    fit_ = n <= 4 * static_cast<std::uint32_t>(wide);
    for (std::uint32_t i = 0; i < n && fit_; ++i) {
      if (std::find(ids_, ids_ + count_, first[i]) != ids_ + count_) continue;
      fit_ = count_ < static_cast<std::uint32_t>(wide);
      if (fit_) ids_[count_++] = first[i];
    }
  }
  [[nodiscard]] bool fit() const { return fit_; }
  [[nodiscard]] const std::uint32_t* ids() const { return ids_; }
  [[nodiscard]] std::uint32_t count() const { return count_; }

 private:
  bool fit_;
  std::uint32_t count_ = 0;
  std::uint32_t ids_[wide];
};

/// Whether the part is one leaf of the wide tree: one of the tree's, or no more triangles than one
/// block holds, in no more than 32 references.
inline bool is_leaf(const TreeView& tree, const Part& part) {
  return part.end - part.begin == 1 || PartTriangles(tree, part).fit();
}

/// What a node divides its part into: two parts, or one where the other lists nothing.
struct Halves {
  Part part[2] = {};
  Box box[2];
  int count = 0;

  Halves(const TreeView& tree, const Part& of) {
    const std::uint32_t index = of.link.index();
    const Node& node = tree.nodes[index];
    const Part both[2] = {{node.child[0], of.begin, index + 1}, {node.child[1], index + 1, of.end}};
    for (int which = 0; which < 2; ++which) {
      if (both[which].references(tree) == 0) continue;
      part[count] = both[which];
      for (int a = 0; a < 3; ++a) {
        box[count].lo[a] = node.lo(which, a);
        box[count].hi[a] = node.hi(which, a);
      }
      ++count;
    }
  }
};

/// For each node of the tree and each number of places for what is below it: how many of them go to
/// its first half. Nodes below leaves of the wide tree have none.
class Shares {
 public:
  Shares() = default;
  explicit Shares(std::uint32_t* of_nodes) : of_nodes_(of_nodes) {}

  /// Whether the node's part is a leaf of the wide tree.
  [[nodiscard]] bool is_leaf(std::uint32_t node) const { return of_nodes_[node] == leaf; }

  /// Whether the node is passed by, its halves taking the places: else it is a leaf or a wide node.
  [[nodiscard]] bool is_divided(std::uint32_t node, int places) const {
    return !is_leaf(node) && (of_nodes_[node] == one_half ||
                              (places > 1 && first_half(node, places) > 0));
  }
  /// Of 2 to 8 places; not where there is one half.
  [[nodiscard]] int first_half(std::uint32_t node, int places) const {
    return static_cast<int>(of_nodes_[node] >> shift(places) & 7u);
  }

  void set_leaf(std::uint32_t node) const { of_nodes_[node] = leaf; }
  void set_one_half(std::uint32_t node) const { of_nodes_[node] = one_half; }
  /// shares[k]: of k places, from 2 to 8 of them; 0: it takes one place, as a wide node.
  void set(std::uint32_t node, const int (&shares)[wide + 1]) const {
    std::uint32_t bits = 0;
    for (int places = 2; places <= wide; ++places)
      bits |= static_cast<std::uint32_t>(shares[places]) << shift(places);
    of_nodes_[node] = bits;
  }

 private:
  static int shift(int places) { return 3 * (places - 1); }
  // Of one place there is nothing to share.
  static constexpr std::uint32_t leaf = 1;
  static constexpr std::uint32_t one_half = 2;

  std::uint32_t* of_nodes_ = nullptr;
};

/// The least sum of the surfaces of all wide nodes that a part comes to; with[k]: if it takes no more
/// than k places in the node above. With one place it is a wide node itself, which counts.
struct Surfaces {
  double with[wide + 1] = {};
};

/// Finds out how places are shared.
class Collapse {
 public:
  Collapse(const TreeView& tree, const Shares& shares) : tree_(tree), shares_(shares) {}

  /// Of a part and all below it. `known(part, area, surfaces)` says whether a part's surfaces are
  /// known already, and what they are. (Calls itself, as deep as the tree: max_depth at most.)
  template <class Known>
  Surfaces solve(const Part& part, double area, const Known& known) const {
    Surfaces surfaces;
    if (part.link.is_leaf() || known(part, area, surfaces)) return surfaces;
    const std::uint32_t index = part.link.index();
    if (is_leaf(tree_, part)) {
      shares_.set_leaf(index);
      return surfaces;
    }
    const Halves halves(tree_, part);
    const Surfaces first = solve(halves.part[0], core::half_area(halves.box[0]), known);
    if (halves.count == 1) {
      shares_.set_one_half(index);
      return first;
    }
    const Surfaces second = solve(halves.part[1], core::half_area(halves.box[1]), known);

    int shares[wide + 1] = {};
    double shared[wide + 1] = {};
    for (int places = 2; places <= wide; ++places) {
      for (int share = 1; share < places; ++share) {
        const double sum = first.with[share] + second.with[places - share];
        if (share > 1 && sum >= shared[places]) continue;
        shares[places] = share;
        shared[places] = sum;
      }
    }
    surfaces.with[1] = area + shared[wide];
    for (int places = 2; places <= wide; ++places) {
      const bool alone = surfaces.with[1] < shared[places];
      if (alone) shares[places] = 0;
      surfaces.with[places] = alone ? surfaces.with[1] : shared[places];
    }
    shares_.set(index, shares);
    return surfaces;
  }

 private:
  const TreeView& tree_;
  Shares shares_;
};

/// The children of one wide node, from left to right.
class Children {
 public:
  Children(const TreeView& tree, const Shares& shares, const Part& parent)
      : tree_(tree), shares_(shares) {
    share(parent, wide);
  }

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] const Part& part(int i) const { return parts_[i]; }
  [[nodiscard]] const Box& box(int i) const { return boxes_[i]; }
  [[nodiscard]] bool is_leaf(int i) const { return leaves_[i]; }

 private:
  void share(const Part& part, int places) {
    const Halves halves(tree_, part);
    if (halves.count == 1) {
      add(halves.part[0], halves.box[0], places);
      return;
    }
    const int first = shares_.first_half(part.link.index(), places);
    add(halves.part[0], halves.box[0], first);
    add(halves.part[1], halves.box[1], places - first);
  }

  void add(const Part& part, const Box& box, int places) {
    const bool one = part.link.is_leaf();
    if (!one && shares_.is_divided(part.link.index(), places)) {
      share(part, places);
      return;
    }
    parts_[count_] = part;
    boxes_[count_] = box;
    leaves_[count_] = one || shares_.is_leaf(part.link.index());
    ++count_;
  }

  const TreeView& tree_;
  Shares shares_;
  int count_ = 0;
  Part parts_[wide];
  Box boxes_[wide];
  bool leaves_[wide];
};

}  // namespace zkd::cpu
