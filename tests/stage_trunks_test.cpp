// SPDX-License-Identifier: Apache-2.0
//
// Stage 6, trunks, against a descent through the conceptual complete tree.
#include <gtest/gtest.h>

#include <vector>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "support/keys.hpp"
#include "support/plain_stages.hpp"
#include "support/platform.hpp"

namespace zkd {
namespace {

TEST(StageTrunks, AreTheLargestNodesWithinTheLeafSize) {
  for (const test::NamedKeys& c : test::hard_keys()) {
    for (const std::uint32_t leaf_size : {1u, 2u, 3u, 4u, 5u, 16u, 100u, 1024u}) {
      const std::vector<std::uint32_t> want = test::plain_trunks(c.keys, leaf_size);
      for (const test::Executor& executor : test::executors(3)) {
        test::Array<std::uint32_t> found(c.keys.size());
        const std::uint32_t count =
            stages::find_trunks(executor, test::upload(c.keys), leaf_size, found);
        std::vector<std::uint32_t> first = found.download();
        ASSERT_LE(count, first.size());
        first.resize(count);
        ASSERT_EQ(first, want) << c.name << ", leaf size " << leaf_size << ", "
                               << test::name(executor);
      }
    }
  }
}

TEST(StageTrunks, HoldNoMoreThanTheLeafSizeUnlessTheyAreOneKey) {
  const test::Keys keys = test::random_keys(41, 30000, 20, 4, 500);
  for (const std::uint32_t leaf_size : {1u, 4u, 16u}) {
    test::Array<std::uint32_t> found(keys.size());
    const std::uint32_t count =
        stages::find_trunks(test::executor(), test::upload(keys), leaf_size, found);
    std::vector<std::uint32_t> first = found.download();
    first.resize(count);
    ASSERT_EQ(first.front(), 0u);
    first.push_back(static_cast<std::uint32_t>(keys.size()));
    for (std::size_t t = 0; t + 1 < first.size(); ++t) {
      ASSERT_LT(first[t], first[t + 1]);
      ASSERT_TRUE(first[t + 1] - first[t] <= leaf_size || keys[first[t]] == keys[first[t + 1] - 1]);
    }
  }
}

TEST(StageTrunks, OutputOfTheWrongLengthIsRefused) {
  const test::Keys keys = test::random_keys(42, 10, 32, 0, 10);
  test::Array<std::uint32_t> first(9);
  EXPECT_THROW((void)stages::find_trunks(test::executor(), test::upload(keys), 4, first), Error);
}

}  // namespace
}  // namespace zkd
