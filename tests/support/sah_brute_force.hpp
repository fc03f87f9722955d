// SPDX-License-Identifier: Apache-2.0
//
// The SAH builder by definition: every candidate plane of every node, and for each of them every
// reference. Only the clipping of a triangle to a cell is the library's own.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <zkd/options.hpp>
#include <zkd/tree.hpp>

#include "core/frame.hpp"
#include "core/sah/clip.hpp"
#include "scene/mesh.hpp"
#include "verify/exact.hpp"

namespace zkd::test {

struct PlainNode {
  std::uint32_t axis;
  float plane;
  Box boxes[2];
};

/// In the order of the tree: nodes between the leaves that they separate.
struct PlainTree {
  std::vector<PlainNode> nodes;
  std::vector<std::vector<std::uint32_t>> leaves;
};

class PlainSah {
 public:
  PlainSah(const scene::Mesh& mesh, const SahOptions& options, const Box& scene)
      : options_(options), frame_(scene), clip_(mesh.view(), frame_) {
    Cell root;
    for (std::uint32_t id = 0; id < mesh.faces.size(); ++id) {
      if (!verify::valid_triangle(mesh.view(), id)) continue;
      Item item{id, {}};
      for (int c = 0; c < 3; ++c) {
        const glm::vec3 p = mesh.positions[mesh.faces[id][c]];
        for (int a = 0; a < 3; ++a) {
          // Where scaling loses digits, outwards.
          const double x = static_cast<double>(p[a]) * frame_.scale + 0.0;
          const auto nearest = static_cast<float>(x);
          const bool above = static_cast<double>(nearest) > x;
          const bool below = static_cast<double>(nearest) < x;
          const float lo = above ? std::nextafter(nearest, -1e30F) : nearest;
          const float hi = below ? std::nextafter(nearest, 1e30F) : nearest;
          item.box.lo[a] = std::min(item.box.lo[a], lo + 0.0F);
          item.box.hi[a] = std::max(item.box.hi[a], hi + 0.0F);
        }
      }
      root.items.push_back(item);
    }
    root.cell = bounds(root.items);
    if (!root.items.empty()) grow(root);
  }

  PlainTree tree;

 private:
  struct Item {
    std::uint32_t id;
    Box box;
  };
  struct Cell {
    Box cell;
    std::vector<Item> items;
    std::uint32_t depth = 0;
  };
  struct Plane {
    double cost = std::numeric_limits<double>::infinity();
    float at = 0.0F;
    std::uint32_t axis = 0;
    bool flat_below = true;
  };

  static Box bounds(const std::vector<Item>& items) {
    Box box;
    for (const Item& item : items)
      for (int a = 0; a < 3; ++a) {
        box.lo[a] = std::min(box.lo[a], item.box.lo[a]);
        box.hi[a] = std::max(box.hi[a], item.box.hi[a]);
      }
    return box;
  }

  // Sides in the order of the library: costs are compared to the bit.
  static double area(const Box& box, std::uint32_t first) {
    double side[3];
    for (std::uint32_t a = 0; a < 3; ++a)
      side[a] = static_cast<double>(box.hi[a]) - static_cast<double>(box.lo[a]);
    const double x = side[first];
    const double y = side[first == 0 ? 1 : 0];
    const double z = side[first == 2 ? 1 : 2];
    return x * y + y * z + z * x;
  }

  // What the two sides of a plane list, boxes cut at the plane and not yet clipped.
  static void divide(const Cell& cell, const Plane& plane, std::vector<Item> (&sides)[2]) {
    for (const Item& item : cell.items) {
      const float lo = item.box.lo[plane.axis];
      const float hi = item.box.hi[plane.axis];
      const bool flat = lo == plane.at && hi == plane.at;
      const bool below = flat ? plane.flat_below : lo < plane.at;
      const bool above = flat ? !plane.flat_below : hi > plane.at;
      if (below) {
        sides[0].push_back(item);
        sides[0].back().box.hi[plane.axis] = std::min(hi, plane.at);
      }
      if (above) {
        sides[1].push_back(item);
        sides[1].back().box.lo[plane.axis] = std::max(lo, plane.at);
      }
    }
  }

