// SPDX-License-Identifier: Apache-2.0
//
// Properties of trees: trees made by hand are accepted, and each way to break one is named.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "scene/mesh.hpp"
#include "verify/properties.hpp"

namespace zkd::verify {
namespace {

struct HandTree {
  scene::Mesh mesh;
  References policy = References::once;
  std::vector<Node> nodes;
  std::vector<std::uint32_t> offsets;
  std::vector<std::uint32_t> references;
  TreeHeader header;

  [[nodiscard]] TreeView now() const {
    return {&header, nodes.data(), offsets.data(), references.data()};
  }
  [[nodiscard]] std::vector<std::string> check() { return check_tree(now(), policy, mesh.view()); }
};

void add_triangle(scene::Mesh& mesh, glm::vec3 a, glm::vec3 b, glm::vec3 c) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c});
  mesh.faces.emplace_back(first, first + 1, first + 2);
}

Node node(std::uint32_t axis, float plane, Link below, Link above, const Box& low,
          const Box& high) {
  Node result{};
  for (int a = 0; a < 3; ++a) {
    result.bounds[a][0] = low.lo[a];
    result.bounds[a][1] = high.lo[a];
    result.bounds[a][2] = low.hi[a];
    result.bounds[a][3] = high.hi[a];
  }
  result.child[0] = below;
  result.child[1] = above;
  result.plane = plane;
  result.axis = axis;
  return result;
}

Box box(glm::vec3 lo, glm::vec3 hi) {
  Box result;
  for (int a = 0; a < 3; ++a) {
    result.lo[a] = lo[a];
    result.hi[a] = hi[a];
  }
  return result;
}

// Four small triangles along x, at 0, 2, 2 (stacked in z) and 4, and one without area. Leaves {0},
// {2, 1}, {3}; node 1 (x = 3) is the root.
HandTree small_once() {
  HandTree tree;
  const auto at = [&](float x, float z) {
    add_triangle(tree.mesh, {x, 0, z}, {x + 1, 0, z}, {x, 1, z + 1});
  };
  at(0, 0);
  at(2, 0);
  at(2, 2);
  at(4, 0);
  add_triangle(tree.mesh, {9, 9, 9}, {9, 9, 9}, {0, 0, 0});
  const Box first = box({0, 0, 0}, {1, 1, 1});
  const Box second = box({2, 0, 0}, {3, 1, 3});
  const Box third = box({4, 0, 0}, {5, 1, 1});
  tree.nodes = {node(0, 1.5F, Link::leaf(0), Link::leaf(1), first, second),
                node(0, 3.0F, Link::node(0), Link::leaf(2), box({0, 0, 0}, {3, 1, 3}), third)};
  tree.offsets = {0, 1, 3, 4};
  tree.references = {0, 2, 1, 3};
  tree.header.leaf_count = 3;
  tree.header.reference_count = 4;
  tree.header.root = Link::node(1);
  tree.header.bounds = box({0, 0, 0}, {5, 1, 3});
  return tree;
}

// A large triangle, x + y <= 4 in z = 0, and a small one in the corner it leaves empty. Cells: x
// below 2, and above it y below 2 and above. The large one touches the last in one point, (2, 2).
HandTree small_all() {
  HandTree tree;
  tree.policy = References::all;
  add_triangle(tree.mesh, {0, 0, 0}, {4, 0, 0}, {0, 4, 0});
  add_triangle(tree.mesh, {3, 3, 0}, {4, 3, 0}, {3, 4, 1});
  tree.nodes = {node(0, 2.0F, Link::leaf(0), Link::node(1), box({0, 0, 0}, {2, 4, 0}),
                     box({2, 0, 0}, {4, 4, 1})),
                node(1, 2.0F, Link::leaf(1), Link::leaf(2), box({2, 0, 0}, {4, 2, 0}),
                     box({2, 2, 0}, {4, 4, 1}))};
  tree.offsets = {0, 1, 2, 4};
  tree.references = {0, 0, 0, 1};
  tree.header.leaf_count = 3;
  tree.header.reference_count = 4;
  tree.header.root = Link::node(0);
  tree.header.bounds = box({0, 0, 0}, {4, 4, 1});
  return tree;
}

