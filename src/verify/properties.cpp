// SPDX-License-Identifier: Apache-2.0
//
// What every finished tree must fulfil, one function a property.
#include "verify/properties.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <sstream>

#include "verify/exact.hpp"
#include "verify/sah_properties.hpp"

namespace zkd::verify {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
// Of the largest coordinate, for references that need not be (core::overlap_slack and roundings).
constexpr double slack = 1e-12;

constexpr char axis_name[] = "xyz";

ExactBox empty_box() { return {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}}; }

void grow(ExactBox& box, const ExactBox& by) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.lo[axis] = std::min(box.lo[axis], by.lo[axis]);
    box.hi[axis] = std::max(box.hi[axis], by.hi[axis]);
  }
}

bool empty(const ExactBox& box) {
  return !(box.lo[0] <= box.hi[0] && box.lo[1] <= box.hi[1] && box.lo[2] <= box.hi[2]);
}

ExactBox box_of(const Corners& corners) {
  ExactBox box = empty_box();
  for (const Point& corner : corners) grow(box, {corner, corner});
  return box;
}

// Whether the tree's float is x; where scaling took x out of the floats, whether it is one of the
// two floats about x.
bool is_nearly(float stored, double x) {
  const auto exact = static_cast<double>(stored);
  const bool lost = std::isfinite(x) && static_cast<double>(static_cast<float>(x)) != x;
  return exact == x || (lost && std::abs(exact - x) < 0x1p-149);
}

class Checker {
 public:
  Checker(const TreeView& tree, References references, const TriangleView& triangles,
          Builder builder)
      : tree_(tree),
        triangles_(triangles),
        strict_(references == References::all),
        sah_(builder != Builder::morton),
        scale_(static_cast<double>(tree.scale())) {}

  std::vector<std::string> run() {
    measure_triangles();
    structure();
    leaf_lists();
    scene_box();
    if (!messages_.empty() || tree_.empty()) {
      if (tree_.empty()) nothing_lost();
      return std::move(messages_);
    }
    if (strict_) {
      cells();
      if (messages_.empty()) listed_where_it_overlaps();
    } else {
      listed_once();
    }
    if (messages_.empty() && !sah_) child_boxes();
    if (messages_.empty() && sah_) report_if(5, clipped_boxes({tree_, corners_, cells_}));
    if (messages_.empty() && !strict_) planes_separate_centres();
    return std::move(messages_);
  }

 private:
  // A subtree and the leaves it must cover.
  struct Subtree {
    Link link;
    std::uint32_t first;
    std::uint32_t last;
  };

  template <class... Parts>
  void report(int property, const Parts&... parts) {
    std::ostringstream text;
    text.precision(17);
    text << "property " << property << ": ";
    (text << ... << parts);
    messages_.push_back(text.str());
  }

  void report_if(int property, const std::string& violation) {
    if (!violation.empty()) report(property, violation);
  }

