// SPDX-License-Identifier: Apache-2.0
//
// What check_tree() finds in trees of Builder::sah that were damaged, and the predicate it rests
// on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "verify/exact.hpp"
#include "verify/properties.hpp"

namespace zkd::verify {
namespace {

constexpr Corners triangle = {{{0, 0, 0}, {4, 0, 0}, {0, 4, 4}}};

TEST(SharesArea, InsideAndOutside) {
  EXPECT_TRUE(exact_shares_area(triangle, {{-1, -1, -1}, {5, 5, 5}}));
  EXPECT_TRUE(exact_shares_area(triangle, {{0, 0, 0}, {1, 1, 1}}));
  EXPECT_FALSE(exact_shares_area(triangle, {{3, 3, 0}, {5, 5, 5}}));   // beyond an edge
  EXPECT_FALSE(exact_shares_area(triangle, {{0, 2, 0}, {1, 3, 1}}));   // below the plane
  EXPECT_FALSE(exact_shares_area(triangle, {{5, 5, 5}, {-1, 6, 6}}));  // an empty box
}

TEST(SharesArea, TouchingIsNotEnough) {
  EXPECT_FALSE(exact_shares_area(triangle, {{-1, -1, -1}, {0, 5, 5}}));  // along an edge
  EXPECT_FALSE(exact_shares_area(triangle, {{4, 0, 0}, {5, 1, 1}}));     // at a corner
  EXPECT_FALSE(exact_shares_area(triangle, {{2, 2, 2}, {3, 3, 3}}));     // at a point of an edge
  EXPECT_FALSE(exact_shares_area(triangle, {{0, 1, 0}, {1, 2, 1}}));     // along an edge of the box
  EXPECT_FALSE(exact_shares_area(triangle, {{1, 0, 0}, {1, 4, 4}}));     // a flat box across it
  const double above = std::nextafter(2.0, 3.0);
  const double below = std::nextafter(2.0, 1.0);
  EXPECT_TRUE(exact_shares_area(triangle, {{below, 2, 2}, {3, 3, 3}}) ||
              exact_shares_area(triangle, {{below, below, below}, {3, 3, 3}}));
  EXPECT_FALSE(exact_shares_area(triangle, {{above, 2, 2}, {3, 3, 3}}));
}

TEST(SharesArea, ATriangleInASideOfTheBoxDoes) {
  constexpr Corners flat = {{{0, 0, 1}, {4, 0, 1}, {0, 4, 1}}};
  EXPECT_TRUE(exact_shares_area(flat, {{0, 0, 0}, {1, 1, 1}}));
  EXPECT_TRUE(exact_shares_area(flat, {{0, 0, 1}, {1, 1, 2}}));
  EXPECT_TRUE(exact_shares_area(flat, {{0, 0, 1}, {1, 1, 1}}));
  EXPECT_FALSE(exact_shares_area(flat, {{0, 0, 1.5}, {1, 1, 2}}));
  EXPECT_FALSE(exact_shares_area(flat, {{2, 2, 0}, {4, 4, 1}}));
  EXPECT_FALSE(exact_shares_area(flat, {{4, 0, 0}, {5, 1, 1}}));
}

struct Copy {
  scene::Mesh mesh = scene::joined(scene::soup(200, 3), scene::grid(2));
  TreeHeader header;
  std::vector<Node> nodes;
  std::vector<std::uint32_t> offsets;
  std::vector<std::uint32_t> references;

  Copy() {
    const Tree tree = build(cpu::Executor{}, mesh.view(), {.builder = Builder::sah});
    const TreeView& view = tree.view();
    header = *view.header;
    nodes.assign(tree.nodes().begin(), tree.nodes().end());
    offsets.assign(view.leaf_offsets, view.leaf_offsets + view.leaf_count() + 1);
    references.assign(tree.references().begin(), tree.references().end());
  }
  [[nodiscard]] std::vector<std::string> check() const {
    return check_tree({&header, nodes.data(), offsets.data(), references.data()}, References::all,
                      mesh.view(), Builder::sah);
  }
  // Removes reference i.
  void remove(std::uint32_t i) {
    references.erase(references.begin() + i);
    for (std::uint32_t& offset : offsets) offset -= offset > i ? 1 : 0;
    --header.reference_count;
  }
};

bool names(const std::vector<std::string>& violations, const std::string& property) {
  return std::any_of(violations.begin(), violations.end(), [&](const std::string& text) {
    return text.find(property) != std::string::npos;
  });
}

TEST(SahProperties, HoldOfWhatWasBuilt) { EXPECT_TRUE(Copy().check().empty()); }

TEST(SahProperties, EveryReferenceIsNeeded) {
  const Copy whole;
  ASSERT_GT(whole.references.size(), whole.mesh.faces.size());
  std::uint32_t missed = 0;
  for (std::uint32_t i = 0; i < whole.references.size(); ++i) {
    Copy copy = whole;
    copy.remove(i);
    missed += names(copy.check(), "property 3") ? 1 : 0;
  }
  // Rounding outwards may list a triangle where none of its area is.
  EXPECT_GE(missed, whole.references.size() * 99 / 100);
}

TEST(SahProperties, BoxesHoldWhatIsInsideAndNoMore) {
  const Copy whole;
  for (std::size_t n = 0; n < whole.nodes.size(); ++n)
    for (int which = 0; which < 2; ++which)
      for (int axis = 0; axis < 3; ++axis) {
        const float size = whole.nodes[n].hi(which, axis) - whole.nodes[n].lo(which, axis);
        Copy smaller = whole;
        smaller.nodes[n].bounds[axis][which] += 0.01F * size + 1e-3F;
        EXPECT_TRUE(names(smaller.check(), "property 5")) << "node " << n;
        if (!whole.nodes[n].child[which].is_leaf()) continue;
        Copy larger = whole;
        larger.nodes[n].bounds[axis][2 + which] += 1e3F;
        EXPECT_TRUE(names(larger.check(), "property 5")) << "node " << n;
      }
}

TEST(SahProperties, PlanesLieInTheirCells) {
  Copy copy;
  copy.nodes[copy.nodes.size() / 2].plane = 1e3F;
  EXPECT_TRUE(names(copy.check(), "property 2"));
}

}  // namespace
}  // namespace zkd::verify
