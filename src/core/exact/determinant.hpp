// SPDX-License-Identifier: Apache-2.0
//
// Determinants of points and directions given as floats: in double with a bound, and exactly.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include <zkd/traversal/arithmetic.hpp>

#include "core/exact/integer.hpp"

namespace zkd::core {

/// The least power of two that a product of three floats, or one float, may have a bit at.
inline constexpr int product_unit = -447;
inline constexpr int float_unit = -149;

/// A sum of up to 32 products of three floats, in units of 2^product_unit: they are below 2^384.
using Exact = Integer<14>;

/// |x| < 2^128 in units of 2^(float_unit - 1), of which a float and the middle of two neighbouring
/// floats are multiples.
using ExactFloat = Integer<5>;

inline ExactFloat exact_float(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const std::uint64_t significand =
      (bits & ((std::uint64_t{1} << 52) - 1)) | (std::uint64_t{1} << 52);
  ExactFloat result;
  if (x == 0.0) return result;
  // A double holds the middle of two denormal floats with zeros below it.
  const int lowest = exponent_of(x) - 52 - (float_unit - 1);
  if (lowest >= 0)
    result.add_shifted(significand, 0, static_cast<std::size_t>(lowest));
  else
    result.add_shifted(significand >> -lowest, 0, 0);
  if (x < 0.0) result.negate();
  return result;
}

/// Three floats: a corner, an origin or a direction.
struct FloatPoint {
  float at[3];
};

inline double component(const FloatPoint& x, int i) { return static_cast<double>(x.at[i]); }
inline double component(const double (&x)[3], int i) { return x[i]; }

/// Adds sign * a * b * c.
inline void add_product(Exact& sum, float a, float b, float c, int sign) {
  std::uint64_t significand[3];
  int shift = -product_unit;
  int i = 0;
  for (const float x : {a, b, c}) {
    const std::uint32_t bits = bits_of(x);
    const std::uint32_t exponent = (bits >> 23) & 0xFFu;
    significand[i++] = (bits & 0x7FFFFFu) | (exponent != 0 ? 0x800000u : 0u);
    shift += static_cast<int>(exponent != 0 ? exponent : 1) - 150;
    if ((bits >> 31) != 0) sign = -sign;
  }
  if (significand[0] == 0 || significand[1] == 0 || significand[2] == 0) return;
  std::uint64_t low = 0;
  std::uint64_t high = 0;
  multiply(significand[0] * significand[1], significand[2], low, high);
  Exact term;
  term.add_shifted(low, high, static_cast<std::size_t>(shift));
  if (sign < 0)
    sum -= term;
  else
    sum += term;
}

/// Adds sign * det(a, b, c).
inline void add_determinant(Exact& sum, const FloatPoint& a, const FloatPoint& b,
                            const FloatPoint& c, int sign) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    add_product(sum, a.at[i], b.at[j], c.at[k], sign);
    add_product(sum, a.at[i], b.at[k], c.at[j], -sign);
  }
}

/// det(x, b - a, c - a), exactly.
inline Exact exact_determinant(const FloatPoint& x, const FloatPoint& a, const FloatPoint& b,
                               const FloatPoint& c) {
  Exact sum;
  add_determinant(sum, x, b, c, 1);
  add_determinant(sum, x, a, c, -1);
  add_determinant(sum, x, b, a, -1);
  return sum;
}

/// det(a - o, b - a, c - a), exactly.
inline Exact exact_offset(const FloatPoint& o, const FloatPoint& a, const FloatPoint& b,
                          const FloatPoint& c) {
  Exact sum;
  add_determinant(sum, a, b, c, 1);
  sum -= exact_determinant(o, a, b, c);
  return sum;
}

/// A determinant in double, and how far it may be off.
struct BoundedDeterminant {
  double value;
  double error;

  /// Whether its sign is the exact one; it may be 0 only where every product is.
  [[nodiscard]] bool certain() const { return value > error || -value > error; }
};

/// det(x, p, q), p and q being differences of floats, x a float or another such difference. A
/// difference is rounded once: three of them, two products, an inner sum and two outer ones
/// are eight roundings at most, 8 * 2^-53 / (1 - 8 * 2^-53) < 9e-16 of the sum of all products'
/// absolute values; 9.4e-16 leaves room for that sum's own rounding. Products of three neither
/// overflow nor underflow.
template <class Number>
BoundedDeterminant bounded_determinant(const Number& x, const double (&p)[3],
                                       const double (&q)[3]) {
  double value = 0.0;
  double permanent = 0.0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    const double plus = p[j] * q[k];
    const double minus = p[k] * q[j];
    const double along = component(x, i);
    value += along * (plus - minus);
    permanent += magnitude(along) * (magnitude(plus) + magnitude(minus));
  }
  return {value, 9.4e-16 * permanent};
}

/// Numbers between which another one lies.
struct Bracket {
  double lo;
  double hi;

  /// Widened by more than what a few roundings take.
  static Bracket around(double lo, double hi) {
    return {lo - 1e-15 * magnitude(lo), hi + 1e-15 * magnitude(hi)};
  }

  /// Whether every number in it rounds to one float: which it then is.
  [[nodiscard]] bool is_one_float(float& rounded) const {
    rounded = static_cast<float>(lo) + 0.0F;  // +0 turns -0 into +0
    return rounded == static_cast<float>(hi);
  }
};

/// A quotient of two determinants, the divisor's sign put into the dividend. The divisor must be
/// certain.
inline Bracket quotient(const BoundedDeterminant& dividend, const BoundedDeterminant& divisor) {
  const double least = magnitude(divisor.value) - divisor.error;
  const double most = magnitude(divisor.value) + divisor.error;
  const double value = divisor.value < 0.0 ? -dividend.value : dividend.value;
  const double lo = value - dividend.error;
  const double hi = value + dividend.error;
  return Bracket::around(lo / (lo >= 0.0 ? most : least), hi / (hi >= 0.0 ? least : most));
}

/// A quotient of two exact numbers of one unit. divisor > 0.
struct ExactQuotient {
  Exact dividend;
  Exact divisor;

  ExactQuotient(const Exact& above, const Exact& below) : dividend(above), divisor(below) {
    if (!divisor.negative()) return;
    divisor.negate();
    dividend.negate();
  }

  [[nodiscard]] int compared_with(const ExactQuotient& other) const {
    return compare(dividend * other.divisor, other.dividend * divisor);
  }

  /// With a float, or the middle of two neighbouring floats.
  [[nodiscard]] int compared_with(double x) const {
    return compare(dividend * exact_float(1.0), divisor * exact_float(x));
  }

  [[nodiscard]] Bracket bracket() const {
    const double value = dividend.approximate(product_unit) / divisor.approximate(product_unit);
    return Bracket::around(value, value);
  }

  /// The nearest float; of two equally near ones the even one. It must not be infinite.
  [[nodiscard]] float rounded() const {
    const Bracket range = bracket();
    float low = 0.0F;
    if (range.is_one_float(low)) return low;
    const auto high = static_cast<float>(range.hi);
    constexpr double float_max = 3.4028234663852886e38;
    const double below = larger(static_cast<double>(low), -float_max);
    const double above = smaller(static_cast<double>(high), float_max);
    if (below == above) return static_cast<float>(below);
    const int order = compared_with(0.5 * (below + above));
    const bool down = order != 0 ? order < 0 : (bits_of(low) & 1u) == 0;
    return static_cast<float>(down ? below : above) + 0.0F;
  }
};

}  // namespace zkd::core