  [[nodiscard]] double cost(const Cell& cell, const Plane& plane) const {
    std::vector<Item> sides[2];
    divide(cell, plane, sides);
    const auto visit = static_cast<double>(options_.visit_cost);
    const auto test = static_cast<double>(options_.test_cost);
    if (options_.areas == SahAreas::tight) {
      double sum = visit * area(bounds(cell.items), 0);
      for (const auto& side : sides)
        if (!side.empty())
          sum += test * (area(bounds(side), plane.axis) * static_cast<double>(side.size()));
      return sum;
    }
    Box halves[2] = {cell.cell, cell.cell};
    halves[0].hi[plane.axis] = halves[1].lo[plane.axis] = plane.at;
    const double sum = visit * area(cell.cell, plane.axis) +
                       test * (area(halves[0], plane.axis) * static_cast<double>(sides[0].size()) +
                               area(halves[1], plane.axis) * static_cast<double>(sides[1].size()));
    const bool cuts_off = sides[0].empty() || sides[1].empty();
    return cuts_off ? sum * (1.0 - static_cast<double>(options_.empty_bonus)) : sum;
  }

  [[nodiscard]] Plane best(const Cell& cell) const {
    Plane found;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      std::vector<float> positions;
      for (const Item& item : cell.items) {
        positions.push_back(item.box.lo[axis]);
        positions.push_back(item.box.hi[axis]);
      }
      std::sort(positions.begin(), positions.end());
      positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
      for (const float at : positions) {
        const bool inside = cell.cell.lo[axis] < at && at < cell.cell.hi[axis];
        const bool any_flat = std::any_of(cell.items.begin(), cell.items.end(), [&](const Item& i) {
          return i.box.lo[axis] == at && i.box.hi[axis] == at;
        });
        const bool in_face = options_.areas == SahAreas::tight && any_flat &&
                             cell.cell.lo[axis] < cell.cell.hi[axis];
        if (!inside && !in_face) continue;
        for (const bool flat_below : {true, false}) {
          Plane plane{0.0, at, axis, flat_below};
          plane.cost = cost(cell, plane);
          if (plane.cost < found.cost) found = plane;
        }
      }
    }
    return found;
  }

  void grow(const Cell& cell) {
    const Plane plane = best(cell);
    const Box measured = options_.areas == SahAreas::tight ? bounds(cell.items) : cell.cell;
    const double leaf = static_cast<double>(options_.test_cost) *
                        (area(measured, 0) * static_cast<double>(cell.items.size()));
    if (cell.depth == max_depth || !(plane.cost < leaf)) {
      std::vector<std::uint32_t>& ids = tree.leaves.emplace_back();
      for (const Item& item : cell.items) ids.push_back(item.id);
      return;
    }
    std::vector<Item> sides[2];
    divide(cell, plane, sides);
    Cell children[2];
    for (int which = 0; which < 2; ++which) {
      Cell& child = children[which];
      child.depth = cell.depth + 1;
      child.cell = cell.cell;
      (which == 0 ? child.cell.hi : child.cell.lo)[plane.axis] = plane.at;
      for (Item item : sides[which]) {
        const Box& before = std::find_if(cell.items.begin(), cell.items.end(), [&](const Item& i) {
                              return i.id == item.id;
                            })->box;
        const bool cut = before.lo[plane.axis] < plane.at && before.hi[plane.axis] > plane.at;
        if (!cut || clip_(item.id, child.cell, item.box)) child.items.push_back(item);
      }
    }
    grow(children[0]);
    tree.nodes.push_back(
        {plane.axis, plane.at, {bounds(children[0].items), bounds(children[1].items)}});
    grow(children[1]);
  }

  SahOptions options_;
  core::SceneFrame frame_;
  core::sah::Clipper clip_;
};

}  // namespace zkd::test
