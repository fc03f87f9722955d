// SPDX-License-Identifier: Apache-2.0
//
// Integers of a fixed number of words, wide enough that sums of products of floats are exact: a
// number is an integer in units of a power of two below which no product of its degree has a bit
// (Kulisch's long accumulator). No allocation, no rounding, no dependence on the floating-point
// mode.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace zkd::core {

/// Two's complement, least word first.
template <std::size_t words>
struct Integer {
  std::uint64_t word[words] = {};

  [[nodiscard]] bool negative() const { return (word[words - 1] >> 63) != 0; }

  [[nodiscard]] int sign() const {
    if (negative()) return -1;
    for (const std::uint64_t w : word)
      if (w != 0) return 1;
    return 0;
  }

  void negate() {
    std::uint64_t carry = 1;
    for (std::uint64_t& w : word) {
      w = ~w + carry;
      carry = carry != 0 && w == 0 ? 1 : 0;
    }
  }

  [[nodiscard]] Integer magnitude() const {
    Integer result = *this;
    if (negative()) result.negate();
    return result;
  }

  Integer& operator+=(const Integer& other) {
    std::uint64_t carry = 0;
    for (std::size_t i = 0; i < words; ++i) {
      const std::uint64_t sum = word[i] + other.word[i];
      const std::uint64_t with_carry = sum + carry;
      carry = (sum < word[i] ? 1u : 0u) + (with_carry < sum ? 1u : 0u);
      word[i] = with_carry;
    }
    return *this;
  }

  Integer& operator-=(Integer other) {
    other.negate();
    return *this += other;
  }

  /// Adds `low` + 2^64 `high`, shifted left; what passes the last word is lost.
  void add_shifted(std::uint64_t low, std::uint64_t high, std::size_t shift) {
    const std::size_t first = shift / 64;
    const std::size_t bits = shift % 64;
    Integer term;
    const std::uint64_t spill = bits == 0 ? 0 : high >> (64 - bits);
    const std::uint64_t middle = bits == 0 ? high : (high << bits) | (low >> (64 - bits));
    term.word[first] = low << bits;
    if (first + 1 < words) term.word[first + 1] = middle;
    if (first + 2 < words) term.word[first + 2] = spill;
    *this += term;
  }

  /// The number with its leading 63 or 64 bits kept: below the exact one by a relative 2^-62 at
  /// most, and rounded to a double. Times 2^exponent, which must keep it in a double's range.
  [[nodiscard]] double approximate(int exponent) const {
    const Integer size = magnitude();
    std::size_t top = words;
    while (top > 0 && size.word[top - 1] == 0) --top;
    if (top == 0) return 0.0;
    std::uint64_t leading = size.word[top - 1];
    const int shift = std::countl_zero(leading);
    if (shift > 0) {
      leading <<= shift;
      if (top > 1) leading |= size.word[top - 2] >> (64 - shift);
    }
    const int scale = static_cast<int>(64 * (top - 1)) - shift + exponent;
    const double value = static_cast<double>(leading) *
                         std::bit_cast<double>(static_cast<std::uint64_t>(scale + 1023) << 52);
    return negative() ? -value : value;
  }
};

/// The product of two 64-bit numbers.
inline void multiply(std::uint64_t a, std::uint64_t b, std::uint64_t& low, std::uint64_t& high) {
  __extension__ using Wide128 = unsigned __int128;
  const Wide128 product = static_cast<Wide128>(a) * b;
  low = static_cast<std::uint64_t>(product);
  high = static_cast<std::uint64_t>(product >> 64);
}

template <std::size_t m, std::size_t n>
Integer<m + n> operator*(const Integer<m>& a, const Integer<n>& b) {
  const Integer<m> left = a.magnitude();
  const Integer<n> right = b.magnitude();
  Integer<m + n> product;
  for (std::size_t i = 0; i < m; ++i) {
    if (left.word[i] == 0) continue;
    std::uint64_t carry = 0;
    for (std::size_t j = 0; j < n; ++j) {
      std::uint64_t low = 0;
      std::uint64_t high = 0;
      multiply(left.word[i], right.word[j], low, high);
      low += carry;
      high += low < carry ? 1 : 0;
      const std::uint64_t sum = product.word[i + j] + low;
      carry = high + (sum < low ? 1 : 0);
      product.word[i + j] = sum;
    }
    product.word[i + n] = carry;
  }
  if (a.negative() != b.negative()) product.negate();
  return product;
}

template <std::size_t words>
int compare(const Integer<words>& a, const Integer<words>& b) {
  Integer<words> difference = a;
  return (difference -= b).sign();
}

}  // namespace zkd::core
