// SPDX-License-Identifier: Apache-2.0
//
// Stage 8, path compression, against the complete tree: built explicitly on small lattices, and as
// a tree of all prefixes on keys of 128 bits.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "support/keys.hpp"
#include "support/plain_stages.hpp"
#include "support/platform.hpp"

namespace zkd {
namespace {

struct Compressed {
  Link root;
  std::vector<Link> children;
};

Compressed compress(const test::Keys& keys, const test::Executor& executor = test::executor(1)) {
  std::vector<std::uint8_t> levels;
  for (std::size_t j = 0; j + 1 < keys.size(); ++j) {
    levels.push_back(static_cast<std::uint8_t>(test::first_difference(keys[j], keys[j + 1])));
  }
  test::Array<Link> children(2 * levels.size());
  const Link root =
      stages::path_compression(executor, test::upload(keys), test::upload(levels), children);
  return {root, children.download()};
}

// Every node of the complete binary tree of `depth` levels, in the order of a heap: node 1 is the
// root, 2n and 2n + 1 are the children of n. Holds how many trunks lie below each node.
class CompleteTree {
 public:
  CompleteTree(const std::vector<std::uint32_t>& codes, std::uint32_t depth)
      : below_(std::size_t{2} << depth), leaf_(below_.size()) {
    for (std::uint32_t t = 0; t < codes.size(); ++t) {
      const std::size_t leaf = (std::size_t{1} << depth) + codes[t];
      leaf_[leaf] = t;
      for (std::size_t node = leaf; node >= 1; node /= 2) ++below_[node];
    }
  }

  // Leaves out redundant nodes from the top down.
  Link contract(std::size_t node, std::vector<Link>& children) const {
    if (2 * node >= below_.size()) return Link::leaf(leaf_[node]);
    if (below_[2 * node] == 0) return contract(2 * node + 1, children);
    if (below_[2 * node + 1] == 0) return contract(2 * node, children);
    const std::uint32_t essential = last(2 * node);
    children[2 * essential] = contract(2 * node, children);
    children[2 * essential + 1] = contract(2 * node + 1, children);
    return Link::node(essential);
  }

 private:
  [[nodiscard]] std::uint32_t last(std::size_t node) const {
    while (2 * node < below_.size()) node = below_[2 * node + 1] != 0 ? 2 * node + 1 : 2 * node;
    return leaf_[node];
  }

  std::vector<std::uint32_t> below_;
  std::vector<std::uint32_t> leaf_;
};

void expect_like_complete_tree(const std::vector<std::uint32_t>& codes, std::uint32_t depth) {
  test::Keys keys;
  for (const std::uint32_t code : codes) keys.push_back({std::uint64_t{code} << (64 - depth), 0});
  std::vector<Link> want(2 * (keys.size() - 1));
  const Link root = CompleteTree(codes, depth).contract(1, want);
  for (const test::Executor& executor : test::executors(2)) {
    const Compressed got = compress(keys, executor);
    ASSERT_TRUE(got.root == root);
    ASSERT_EQ(got.children.size(), want.size());
    for (std::size_t i = 0; i < want.size(); ++i) {
      ASSERT_TRUE(got.children[i] == want[i]) << "child " << i % 2 << " of node " << i / 2;
    }
  }
}

TEST(StageCompress, EverySetOfCodesOnALatticeOfSixteenCells) {
  for (std::uint32_t set = 1; set < 1u << 16; set += test::thinning * (1 + set % 3)) {
    std::vector<std::uint32_t> codes;
    for (std::uint32_t code = 0; code < 16; ++code) {
      if ((set >> code & 1u) != 0) codes.push_back(code);
    }
    expect_like_complete_tree(codes, 4);
    if (testing::Test::HasFatalFailure()) FAIL() << "set " << set;
  }
}

TEST(StageCompress, RandomCodesOnALatticeOfManyCells) {
  test::Random random(71);
  for (const std::uint32_t depth : {6u, 9u, 12u}) {
    for (const std::uint32_t spacing : {1u, 2u, 3u, 10u, 60u}) {
      std::vector<std::uint32_t> codes;
      for (std::uint32_t code = 0; code < 1u << depth; ++code) {
        if (random.one_in(spacing)) codes.push_back(code);
      }
      if (codes.empty()) continue;
      expect_like_complete_tree(codes, depth);
      if (testing::Test::HasFatalFailure()) FAIL() << depth << " levels, 1 in " << spacing;
    }
  }
}

TEST(StageCompress, KeysOfTwoRounds) {
  for (const test::NamedKeys& c : test::hard_keys()) {
    const test::Keys keys = test::without_duplicates(c.keys);
    std::vector<Link> want;
    const Link root = test::plain_compression(keys, want);
    for (const test::Executor& executor : test::executors(3)) {
      const Compressed got = compress(keys, executor);
      ASSERT_TRUE(got.root == root) << c.name;
      for (std::size_t i = 0; i < want.size(); ++i) {
        ASSERT_TRUE(got.children[i] == want[i])
            << c.name << ": child " << i % 2 << " of node " << i / 2;
      }
    }
  }
}

TEST(StageCompress, StaircasesAreAsDeepAsTheyCanBe) {
  for (const std::uint32_t lowest : {63u, 95u}) {
    for (const bool falling : {false, true}) {
      const test::Keys keys =
          falling ? test::falling_staircase_keys(lowest) : test::staircase_keys(lowest, 1);
      const Compressed got = compress(keys);
      Link at = got.root;
      std::uint32_t depth = 0;
      while (!at.is_leaf()) {
        const Link deeper = got.children[2 * at.index() + (falling ? 1 : 0)];
        const Link other = got.children[2 * at.index() + (falling ? 0 : 1)];
        EXPECT_TRUE(other.is_leaf());
        at = deeper;
        ASSERT_LE(++depth, 128u);
      }
      EXPECT_EQ(depth, lowest + 1);
    }
  }
}

TEST(StageCompress, NoTrunkAndOneTrunk) {
  EXPECT_TRUE(compress({}).root.is_none());
  EXPECT_TRUE(compress({{42, 0}}).root == Link::leaf(0));
}

TEST(StageCompress, LengthsThatDisagreeAreRefused) {
  const test::Keys keys = test::without_duplicates(test::random_keys(72, 10, 64, 0, 10));
  const test::Array<std::uint8_t> levels(keys.size() - 1);
  test::Array<Link> children(2 * (keys.size() - 1) - 1);
  EXPECT_THROW(
      (void)stages::path_compression(test::executor(), test::upload(keys), levels, children),
      Error);
}

}  // namespace
}  // namespace zkd