// `change` must be found out, first by a message that starts with `property` and holds `text`.
void expect_broken(HandTree tree, const std::function<void(HandTree&)>& change,
                   const std::string& property, const std::string& text) {
  change(tree);
  const std::vector<std::string> found = tree.check();
  ASSERT_FALSE(found.empty()) << "wanted " << property << " with " << text;
  EXPECT_EQ(found.front().find("property " + property + ": "), 0u) << found.front();
  EXPECT_NE(found.front().find(text), std::string::npos) << found.front();
}

TEST(VerifyProperties, GoodTreesAreAccepted) {
  EXPECT_EQ(small_once().check(), std::vector<std::string>());
  EXPECT_EQ(small_all().check(), std::vector<std::string>());
  EXPECT_EQ(tree_depth(small_once().now()), 2u);
  HandTree empty;
  EXPECT_EQ(empty.check(), std::vector<std::string>());
  EXPECT_EQ(tree_depth(empty.now()), 0u);
  HandTree leaf;
  add_triangle(leaf.mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  leaf.offsets = {0, 1};
  leaf.references = {0};
  leaf.header.leaf_count = leaf.header.reference_count = 1;
  leaf.header.root = Link::leaf(0);
  leaf.header.bounds = box({0, 0, 0}, {1, 1, 0});
  EXPECT_EQ(leaf.check(), std::vector<std::string>());
  leaf.policy = References::all;
  EXPECT_EQ(leaf.check(), std::vector<std::string>());
  EXPECT_EQ(tree_depth(leaf.now()), 0u);
}

TEST(VerifyProperties, TreeSpaceIsScaled) {
  for (HandTree tree : {small_once(), small_all()}) {
    tree.header.scale = 0x1p-10F;
    EXPECT_FALSE(tree.check().empty());
    for (Node& node : tree.nodes) {
      for (auto& axis : node.bounds) {
        for (float& x : axis) x *= 0x1p-10F;
      }
      node.plane *= 0x1p-10F;
    }
    EXPECT_EQ(tree.check(), std::vector<std::string>());
  }
}

TEST(VerifyProperties, Structure) {
  expect_broken(
      small_once(), [](HandTree& t) { t.header.root = Link::node(0); }, "1", "leaf 1");
  expect_broken(
      small_once(), [](HandTree& t) { t.header.root = Link::leaf(0); }, "1", "leaf 0");
  expect_broken(
      small_once(), [](HandTree& t) { t.header.root = Link{}; }, "1", "nothing");
  expect_broken(
      small_once(), [](HandTree& t) { t.nodes[0].child[0] = Link::leaf(2); }, "1", "leaf 2");
  expect_broken(
      small_once(), [](HandTree& t) { t.nodes[1].child[0] = Link::node(1); }, "1", "node 1");
  expect_broken(
      small_once(), [](HandTree& t) { t.nodes[1].child[0] = Link::node(70); }, "1", "node 70");
  expect_broken(
      small_once(), [](HandTree& t) { std::swap(t.nodes[0].child[0], t.nodes[0].child[1]); }, "1",
      "leaf 1");
  expect_broken(
      small_once(), [](HandTree& t) { t.nodes[0].axis = 3; }, "1", "axis 3");
  expect_broken(
      HandTree{}, [](HandTree& t) { t.header.root = Link::leaf(0); }, "1", "root");
}

TEST(VerifyProperties, CellsTileTheScene) {
  const auto plane = [](float x) { return [x](HandTree& t) { t.nodes[0].plane = x; }; };
  expect_broken(small_all(), plane(0.0F), "2", "node 0");
  expect_broken(small_all(), plane(-1.0F), "2", "node 0");
  expect_broken(small_all(), plane(4.5F), "2", "node 0");
  expect_broken(small_all(), plane(std::numeric_limits<float>::quiet_NaN()), "2", "node 0");
  // The second plane on the axis of the first, on the face that it made.
  expect_broken(
      small_all(), [](HandTree& t) { t.nodes[1].axis = 0; }, "2", "node 1");
}

TEST(VerifyProperties, APlaneOnTheUpperFaceOfTheScene) {
  // The second triangle lies in x = 1, and so does its cell.
  HandTree tree;
  tree.policy = References::all;
  add_triangle(tree.mesh, {0, 0, 0}, {0.5F, 0, 0}, {0, 1, 0});
  add_triangle(tree.mesh, {1, 0, 0}, {1, 1, 0}, {1, 0, 1});
  tree.nodes = {node(0, 1.0F, Link::leaf(0), Link::leaf(1), box({0, 0, 0}, {1, 1, 1}),
                     box({1, 0, 0}, {1, 1, 1}))};
  tree.offsets = {0, 2, 3};
  tree.references = {0, 1, 1};
  tree.header.leaf_count = 2;
  tree.header.reference_count = 3;
  tree.header.root = Link::node(0);
  tree.header.bounds = box({0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(tree.check(), std::vector<std::string>());
}

TEST(VerifyProperties, ReferencesOnce) {
  expect_broken(
      small_once(), [](HandTree& t) { t.references[3] = 0; }, "3",
      "triangle 0 is listed in leaf 0 and again in leaf 2");
  expect_broken(
      small_once(), [](HandTree& t) { t.references[1] = 4; }, "3", "triangle 4");
  expect_broken(
      small_once(),
      [](HandTree& t) {
        t.references = {0, 2, 3};
        t.offsets = {0, 1, 2, 3};
        t.header.reference_count = 3;
      },
      "3", "triangle 1 is listed nowhere");
  HandTree lost;
  add_triangle(lost.mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  lost.header.bounds = box({0, 0, 0}, {1, 1, 0});
  expect_broken(
      lost, [](HandTree&) {}, "3", "triangle 0");
}

TEST(VerifyProperties, ReferencesInAllCells) {
  expect_broken(
      small_all(),
      [](HandTree& t) {  // the point (2, 2)
        t.references = {0, 0, 1};
        t.offsets = {0, 1, 2, 3};
        t.header.reference_count = 3;
      },
      "3", "triangle 0 overlaps the cell of leaf 2");
  expect_broken(
      small_all(), [](HandTree& t) { t.references[3] = 0; }, "3",
      "triangle 0 is listed twice in leaf 2");
  expect_broken(
      small_all(),
      [](HandTree& t) {
        t.references = {0, 1, 0, 0, 1};
        t.offsets = {0, 2, 3, 5};
        t.header.reference_count = 5;
      },
      "3", "triangle 1 is listed in leaf 0");
  // A gap too small to matter: the large triangle ends 1e-13 short of the corner it touched.
  HandTree near = small_all();
  near.header.scale = 1.0F;
  near.mesh.positions[0] = {0, 0, -0x1p-45F};
  near.mesh.positions[1] = {4, 0, -0x1p-45F};
  near.mesh.positions[2] = {0, 4, -0x1p-45F};
  near.header.bounds.lo[2] = -0x1p-45F;
  for (Node& node : near.nodes) node.bounds[2][0] = node.bounds[2][1] = -0x1p-45F;
  for (const std::string& violation : near.check())  // its boxes are not as small as they are to be
    EXPECT_EQ(violation.find("property 3"), std::string::npos) << violation;
}

TEST(VerifyProperties, ExtraReferencesWithinTheSlack) {
  // The third corner is a hair below x = 2: the triangle is not in the cells above, by 2^-42.
  HandTree tree;
  tree.policy = References::all;
  const float below = 2.0F - 0x1p-23F;
  add_triangle(tree.mesh, {0, 0, 0}, {below, 0, 0}, {0, 1, 0});
  add_triangle(tree.mesh, {3, 0, 0}, {4, 0, 0}, {3, 1, 1});
  tree.nodes = {node(0, 2.0F, Link::leaf(0), Link::leaf(1), box({0, 0, 0}, {below, 1, 0}),
                     box({3, 0, 0}, {4, 1, 1}))};
  tree.offsets = {0, 1, 2};
  tree.references = {0, 1};
  tree.header.leaf_count = tree.header.reference_count = 2;
  tree.header.root = Link::node(0);
  tree.header.bounds = box({0, 0, 0}, {4, 1, 1});
  EXPECT_EQ(tree.check(), std::vector<std::string>());
  tree.references = {0, 0, 1};
  tree.offsets = {0, 1, 3};
  tree.header.reference_count = 3;
  expect_broken(
      tree, [](HandTree&) {}, "3", "triangle 0 is listed in leaf 1");
  // The same gap beside a coordinate of 10^6 is below the slack.
  add_triangle(tree.mesh, {3, 0, 0}, {1e6F, 0, 0}, {3, 1, 1});
  tree.references = {0, 0, 1, 2};
  tree.offsets = {0, 1, 4};
  tree.header.reference_count = 4;
  tree.header.bounds.hi[0] = tree.nodes[0].bounds[0][3] = 1e6F;
  const std::vector<std::string> found = tree.check();
  EXPECT_EQ(found, std::vector<std::string>());
}

TEST(VerifyProperties, LeafLists) {
  expect_broken(
      small_once(), [](HandTree& t) { t.offsets[0] = 1; }, "4", "leaf");
  expect_broken(
      small_once(), [](HandTree& t) { t.offsets[1] = 4; }, "4", "behind leaf 1");
  expect_broken(
      small_once(), [](HandTree& t) { t.offsets[1] = 3; }, "4", "leaf 1 is empty");
  expect_broken(
      small_once(), [](HandTree& t) { t.header.reference_count = 3; }, "4", "end at 4");
  expect_broken(
      small_once(), [](HandTree& t) { t.references[2] = 5; }, "4", "triangle 5");
  expect_broken(
      HandTree{}, [](HandTree& t) { t.header.reference_count = 1; }, "4", "1 references");
}

TEST(VerifyProperties, BoxesAndPlanes) {
  expect_broken(
      small_once(), [](HandTree& t) { t.header.bounds.hi[2] = 4; }, "5", "scene box");
  int held = 0;
  for (int which = 0; which < 2; ++which) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const float by : {-0.125F, 0.125F}) {
        const std::string text = "child " + std::to_string(which) + " of node 1";
        for (const int side : {0, 2}) {
          expect_broken(
              small_once(), [&](HandTree& t) { t.nodes[1].bounds[axis][side + which] += by; }, "5",
              text);
          // With `all` a leaf's box is what lies in its cell, or more, but no more than its
          // triangles' boxes in the cell.
          const auto change = [&](HandTree& t) { t.nodes[1].bounds[axis][side + which] += by; };
          if ((side == 0) != (by > 0)) {
            expect_broken(small_all(), change, "5", "the box of");
            continue;
          }
          HandTree smaller = small_all();
          change(smaller);
          if (smaller.check().empty())
            ++held;
          else
            expect_broken(small_all(), change, "5", "does not hold");
        }
      }
    }
  }
  EXPECT_EQ(held, 2) << "boxes of that tree which are larger than what lies in the cell";
  // Centres are at 0.5, 2.5 and 4.5; a plane on a centre belongs below it.
  const auto plane = [](float x) { return [x](HandTree& t) { t.nodes[0].plane = x; }; };
  expect_broken(small_once(), plane(0.5F), "5", "plane of node 0");
  expect_broken(small_once(), plane(2.625F), "5", "plane of node 0");
  HandTree on_centre = small_once();
  plane(2.5F)(on_centre);
  EXPECT_EQ(on_centre.check(), std::vector<std::string>());
}

}  // namespace
}  // namespace zkd::verify
