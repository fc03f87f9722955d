// SPDX-License-Identifier: Apache-2.0
//
// Tree hashes: every field counts, nothing else does.
#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "verify/tree_hash.hpp"

namespace zkd::verify {
namespace {

struct SmallTree {
  std::vector<Node> nodes;
  std::vector<std::uint32_t> offsets = {0, 2, 3, 5};
  std::vector<std::uint32_t> references = {4, 1, 0, 3, 2};
  TreeHeader header;

  SmallTree() {
    for (std::uint32_t i = 0; i < 2; ++i) {
      Node node{};
      for (auto& axis : node.bounds) {
        for (float& x : axis) x = static_cast<float>(i) + 0.5F;
      }
      node.child[0] = Link::leaf(i);
      node.child[1] = i == 0 ? Link::node(1) : Link::leaf(2);
      node.plane = 0.25F;
      node.axis = i;
      nodes.push_back(node);
    }
    header.leaf_count = 3;
    header.reference_count = 5;
    header.root = Link::node(0);
    for (int axis = 0; axis < 3; ++axis) header.bounds.lo[axis] = header.bounds.hi[axis] = 1.0F;
  }

  [[nodiscard]] TreeView now() const {
    return {&header, nodes.data(), offsets.data(), references.data()};
  }
};

TEST(VerifyHash, EveryFieldCounts) {
  std::set<std::string> seen;
  std::size_t changes = 0;
  const auto expect_new = [&](auto change) {
    SmallTree tree;
    change(tree);
    const std::string hash = tree_hash(tree.now());
    EXPECT_EQ(hash.size(), 32u);
    EXPECT_EQ(hash.find_first_not_of("0123456789abcdef"), std::string::npos);
    EXPECT_TRUE(seen.insert(hash).second) << "change " << changes;
    ++changes;
  };
  expect_new([](SmallTree&) {});
  expect_new([](SmallTree& t) { t.header.root = Link::node(1); });
  expect_new([](SmallTree& t) { t.header.scale = 2.0F; });
  expect_new([](SmallTree& t) { t.header.reference_count = 4; });
  expect_new([](SmallTree& t) { t.header.leaf_count = 2; });
  for (int axis = 0; axis < 3; ++axis) {
    expect_new([axis](SmallTree& t) { t.header.bounds.lo[axis] = 0.5F; });
    expect_new([axis](SmallTree& t) { t.header.bounds.hi[axis] = -0.0F; });
  }
  for (std::size_t node = 0; node < 2; ++node) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < 4; ++i) {
        expect_new([=](SmallTree& t) { t.nodes[node].bounds[axis][i] = 7.0F; });
      }
    }
    expect_new([=](SmallTree& t) { t.nodes[node].child[0].bits ^= 16U; });
    expect_new([=](SmallTree& t) { t.nodes[node].child[1].bits ^= 16U; });
    expect_new([=](SmallTree& t) { t.nodes[node].plane = 8.0F; });
    expect_new([=](SmallTree& t) { t.nodes[node].axis = 2; });
  }
  for (std::size_t i = 0; i < 4; ++i) expect_new([=](SmallTree& t) { ++t.offsets[i]; });
  for (std::size_t i = 0; i < 5; ++i) expect_new([=](SmallTree& t) { t.references[i] += 9; });
  expect_new([](SmallTree& t) { t.header = TreeHeader{}; });
}

TEST(VerifyHash, CapacityAndAddressesDoNot) {
  SmallTree one;
  SmallTree other;
  other.references.push_back(99);
  other.offsets.push_back(99);
  other.nodes.push_back(Node{});
  EXPECT_EQ(tree_hash(one.now()), tree_hash(other.now()));
}

TEST(VerifyHash, IsPinned) {
  // The order of the fields is a promise: recorded hashes outlive this program.
  SmallTree tree;
  EXPECT_EQ(tree_hash(tree.now()), "f5dd8ac055440a0f20299dc3276d5377");
  EXPECT_EQ(tree_hash(TreeView{}), "76aaa81ad3c42e239db317ccebbd3399");
}

TEST(VerifyHash, MappedIdsAndTheirOrderInALeaf) {
  SmallTree tree;
  SmallTree swapped;
  std::swap(swapped.references[0], swapped.references[1]);
  EXPECT_NE(tree_hash(tree.now()), tree_hash(swapped.now()));
  EXPECT_EQ(tree_hash_mapped(tree.now(), {}), tree_hash_mapped(swapped.now(), {}));
  // From one leaf to another is another tree.
  SmallTree moved;
  std::swap(moved.references[1], moved.references[2]);
  EXPECT_NE(tree_hash_mapped(tree.now(), {}), tree_hash_mapped(moved.now(), {}));

  const std::vector<std::uint32_t> map = {3, 0, 4, 1, 2};
  SmallTree permuted;
  for (std::uint32_t& id : permuted.references) id = map[id];
  EXPECT_EQ(tree_hash_mapped(tree.now(), map), tree_hash_mapped(permuted.now(), {}));
  EXPECT_NE(tree_hash_mapped(tree.now(), map), tree_hash_mapped(tree.now(), {}));
  EXPECT_THROW((void)tree_hash_mapped(tree.now(), std::span(map).first(4)), std::out_of_range);

  SmallTree sorted;
  sorted.references = {1, 4, 0, 2, 3};
  EXPECT_EQ(tree_hash(sorted.now()), tree_hash_mapped(tree.now(), {}));
}

}  // namespace
}  // namespace zkd::verify
