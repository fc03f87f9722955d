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
  for (int threads = 1; threads <= 4; ++threads) {
    std::vector<Code> sorted = codes;
    std::vector<std::uint32_t> values(codes.size());
    for (std::uint32_t i = 0; i < codes.size(); ++i) values[i] = i ^ 0x5A5A5A5Au;
    (void)stages::radix_sort({.threads = threads}, std::span(sorted), values, bits);
    for (std::size_t i = 0; i < codes.size(); ++i) {
      ASSERT_EQ(sorted[i], want[i].first) << "position " << i << " of " << codes.size() << ", "
                                          << bits << " bits, " << threads << " threads";
      ASSERT_EQ(values[i], want[i].second)
          << "position " << i << " of " << codes.size() << ", " << bits << " bits, " << threads
          << " threads: not stable, or values went astray";
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
  Random random(36);
  const std::uint32_t width = 8 * sizeof(TypeParam);
  std::vector<std::uint32_t> values(50000);
  std::vector<TypeParam> codes(values.size());
  for (TypeParam& code : codes) code = static_cast<TypeParam>(random.bits64());
  EXPECT_EQ(stages::radix_sort({}, std::span(codes), values, width), 0u);

  std::fill(codes.begin(), codes.end(), static_cast<TypeParam>(random.bits64()));
  const std::uint32_t passes = stages::radix_sort({}, std::span(codes), values, width);
  EXPECT_GE(passes, width / 16) << "every pass";
  EXPECT_LE(passes, width);

  for (TypeParam& code : codes) {
    code = static_cast<TypeParam>((code & ~TypeParam{1}) | (random.bits64() & 1u));
  }
  EXPECT_EQ(stages::radix_sort({}, std::span(codes), values, width), passes - 1);
}

TYPED_TEST(StageSort, LengthsThatDisagreeAreRefused) {
  std::vector<TypeParam> codes(5);
  std::vector<std::uint32_t> values(4);
  try {
    (void)stages::radix_sort({}, std::span(codes), values);
    ADD_FAILURE() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::invalid_view);
  }
}

}  // namespace
}  // namespace zkd
