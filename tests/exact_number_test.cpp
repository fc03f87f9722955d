// SPDX-License-Identifier: Apache-2.0
//
// Exact numbers of Intersector::exact, held against GMP.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gmpxx.h>

#include "core/exact/determinant.hpp"
#include "support/random.hpp"

namespace zkd::core {
namespace {

using test::Random;

mpq_class rational(double x) {
  mpq_class value;
  value = x;
  return value;
}

template <std::size_t words>
mpz_class big(const Integer<words>& x) {
  mpz_class value;
  const Integer<words> size = x.magnitude();
  for (std::size_t i = words; i-- > 0;) {
    value <<= 64;
    value += mpz_class(static_cast<unsigned long>(size.word[i]));
  }
  return x.negative() ? mpz_class(-value) : value;
}

// Any finite float; often one whose significand or exponent is at an end.
float any_float(Random& random) {
  switch (random.integer(0, 7)) {
    case 0:
      return 0.0F;
    case 1:
      return std::numeric_limits<float>::denorm_min() * static_cast<float>(random.integer(-9, 9));
    case 2:
      return random.one_in(2) ? std::numeric_limits<float>::max()
                              : std::numeric_limits<float>::lowest();
    case 3:
      return static_cast<float>(random.integer(-3, 3));
    default: {
      std::uint32_t bits = 0;
      do bits = static_cast<std::uint32_t>(random.bits64());
      while ((bits & 0x7F800000u) == 0x7F800000u);
      return std::bit_cast<float>(bits);
    }
  }
}

FloatPoint any_point(Random& random) {
  return {{any_float(random), any_float(random), any_float(random)}};
}

mpq_class determinant(const mpq_class (&a)[3], const mpq_class (&b)[3], const mpq_class (&c)[3]) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

// det(x - w, b - a, c - a)
mpq_class by_rationals(const FloatPoint& x, const FloatPoint& w, const FloatPoint& a,
                       const FloatPoint& b, const FloatPoint& c) {
  mpq_class columns[3][3];
  for (int i = 0; i < 3; ++i) {
    columns[0][i] = rational(x.at[i]) - rational(w.at[i]);
    columns[1][i] = rational(b.at[i]) - rational(a.at[i]);
    columns[2][i] = rational(c.at[i]) - rational(a.at[i]);
  }
  return determinant(columns[0], columns[1], columns[2]);
}

mpq_class value(const Exact& x) {
  mpz_class unit = 1;
  unit <<= static_cast<unsigned>(-product_unit);
  mpq_class result(big(x), unit);
  result.canonicalize();
  return result;
}

TEST(ExactDeterminant, IsGmps) {
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const FloatPoint x = any_point(random);
    const FloatPoint a = any_point(random);
    const FloatPoint b = random.one_in(8) ? a : any_point(random);
    const FloatPoint c = any_point(random);
    ASSERT_EQ(value(exact_determinant(x, a, b, c)), by_rationals(x, {}, a, b, c)) << i;
    ASSERT_EQ(value(exact_offset(x, a, b, c)), by_rationals(a, x, a, b, c)) << i;
  }
}

TEST(ExactDeterminant, ExtremesFit) {
  constexpr float most = std::numeric_limits<float>::max();
  const FloatPoint x{{most, -most, most}};
  const FloatPoint a{{-most, most, most}};
  const FloatPoint b{{most, most, -most}};
  const FloatPoint c{{-most, -most, -most}};
  EXPECT_EQ(value(exact_determinant(x, a, b, c)), by_rationals(x, {}, a, b, c));
  EXPECT_EQ(value(exact_offset(x, a, b, c)), by_rationals(a, x, a, b, c));
  constexpr float least = std::numeric_limits<float>::denorm_min();
  Exact sum;
  add_product(sum, least, -least, least, 1);
  EXPECT_EQ(big(sum), -1);
}

TEST(ExactDeterminant, TheBoundHolds) {
  Random random(2);
  int uncertain = 0;
  for (int i = 0; i < 20000; ++i) {
    // Small integers make determinants of exactly zero, ulps beside them almost zero ones.
    const auto coordinate = [&random] {
      return test::ulps(static_cast<float>(random.integer(-2, 2)), random.integer(-1, 1));
    };
    FloatPoint at[4];
    for (FloatPoint& p : at)
      for (float& x : p.at) x = coordinate();
    double p[3];
    double q[3];
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = static_cast<double>(at[2].at[axis]) - static_cast<double>(at[1].at[axis]);
      q[axis] = static_cast<double>(at[3].at[axis]) - static_cast<double>(at[1].at[axis]);
    }
    const BoundedDeterminant bounded = bounded_determinant(at[0], p, q);
    const mpq_class exact = by_rationals(at[0], {}, at[1], at[2], at[3]);
    const mpq_class off = abs(mpq_class(exact - rational(bounded.value)));
    ASSERT_LE(off, rational(bounded.error)) << i;
    if (bounded.certain()) {
      ASSERT_EQ(sgn(exact), bounded.value > 0.0 ? 1 : -1);
    } else {
      ++uncertain;
    }
  }
  EXPECT_GT(uncertain, 50);
}

