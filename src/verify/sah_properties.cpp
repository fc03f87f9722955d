// SPDX-License-Identifier: Apache-2.0
//
// Where clipped triangles must be listed, and what boxes must hold of them.
#include "verify/sah_properties.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace zkd::verify {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Side {
  double lo;
  double hi;
};

Side side_of(const Corners& triangle, std::size_t axis) {
  const auto [lo, hi] = std::minmax({triangle[0][axis], triangle[1][axis], triangle[2][axis]});
  return {lo, hi};
}

bool covered_below(const ClippedTree& of, const Link& link, const ExactBox& cell,
                   const Corners& triangle, std::span<const std::uint32_t> listed) {
  if (link.is_leaf()) return std::binary_search(listed.begin(), listed.end(), link.index());
  const Node& node = of.tree.nodes[link.index()];
  const auto plane = static_cast<double>(node.plane);
  ExactBox lower = cell;
  ExactBox upper = cell;
  lower.hi[node.axis] = upper.lo[node.axis] = plane;
  const auto [lo, hi] = side_of(triangle, node.axis);
  const auto in_lower = [&] { return covered_below(of, node.child[0], lower, triangle, listed); };
  const auto in_upper = [&] { return covered_below(of, node.child[1], upper, triangle, listed); };
  if (lo == plane && hi == plane) return in_lower() || in_upper();
  if (hi <= plane) return in_lower();
  if (lo >= plane) return in_upper();
  return (!exact_shares_area(triangle, lower) || in_lower()) &&
         (!exact_shares_area(triangle, upper) || in_upper());
}

// Whether the part of the triangle in the cell lies beyond `end` along an axis, above it or below.
bool reaches_beyond(const Corners& triangle, const ExactBox& cell, std::size_t axis, double end,
                    bool above) {
  const auto [lo, hi] = side_of(triangle, axis);
  if (above ? hi <= end : lo >= end) return false;
  ExactBox beyond = cell;
  if (above) {
    beyond.lo[axis] = std::max(beyond.lo[axis], end);
  } else {
    beyond.hi[axis] = std::min(beyond.hi[axis], end);
  }
  return exact_shares_area(triangle, beyond);
}

std::string leaf_box(const ClippedTree& of, const Node& node, int which) {
  const std::uint32_t leaf = node.child[which].index();
  const ExactBox& cell = of.cells[leaf];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto lo = static_cast<double>(node.lo(which, static_cast<int>(axis)));
    const auto hi = static_cast<double>(node.hi(which, static_cast<int>(axis)));
    Side widest{infinity, -infinity};
    for (std::uint32_t i = of.tree.leaf_offsets[leaf]; i < of.tree.leaf_offsets[leaf + 1]; ++i) {
      const std::uint32_t id = of.tree.references[i];
      const Corners& triangle = *of.corners[id];
      const Side own = side_of(triangle, axis);
      widest.lo = std::min(widest.lo, std::max(own.lo, cell.lo[axis]));
      widest.hi = std::max(widest.hi, std::min(own.hi, cell.hi[axis]));
      if (reaches_beyond(triangle, cell, axis, lo, false) ||
          reaches_beyond(triangle, cell, axis, hi, true)) {
        std::ostringstream text;
        text << "the box of leaf " << leaf << " does not hold what lies of triangle " << id
             << " in its cell";
        return text.str();
      }
    }
    // Scaling may have taken a coordinate out of the floats: by less than the smallest.
    if (lo < widest.lo - 0x1p-149 || hi > widest.hi + 0x1p-149) {
      std::ostringstream text;
      text << "the box of leaf " << leaf << " is larger than what it lists";
      return text.str();
    }
  }
  return {};
}

std::string node_box(const ClippedTree& of, const Node& node, int which) {
  const Node& child = of.tree.nodes[node.child[which].index()];
  for (int axis = 0; axis < 3; ++axis) {
    for (int below = 0; below < 2; ++below) {
      if (node.lo(which, axis) <= child.lo(below, axis) &&
          node.hi(which, axis) >= child.hi(below, axis)) {
        continue;
      }
      std::ostringstream text;
      text << "the box of node " << node.child[which].index() << " does not hold its child "
           << below;
      return text.str();
    }
  }
  return {};
}

}  // namespace

bool covered(const ClippedTree& of, const ExactBox& scene, const Corners& triangle,
             std::span<const std::uint32_t> listed) {
  return covered_below(of, of.tree.root(), scene, triangle, listed);
}

std::string clipped_boxes(const ClippedTree& of) {
  for (std::uint32_t index = 0; index < of.tree.node_count(); ++index) {
    const Node& node = of.tree.nodes[index];
    for (int which = 0; which < 2; ++which) {
      std::string violation =
          node.child[which].is_leaf() ? leaf_box(of, node, which) : node_box(of, node, which);
      if (!violation.empty()) return violation;
    }
  }
  return {};
}

}  // namespace zkd::verify
