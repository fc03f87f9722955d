// SPDX-License-Identifier: Apache-2.0
//
// Doubles as integers on a common power of two, for GMP. Private to zkd_verify.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>

#include <gmpxx.h>

#include "verify/exact.hpp"

namespace zkd::verify {

/// Exponent of the lowest set bit of x, which is finite and not 0.
inline int lowest_bit(double x) {
  int exponent = 0;
  const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53));
  return exponent - 53 + std::countr_zero(static_cast<std::uint64_t>(mantissa));
}

/// The power of two of which all coordinates of all points are multiples.
inline int common_exponent(std::initializer_list<Point> points) {
  int lowest = std::numeric_limits<int>::max();
  for (const Point& point : points) {
    for (const double x : point) {
      if (x != 0.0) lowest = std::min(lowest, lowest_bit(x));
    }
  }
  return lowest == std::numeric_limits<int>::max() ? 0 : lowest;
}

/// x * 2^-exponent, which is an integer.
inline mpz_class integer(double x, int exponent) { return mpz_class(std::ldexp(x, -exponent)); }

struct IntegerPoint {
  mpz_class x, y, z;

  IntegerPoint(const Point& point, int exponent)
      : x(integer(point[0], exponent)),
        y(integer(point[1], exponent)),
        z(integer(point[2], exponent)) {}
  IntegerPoint(mpz_class x_, mpz_class y_, mpz_class z_)
      : x(std::move(x_)), y(std::move(y_)), z(std::move(z_)) {}
};

inline IntegerPoint operator-(const IntegerPoint& a, const IntegerPoint& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

inline IntegerPoint cross(const IntegerPoint& a, const IntegerPoint& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline mpz_class dot(const IntegerPoint& a, const IntegerPoint& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// numerator / denominator * 2^exponent, denominator > 0.
struct Ratio {
  mpz_class numerator;
  mpz_class denominator;
  int exponent = 0;
};

/// -1, 0, 1 as a is less than, equal to, above b.
inline int compare(const Ratio& a, const Ratio& b) {
  mpz_class left = a.numerator * b.denominator;
  mpz_class right = b.numerator * a.denominator;
  const int shift = a.exponent - b.exponent;
  if (shift > 0) {
    left <<= static_cast<unsigned>(shift);
  } else {
    right <<= static_cast<unsigned>(-shift);
  }
  const int order = cmp(left, right);
  return (order > 0) - (order < 0);
}

/// x, finite, as a ratio.
inline Ratio ratio(double x) {
  if (x == 0.0) return {0, 1, 0};
  const int exponent = lowest_bit(x);
  return {integer(x, exponent), 1, exponent};
}

/// The nearest double; the value must not be outside the normal range (or be 0).
inline double nearest_double(const Ratio& value) {
  if (sgn(value.numerator) == 0) return 0.0;
  // A quotient of 55 bits or more with everything below it gathered in one sticky bit rounds, by
  // the conversion to double, as the value itself does.
  const mpz_class numerator = abs(value.numerator);
  const auto bits = [](const mpz_class& x) {
    return static_cast<int>(mpz_sizeinbase(x.get_mpz_t(), 2));
  };
  const int shift = 60 - (bits(numerator) - bits(value.denominator));
  mpz_class scaled = numerator;
  mpz_class divisor = value.denominator;
  if (shift > 0) {
    scaled <<= static_cast<unsigned>(shift);
  } else {
    divisor <<= static_cast<unsigned>(-shift);
  }
  mpz_class quotient;
  mpz_class remainder;
  mpz_fdiv_qr(quotient.get_mpz_t(), remainder.get_mpz_t(), scaled.get_mpz_t(), divisor.get_mpz_t());
  std::uint64_t digits = quotient.get_ui();
  if (sgn(remainder) != 0) digits |= 1;
  const double magnitude = std::ldexp(static_cast<double>(digits), value.exponent - shift);
  return sgn(value.numerator) < 0 ? -magnitude : magnitude;
}

/// The exact parts of a ray's meeting with a triangle's plane.
struct ExactPlaneHit {
  IntegerPoint normal;  ///< (b - a) x (c - a) * 2^(-2 * point_exponent)
  mpz_class along;      ///< d . normal * 2^(-direction_exponent)
  mpz_class offset;     ///< (a - o) . normal * 2^(-point_exponent)
  int point_exponent;
  int direction_exponent;

  ExactPlaneHit(const Point& o, const Point& d, const Corners& corners)
      : ExactPlaneHit(o, d, corners, common_exponent({o, corners[0], corners[1], corners[2]}),
                      common_exponent({d})) {}

  /// t = offset / along. `along` must not be 0.
  [[nodiscard]] Ratio t() const {
    const int exponent = point_exponent - direction_exponent;
    if (sgn(along) < 0) return {-offset, -along, exponent};
    return {offset, along, exponent};
  }

 private:
  ExactPlaneHit(const Point& o, const Point& d, const Corners& corners, int points, int direction)
      : ExactPlaneHit(IntegerPoint(o, points), IntegerPoint(d, direction),
                      IntegerPoint(corners[0], points), IntegerPoint(corners[1], points),
                      IntegerPoint(corners[2], points), points, direction) {}
  ExactPlaneHit(const IntegerPoint& o, const IntegerPoint& d, const IntegerPoint& a,
                const IntegerPoint& b, const IntegerPoint& c, int points, int direction)
      : normal(cross(b - a, c - a)),
        along(dot(d, normal)),
        offset(dot(a - o, normal)),
        point_exponent(points),
        direction_exponent(direction) {}
};

}  // namespace zkd::verify
