// SPDX-License-Identifier: Apache-2.0
//
// What becomes of the binary tree: which of its nodes are the children of one wide node, and which
// parts of it are leaves.
#pragma once

#include <algorithm>
#include <cstdint>

#include <zkd/cpu/wide_tree.hpp>
#include <zkd/geometry.hpp>
#include <zkd/tree.hpp>

namespace zkd::cpu {

/// A subtree: leaves [begin, end) of the tree, of which node j separates j and j + 1.
struct Part {
  Link link;
  std::uint32_t begin;
  std::uint32_t end;
};

/// The children of one wide node, from left to right.
class Children {
 public:
  Children(const TreeView& tree, const Part& parent) : tree_(tree) {
    open(parent, 0);
    while (count_ < wide) {
      const int largest = largest_to_open();
      if (largest < 0) break;
      const Part part = parts_[largest];
      remove(largest);
      open(part, largest);
    }
  }

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] const Part& part(int i) const { return parts_[i]; }
  [[nodiscard]] const Box& box(int i) const { return boxes_[i]; }
  [[nodiscard]] bool is_leaf(int i) const { return leaves_[i]; }

  /// Whether the part is one leaf of the wide tree: one of the tree's, or so few triangles, however
  /// often they are referenced, that they are one block.
  static bool is_leaf(const TreeView& tree, const Part& part) {
    return part.end - part.begin == 1 || Triangles(tree, part).fit();
  }

  /// The triangles of a part, each once, as long as they fit into a block.
  class Triangles {
   public:
    Triangles(const TreeView& tree, const Part& part) {
      const std::uint32_t n = references(tree, part);
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

  static std::uint32_t references(const TreeView& tree, const Part& part) {
    return tree.leaf_offsets[part.end] - tree.leaf_offsets[part.begin];
  }

 private:
  // Puts the two children of a part at place `at`; those that list nothing are left out.
  void open(const Part& part, int at) {
    const std::uint32_t index = part.link.index();
    const Node& node = tree_.nodes[index];
    const Part halves[2] = {{node.child[0], part.begin, index + 1},
                            {node.child[1], index + 1, part.end}};
    for (int which = 0; which < 2; ++which) {
      if (references(tree_, halves[which]) == 0) continue;
      for (int i = count_; i > at; --i) {
        parts_[i] = parts_[i - 1];
        boxes_[i] = boxes_[i - 1];
        leaves_[i] = leaves_[i - 1];
      }
      parts_[at] = halves[which];
      leaves_[at] = is_leaf(tree_, halves[which]);
      for (int a = 0; a < 3; ++a) {
        boxes_[at].lo[a] = node.lo(which, a);
        boxes_[at].hi[a] = node.hi(which, a);
      }
      ++count_;
      ++at;
    }
  }

  void remove(int at) {
    --count_;
    for (int i = at; i < count_; ++i) {
      parts_[i] = parts_[i + 1];
      boxes_[i] = boxes_[i + 1];
      leaves_[i] = leaves_[i + 1];
    }
  }

  // The first of the largest that is no leaf; -1: all are.
  [[nodiscard]] int largest_to_open() const {
    int largest = -1;
    float most = -1.0F;
    for (int i = 0; i < count_; ++i) {
      if (is_leaf(i)) continue;
      const float* lo = boxes_[i].lo;
      const float* hi = boxes_[i].hi;
      const float x = hi[0] - lo[0];
      const float y = hi[1] - lo[1];
      const float z = hi[2] - lo[2];
      const float area = x * y + y * z + z * x;
      if (area <= most) continue;
      most = area;
      largest = i;
    }
    return largest;
  }

  const TreeView& tree_;
  int count_ = 0;
  Part parts_[wide + 1];
  Box boxes_[wide + 1];
  bool leaves_[wide + 1];
};

}  // namespace zkd::cpu
