// SPDX-License-Identifier: Apache-2.0
//
// Stage 7, essential nodes, against the definition by prefixes: the level at which neighbouring
// trunks first differ.
#include <gtest/gtest.h>

#include <vector>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "support/keys.hpp"
#include "support/plain_stages.hpp"
#include "support/platform.hpp"

namespace zkd {
namespace {

TEST(StageEssential, IsWhereNeighboursFirstDiffer) {
  for (const test::NamedKeys& c : test::hard_keys()) {
    const test::Keys keys = test::without_duplicates(c.keys);
    if (keys.empty()) continue;
    std::vector<std::uint8_t> want;
    for (std::size_t j = 0; j + 1 < keys.size(); ++j) {
      want.push_back(static_cast<std::uint8_t>(test::first_difference(keys[j], keys[j + 1])));
    }
    for (const test::Executor& executor : test::executors(3)) {
      test::Array<std::uint8_t> levels(want.size(), 255);
      stages::essential_nodes(executor, test::upload(keys), levels);
      ASSERT_EQ(levels.download(), want) << c.name;
    }
  }
}

// Of trunks cut from triangles: the prefix of a whole trunk, not only of its first triangle, ends
// before the level that separates it from its neighbour.
TEST(StageEssential, LevelsSeparateWholeTrunks) {
  const test::Keys keys = test::random_keys(61, 5000, 24, 6, 400);
  const std::vector<std::uint32_t> first = test::plain_trunks(keys, 4);
  test::Keys trunk_keys;
  for (const std::uint32_t at : first) trunk_keys.push_back(keys[at]);
  test::Array<std::uint8_t> found(first.size() - 1);
  stages::essential_nodes(test::executor(), test::upload(trunk_keys), found);
  const std::vector<std::uint8_t> levels = found.download();
  for (std::size_t j = 0; j < levels.size(); ++j) {
    const std::size_t end = j + 2 < first.size() ? first[j + 2] : keys.size();
    for (std::size_t i = first[j]; i < first[j + 1]; ++i) {
      ASSERT_FALSE(test::key_bit(keys[i], levels[j]));
    }
    for (std::size_t i = first[j + 1]; i < end; ++i) {
      ASSERT_TRUE(test::key_bit(keys[i], levels[j]));
      ASSERT_EQ(test::first_difference(keys[first[j]], keys[i]), levels[j]);
    }
  }
}

TEST(StageEssential, LengthsThatDisagreeAreRefused) {
  const test::Keys keys = test::without_duplicates(test::random_keys(62, 10, 64, 0, 10));
  test::Array<std::uint8_t> levels(keys.size());
  EXPECT_THROW(stages::essential_nodes(test::executor(), test::upload(keys), levels), Error);
}

}  // namespace
}  // namespace zkd