  // All positions from here on are in tree space.
  void measure_triangles() {
    corners_.resize(triangles_.triangle_count);
    scene_ = empty_box();
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      corners_[i] = finite_corners(triangles_, i);
      if (corners_[i] && exact_zero_area(*corners_[i])) corners_[i].reset();
      if (!corners_[i]) continue;
      for (Point& corner : *corners_[i]) {
        for (double& x : corner) x *= scale_;
      }
      grow(scene_, box_of(*corners_[i]));
    }
  }

  void structure() {
    const std::uint32_t leaves = tree_.leaf_count();
    if (leaves == 0) {
      if (!tree_.root().is_none()) report(1, "a tree without leaves has a root");
      return;
    }
    std::vector<Subtree> stack{{tree_.root(), 0, leaves - 1}};
    while (!stack.empty()) {
      const auto [link, first, last] = stack.back();
      stack.pop_back();
      const bool is_right = first == last
                                ? link == Link::leaf(first)
                                : !link.is_leaf() && link.index() >= first && link.index() < last;
      if (!is_right) {
        report(1, "the link that must cover leaves ", first, " to ", last, " names ",
               link.is_none()   ? "nothing"
               : link.is_leaf() ? "leaf "
                                : "node ",
               link.is_none() ? std::string() : std::to_string(link.index()));
        return;
      }
      if (first == last) continue;
      const std::uint32_t index = link.index();
      const Node& node = tree_.nodes[index];
      if (node.axis > 2) {
        report(1, "node ", index, " splits axis ", node.axis);
        return;
      }
      order_.push_back(index);
      stack.push_back({node.child[1], index + 1, last});
      stack.push_back({node.child[0], first, index});
    }
  }

  void leaf_lists() {
    const std::uint32_t leaves = tree_.leaf_count();
    if (leaves == 0) {
      if (tree_.reference_count() != 0) {
        report(4, "a tree without leaves has ", tree_.reference_count(), " references");
      }
      return;
    }
    const std::uint32_t* offsets = tree_.leaf_offsets;
    if (offsets[0] != 0) report(4, "leaf_offsets[0] is ", offsets[0], ", not 0");
    for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
      if (offsets[leaf + 1] < offsets[leaf]) {
        report(4, "leaf_offsets decrease behind leaf ", leaf);
        return;
      }
      if (!strict_ && offsets[leaf + 1] == offsets[leaf]) {
        report(4, "leaf ", leaf, " is empty");
        return;
      }
    }
    if (offsets[leaves] != tree_.reference_count()) {
      report(4, "leaf_offsets end at ", offsets[leaves], ", but there are ",
             tree_.reference_count(), " references");
      return;
    }
    for (std::uint32_t i = 0; i < tree_.reference_count(); ++i) {
      if (tree_.references[i] >= triangles_.triangle_count) {
        report(4, "reference ", i, " names triangle ", tree_.references[i], " of ",
               triangles_.triangle_count);
        return;
      }
    }
  }

  void scene_box() {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Both infinities of an empty box survive the scale.
      if (static_cast<double>(tree_.bounds().lo[axis]) * scale_ != scene_.lo[axis] ||
          static_cast<double>(tree_.bounds().hi[axis]) * scale_ != scene_.hi[axis]) {
        report(5, "the scene box is ", tree_.bounds().lo[axis], " to ", tree_.bounds().hi[axis],
               " along ", axis_name[axis], ", the valid triangles are ", scene_.lo[axis] / scale_,
               " to ", scene_.hi[axis] / scale_);
        return;
      }
    }
  }

  void nothing_lost() {
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (corners_[i]) {
        report(3, "triangle ", i, " is valid, but the tree is empty");
        return;
      }
    }
  }

  void listed_once() {
    constexpr std::uint32_t nowhere = 0xFFFFFFFFU;
    std::vector<std::uint32_t> leaf_of(corners_.size(), nowhere);
    for (std::uint32_t leaf = 0; leaf < tree_.leaf_count(); ++leaf) {
      for (std::uint32_t i = tree_.leaf_offsets[leaf]; i < tree_.leaf_offsets[leaf + 1]; ++i) {
        const std::uint32_t triangle = tree_.references[i];
        if (!corners_[triangle]) {
          report(3, "leaf ", leaf, " lists triangle ", triangle, ", which is not valid");
          return;
        }
        if (leaf_of[triangle] != nowhere) {
          report(3, "triangle ", triangle, " is listed in leaf ", leaf_of[triangle],
                 " and again in leaf ", leaf);
          return;
        }
        leaf_of[triangle] = leaf;
      }
    }
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (corners_[i] && leaf_of[i] == nowhere) {
        report(3, "triangle ", i, " is listed nowhere");
        return;
      }
    }
  }

  // Cells of all leaves, from the scene box down. Every plane lies strictly inside its cell, which
  // is all it takes for leaf cells to tile the scene box.
  void cells() {
    struct Entry {
      Link link;
      ExactBox cell;
      bool cut[3];  // the upper face is a plane, not the scene box's own
    };
    cells_.resize(tree_.leaf_count());
    std::vector<Entry> stack{{tree_.root(), scene_, {false, false, false}}};
    while (!stack.empty()) {
      const Entry entry = stack.back();
      stack.pop_back();
      if (entry.link.is_leaf()) {
        cells_[entry.link.index()] = entry.cell;
        continue;
      }
      const Node& node = tree_.nodes[entry.link.index()];
      const auto plane = static_cast<double>(node.plane);
      const double lo = entry.cell.lo[node.axis];
      const double hi = entry.cell.hi[node.axis];
      const bool inside =
          sah_ ? lo <= plane && plane <= hi && lo < hi
               : lo < plane && (plane < hi || (plane == hi && !entry.cut[node.axis]));
      if (!inside) {
        report(2, "the plane of node ", entry.link.index(), ", ", axis_name[node.axis], " = ",
               node.plane, ", is not inside its cell, ", lo, " to ", hi);
        return;
      }
      Entry below = entry;
      below.link = node.child[0];
      below.cell.hi[node.axis] = plane;
      below.cut[node.axis] = true;
      Entry above = entry;
      above.link = node.child[1];
      above.cell.lo[node.axis] = plane;
      stack.push_back(above);
      stack.push_back(below);
    }
  }

  // Leaves whose cells triangle `triangle` overlaps, ascending. A cell is tested exactly only
  // behind a plane that the triangle's box straddles: else the triangle's part in the parent's cell
  // is its part in the child's.
  void overlapped_leaves(std::size_t triangle, std::vector<std::uint32_t>& leaves) {
    struct Entry {
      Link link;
      ExactBox cell;
    };
    const Corners& corners = *corners_[triangle];
    const ExactBox box = box_of(corners);
    leaves.clear();
    std::vector<Entry> stack{{tree_.root(), scene_}};
    while (!stack.empty()) {
      const Entry entry = stack.back();
      stack.pop_back();
      if (entry.link.is_leaf()) {
        leaves.push_back(entry.link.index());
        continue;
      }
      const Node& node = tree_.nodes[entry.link.index()];
      const auto plane = static_cast<double>(node.plane);
      Entry below = entry;
      below.link = node.child[0];
      below.cell.hi[node.axis] = plane;
      Entry above = entry;
      above.link = node.child[1];
      above.cell.lo[node.axis] = plane;
      const bool in_below = box.lo[node.axis] <= plane;
      const bool in_above = box.hi[node.axis] >= plane;
      const bool straddles = in_below && in_above;
      if (in_above && (!straddles || exact_overlap(corners, above.cell))) stack.push_back(above);
      if (in_below && (!straddles || exact_overlap(corners, below.cell))) stack.push_back(below);
    }
  }

  void listed_where_it_overlaps() {
    // leaves_of[first[t] .. first[t + 1]): where triangle t is listed, ascending.
    std::vector<std::uint32_t> first(corners_.size() + 1, 0);
    for (std::uint32_t i = 0; i < tree_.reference_count(); ++i) ++first[tree_.references[i] + 1];
    for (std::size_t i = 0; i < corners_.size(); ++i) first[i + 1] += first[i];
    std::vector<std::uint32_t> leaves_of(tree_.reference_count());
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t leaf = 0; leaf < tree_.leaf_count(); ++leaf) {
      for (std::uint32_t i = tree_.leaf_offsets[leaf]; i < tree_.leaf_offsets[leaf + 1]; ++i) {
        leaves_of[next[tree_.references[i]]++] = leaf;
      }
    }

    double largest = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      largest = std::max({largest, std::abs(scene_.lo[axis]), std::abs(scene_.hi[axis])});
    }
    std::vector<std::uint32_t> wanted;
    std::vector<std::uint32_t> listed;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      const auto begin = leaves_of.begin() + first[i];
      const auto end = leaves_of.begin() + first[i + 1];
      if (!corners_[i]) {
        if (begin == end) continue;
        report(3, "leaf ", *begin, " lists triangle ", i, ", which is not valid");
        return;
      }
      const auto twice = std::adjacent_find(begin, end);
      if (twice != end) {
        report(3, "triangle ", i, " is listed twice in leaf ", *twice);
        return;
      }
      if (sah_) {
        listed.assign(begin, end);
        if (!covered({tree_, corners_, cells_}, scene_, *corners_[i], listed)) {
          report(3, "triangle ", i, " is not listed everywhere that a piece of it lies");
          return;
        }
      }
      overlapped_leaves(i, wanted);
      for (const std::uint32_t leaf : wanted) {
        if (!sah_ && !std::binary_search(begin, end, leaf)) {
          report(3, "triangle ", i, " overlaps the cell of leaf ", leaf,
                 ", but is not listed there");
          return;
        }
      }
      for (auto leaf = begin; leaf != end; ++leaf) {
        if (std::binary_search(wanted.begin(), wanted.end(), *leaf)) continue;
        const double gap = separation(*corners_[i], cells_[*leaf]);
        // The test is coarser where the products of the normal cancel.
        if (gap > slack * largest && gap > slack * largest * normal_condition(*corners_[i])) {
          report(3, "triangle ", i, " is listed in leaf ", *leaf, ", but is ", gap,
                 " away from its cell");
          return;
        }
      }
    }
  }

  // What is inside each child, from the leaves up: bounds(triangles of a leaf) united.
  template <class LeafBox>
  std::vector<std::array<ExactBox, 2>> climb(const LeafBox& leaf_box) const {
    std::vector<std::array<ExactBox, 2>> inside(tree_.node_count());
    for (auto at = order_.rbegin(); at != order_.rend(); ++at) {
      for (std::size_t which = 0; which < 2; ++which) {
        const Link child = tree_.nodes[*at].child[which];
        ExactBox& box = inside[*at][which];
        if (child.is_leaf()) {
          box = leaf_box(child.index());
        } else {
          box = inside[child.index()][0];
          grow(box, inside[child.index()][1]);
        }
      }
    }
    return inside;
  }

  void child_boxes() {
    const auto inside = climb([this](std::uint32_t leaf) {
      ExactBox box = empty_box();
      for (std::uint32_t i = tree_.leaf_offsets[leaf]; i < tree_.leaf_offsets[leaf + 1]; ++i) {
        ExactBox part = box_of(*corners_[tree_.references[i]]);
        if (strict_) {
          for (std::size_t axis = 0; axis < 3; ++axis) {
            part.lo[axis] = std::max(part.lo[axis], cells_[leaf].lo[axis]);
            part.hi[axis] = std::min(part.hi[axis], cells_[leaf].hi[axis]);
          }
          // Listed within the slack only: nothing of it is here.
          if (empty(part)) continue;
        }
        grow(box, part);
      }
      return box;
    });
    for (std::uint32_t index = 0; index < tree_.node_count(); ++index) {
      for (int which = 0; which < 2; ++which) {
        const ExactBox& box = inside[index][static_cast<std::size_t>(which)];
        for (int axis = 0; axis < 3; ++axis) {
          const float lo = tree_.nodes[index].lo(which, axis);
          const float hi = tree_.nodes[index].hi(which, axis);
          const double need_lo = box.lo[static_cast<std::size_t>(axis)];
          const double need_hi = box.hi[static_cast<std::size_t>(axis)];
          const bool contains = (static_cast<double>(lo) <= need_lo || is_nearly(lo, need_lo)) &&
                                (static_cast<double>(hi) >= need_hi || is_nearly(hi, need_hi));
          const bool tight = strict_ || (is_nearly(lo, need_lo) && is_nearly(hi, need_hi));
          if (contains && tight) continue;
          report(5, "child ", which, " of node ", index, " has its box from ", lo, " to ", hi,
                 " along ", axis_name[axis], ", its triangles reach from ", need_lo, " to ",
                 need_hi);
          return;
        }
      }
    }
  }

  void planes_separate_centres() {
    const auto centres = climb([this](std::uint32_t leaf) {
      ExactBox box = empty_box();
      for (std::uint32_t i = tree_.leaf_offsets[leaf]; i < tree_.leaf_offsets[leaf + 1]; ++i) {
        const ExactBox part = box_of(*corners_[tree_.references[i]]);
        Point centre{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          centre[axis] = 0.5 * (part.lo[axis] + part.hi[axis]);
        }
        grow(box, {centre, centre});
      }
      return box;
    });
    for (std::uint32_t index = 0; index < tree_.node_count(); ++index) {
      const Node& node = tree_.nodes[index];
      const auto plane = static_cast<double>(node.plane);
      const double below = centres[index][0].hi[node.axis];
      const double above = centres[index][1].lo[node.axis];
      if (below < plane && above >= plane) continue;
      report(5, "the plane of node ", index, ", ", axis_name[node.axis], " = ", node.plane,
             ", does not separate centres up to ", below, " from centres from ", above);
      return;
    }
  }

  const TreeView tree_;
  const TriangleView triangles_;
  const bool strict_;
  const bool sah_;
  const double scale_;
  std::vector<std::string> messages_;
  std::vector<std::optional<Corners>> corners_;  // of valid triangles
  ExactBox scene_{};
  std::vector<std::uint32_t> order_;  // nodes, each before those below it
  std::vector<ExactBox> cells_;       // of leaves
};

}  // namespace

std::vector<std::string> check_tree(const Tree& tree, const TriangleView& triangles) {
  return check_tree(tree.view(), tree.options().references, triangles, tree.options().builder);
}

std::vector<std::string> check_tree(const TreeView& tree, References references,
                                    const TriangleView& triangles, Builder builder) {
  return Checker(tree, references, triangles, builder).run();
}

std::uint32_t tree_depth(const TreeView& tree) {
  struct Entry {
    Link link;
    std::uint32_t depth;
  };
  std::uint32_t deepest = 0;
  std::vector<Entry> stack;
  if (!tree.empty()) stack.push_back({tree.root(), 0});
  while (!stack.empty()) {
    const Entry entry = stack.back();
    stack.pop_back();
    deepest = std::max(deepest, entry.depth);
    if (entry.link.is_leaf()) continue;
    for (const Link child : tree.nodes[entry.link.index()].child) {
      stack.push_back({child, entry.depth + 1});
    }
  }
  return deepest;
}

}  // namespace zkd::verify