TEST(ExactQuotient, RoundsToTheNearestFloatTiesToEven) {
  Random random(3);
  for (int i = 0; i < 20000; ++i) {
    // A float, or the middle of two, or a little beside it, times a determinant.
    const float base = any_float(random);
    const float next = std::nextafter(base, std::numeric_limits<float>::infinity());
    if (!std::isfinite(next)) continue;
    Exact divisor;
    add_product(divisor, static_cast<float>(1 + random.integer(0, 1 << 20)), 1.0F, 1.0F, 1);
    const double middle = 0.5 * (static_cast<double>(base) + static_cast<double>(next));
    // middle * divisor, an integer of the units of a product: 2^-149-1 is a multiple of them.
    Exact dividend;
    const auto twice = [&](float x) {
      // x / 2 may not be a float: half of the divisor's units are there instead.
      Exact term;
      add_product(term, x, 1.0F, 1.0F, 1);
      return term;
    };
    const mpz_class units = big(divisor) * (big(twice(base)) + big(twice(next)));
    ASSERT_TRUE(mpz_even_p(units.get_mpz_t()) != 0 || middle == 0.0);
    mpz_class half = units / 2;
    const int beside = random.integer(-1, 1);
    mpz_class one = 1;
    one <<= static_cast<unsigned>(-product_unit);  // the unit of the divisor: 1.0
    mpz_class exact = half / one;                  // in units of a product, rounded down
    const bool whole = exact * one == half;
    if (!whole) continue;
    exact += beside;
    mpz_class rest = abs(exact);
    for (std::size_t w = 0; w < 14; ++w) {
      dividend.word[w] = mpz_class(rest & mpz_class(~0UL)).get_ui();
      rest >>= 64;
    }
    if (exact < 0) dividend.negate();
    const float rounded = ExactQuotient(dividend, divisor).rounded();
    const float even = (bits_of(base) & 1u) == 0 ? base : next;
    const float want = beside == 0 ? even : beside < 0 ? base : next;
    ASSERT_EQ(rounded, want) << base << " " << beside;
  }
}

TEST(ExactFloat, HoldsFloatsAndMiddles) {
  Random random(4);
  for (int i = 0; i < 5000; ++i) {
    const float x = any_float(random);
    const float y = std::nextafter(x, std::numeric_limits<float>::infinity());
    if (!std::isfinite(y)) continue;
    const double middle = 0.5 * (static_cast<double>(x) + static_cast<double>(y));
    mpz_class unit = 1;
    unit <<= 150;
    mpq_class exact(big(exact_float(middle)), unit);
    exact.canonicalize();
    ASSERT_EQ(exact, rational(middle));
  }
}

}  // namespace
}  // namespace zkd::core
