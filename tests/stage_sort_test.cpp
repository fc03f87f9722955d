// SPDX-License-Identifier: Apache-2.0
//
// Stage 4, the radix sort, against std::stable_sort.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "support/platform.hpp"
#include "support/random.hpp"

namespace zkd {
namespace {

using test::Random;

template <class Code>
Code low_bits(Code code, std::uint32_t bits) {
  return bits >= 8 * sizeof(Code) ? code : static_cast<Code>(code & ((Code{1} << bits) - 1));
}

template <class Code>
void expect_sorted_like_the_standard(const std::vector<Code>& codes, std::uint32_t bits) {
  std::vector<std::pair<Code, std::uint32_t>> want;
  for (std::uint32_t i = 0; i < codes.size(); ++i) want.emplace_back(codes[i], i ^ 0x5A5A5A5Au);
  std::stable_sort(want.begin(), want.end(), [bits](const auto& a, const auto& b) {
    return low_bits(a.first, bits) < low_bits(b.first, bits);
  });
  std::vector<std::uint32_t> given(codes.size());
  for (std::uint32_t i = 0; i < codes.size(); ++i) given[i] = i ^ 0x5A5A5A5Au;
  for (const test::Executor& executor : test::executors(4)) {
    test::Array<Code> sorted_codes = test::upload(codes);
    test::Array<std::uint32_t> sorted_values = test::upload(given);
    (void)stages::radix_sort(executor, sorted_codes, sorted_values, bits);
    const std::vector<Code> sorted = sorted_codes.download();
    const std::vector<std::uint32_t> values = sorted_values.download();
    for (std::size_t i = 0; i < codes.size(); ++i) {
      ASSERT_EQ(sorted[i], want[i].first) << "position " << i << " of " << codes.size() << ", "
                                          << bits << " bits, " << test::name(executor);
      ASSERT_EQ(values[i], want[i].second)
          << "position " << i << " of " << codes.size() << ", " << bits << " bits, "
          << test::name(executor) << ": not stable, or values went astray";
    }
  }
}

template <class Code>
class StageSort : public testing::Test {};
using CodeTypes = testing::Types<std::uint32_t, std::uint64_t>;
TYPED_TEST_SUITE(StageSort, CodeTypes);

TYPED_TEST(StageSort, EverySmallLength) {
  Random random(31);
  for (std::size_t n = 0; n < 70; ++n) {
    std::vector<TypeParam> codes(n);
    for (TypeParam& code : codes) code = static_cast<TypeParam>(random.bits64());
    expect_sorted_like_the_standard(codes, 8 * sizeof(TypeParam));
    for (TypeParam& code : codes) code = static_cast<TypeParam>(random.below(3));
    expect_sorted_like_the_standard(codes, 8 * sizeof(TypeParam));
  }
}

TYPED_TEST(StageSort, OddLengths) {
  Random random(32);
  for (const std::size_t n : {255u, 256u, 257u, 1023u, 2047u, 4097u, 65535u, 65537u, 100003u}) {
    std::vector<TypeParam> codes(n);
    for (TypeParam& code : codes) code = static_cast<TypeParam>(random.bits64());
    expect_sorted_like_the_standard(codes, 8 * sizeof(TypeParam));
  }
}

TYPED_TEST(StageSort, EveryWidth) {
  Random random(33);
  for (std::uint32_t bits = 1; bits <= 8 * sizeof(TypeParam); ++bits) {
    std::vector<TypeParam> codes(3000);
    for (TypeParam& code : codes) code = low_bits(static_cast<TypeParam>(random.bits64()), bits);
    expect_sorted_like_the_standard(codes, bits);
  }
}

TYPED_TEST(StageSort, BitsAboveTheWidthDoNotCount) {
  Random random(37);
  for (std::uint32_t bits = 1; bits < 8 * sizeof(TypeParam); ++bits) {
    std::vector<TypeParam> codes(300);
    for (TypeParam& code : codes) code = static_cast<TypeParam>(random.bits64());
    expect_sorted_like_the_standard(codes, bits);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TYPED_TEST(StageSort, ConstantDigitsInEveryPosition) {
  Random random(34);
  for (std::uint32_t shift = 0; shift < 8 * sizeof(TypeParam); shift += 4) {
    std::vector<TypeParam> codes(5000);
    const auto constant = static_cast<TypeParam>(random.bits64());
    const TypeParam mask = static_cast<TypeParam>(TypeParam{0xFF} << shift);
    for (TypeParam& code : codes) {
      code = static_cast<TypeParam>((constant & ~mask) |
                                    (static_cast<TypeParam>(random.bits64()) & mask));
    }
    expect_sorted_like_the_standard(codes, 8 * sizeof(TypeParam));
  }
}

TYPED_TEST(StageSort, EqualSortedReversed) {
  std::vector<TypeParam> codes(30001, static_cast<TypeParam>(0xDEADBEEFu));
  expect_sorted_like_the_standard(codes, 8 * sizeof(TypeParam));
  std::iota(codes.begin(), codes.end(), TypeParam{1000});
  expect_sorted_like_the_standard(codes, 8 * sizeof(TypeParam));
  std::reverse(codes.begin(), codes.end());
  expect_sorted_like_the_standard(codes, 8 * sizeof(TypeParam));
  for (TypeParam& code : codes) code = static_cast<TypeParam>(~TypeParam{0} - (code & 1u));
  expect_sorted_like_the_standard(codes, 8 * sizeof(TypeParam));
}

TYPED_TEST(StageSort, AMillion) {
  Random random(35);
  std::vector<TypeParam> codes(1000003);
  for (TypeParam& code : codes) code = static_cast<TypeParam>(random.bits64());
  expect_sorted_like_the_standard(codes, 8 * sizeof(TypeParam));
}

TYPED_TEST(StageSort, ReportsThePassesLeftOut) {
  if (!test::sort_leaves_passes_out) GTEST_SKIP() << "this platform's sort leaves no pass out";
  Random random(36);
  const std::uint32_t width = 8 * sizeof(TypeParam);
  std::vector<TypeParam> codes(50000);
  const auto passes_left_out = [&] {
    test::Array<std::uint32_t> values(codes.size());
    test::Array<TypeParam> sorted = test::upload(codes);
    return stages::radix_sort(test::executor(), sorted, values, width);
  };
  for (TypeParam& code : codes) code = static_cast<TypeParam>(random.bits64());
  EXPECT_EQ(passes_left_out(), 0u);

  std::fill(codes.begin(), codes.end(), static_cast<TypeParam>(random.bits64()));
  const std::uint32_t passes = passes_left_out();
  EXPECT_GE(passes, width / 16) << "every pass";
  EXPECT_LE(passes, width);

  for (TypeParam& code : codes) {
    code = static_cast<TypeParam>((code & ~TypeParam{1}) | (random.bits64() & 1u));
  }
  EXPECT_EQ(passes_left_out(), passes - 1);
}

TYPED_TEST(StageSort, LengthsThatDisagreeAreRefused) {
  test::Array<TypeParam> codes(5);
  test::Array<std::uint32_t> values(4);
  try {
    (void)stages::radix_sort(test::executor(), codes, values);
    ADD_FAILURE() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::invalid_view);
  }
}

}  // namespace
}  // namespace zkd
