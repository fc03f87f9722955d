// SPDX-License-Identifier: Apache-2.0
//
// What only a build on the CPU knows of itself: bytes held in each stage, and what passes of the
// radix sort that were left out would have taken.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <zkd/build.hpp>

#include "scene/generate.hpp"
#include "verify/counting_resource.hpp"

namespace zkd {
namespace {

TEST(BuildReport, StagesHoldWhatTheMemoryResourceGave) {
  for (const References references : {References::once, References::all}) {
    SCOPED_TRACE(to_string(references));
    const scene::Mesh mesh = scene::small_in_large(3000, 1e5F, 3);  // with a second round
    verify::CountingResource memory;
    const Tree tree = build(cpu::Executor{.threads = 2, .memory = &memory}, mesh.view(),
                            {.references = references});
    const Statistics& s = tree.statistics();
    ASSERT_GT(s.crowded_trunks, 0u);
    std::uint64_t most = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(Stage::count); ++i) {
      const auto stage = static_cast<Stage>(i);
      const auto bytes = s.bytes(stage);
      const bool ran = stage == Stage::split ? references == References::all  // it is uneven
                                             : stage != Stage::clusters;
      ASSERT_EQ(bytes.has_value(), ran) << to_string(stage);
      most = std::max(most, bytes.value_or(0));
    }
    EXPECT_EQ(most, memory.peak_bytes());
    EXPECT_LT(*s.bytes(Stage::encode), *s.bytes(Stage::recode)) << "arrays of the second round";
    EXPECT_LT(*s.bytes(Stage::recode), *s.bytes(Stage::references)) << "the tree";
  }
}

TEST(BuildReport, PassesLeftOutHaveTheTimeOfThoseMade) {
  // Corners of a grid of 2^6 by 2^6 squares: most digits of their codes are the same.
  const Tree grid = build(cpu::Executor{.threads = 1}, scene::grid(6).view(), {.code_bits = 64});
  const SkipReport& some = grid.statistics().skip(Skip::radix_passes);
  EXPECT_TRUE(some.considered);
  ASSERT_TRUE(some.taken);
  ASSERT_LT(some.amount, 8u);
  ASSERT_TRUE(some.saved_ms.has_value());
  EXPECT_GT(*some.saved_ms, 0.0);
  // It cannot be more than that many times what the rest of the sort took.
  EXPECT_LE(*some.saved_ms, some.amount * grid.statistics().ms(Stage::sort));
}

TEST(BuildReport, NoTimeIsInvented) {
  // One code: every pass is left out, and what one takes is not known.
  const Tree same = build(cpu::Executor{}, scene::identical(1000).view());
  EXPECT_TRUE(same.statistics().skip(Skip::radix_passes).taken);
  EXPECT_FALSE(same.statistics().skip(Skip::radix_passes).saved_ms.has_value());
  // Digits differ everywhere: nothing was left out, nothing saved.
  const Tree soup = build(cpu::Executor{}, scene::soup(5000, 4).view());
  EXPECT_TRUE(soup.statistics().skip(Skip::radix_passes).considered);
  EXPECT_FALSE(soup.statistics().skip(Skip::radix_passes).taken);
  EXPECT_FALSE(soup.statistics().skip(Skip::radix_passes).saved_ms.has_value());
  // A tree by the surface-area heuristic has no codes.
  const Tree sah = build(cpu::Executor{}, scene::soup(100, 5).view(), {.builder = Builder::sah});
  for (const SkipReport& skip : sah.statistics().skips) EXPECT_FALSE(skip.considered);
  EXPECT_FALSE(sah.statistics().bytes(Stage::sort).has_value());
}

}  // namespace
}  // namespace zkd
