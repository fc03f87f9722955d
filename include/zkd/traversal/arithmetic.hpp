// SPDX-License-Identifier: Apache-2.0
//
// Arithmetic that gives the same bits wherever it is compiled.
//
// A compiler may fuse a product and a sum into one rounding ("contraction"): nvcc does by default,
// gcc and clang under -ffp-contract=fast. The library's own host code is compiled without it, but
// traversal is also compiled into users' kernels, with their flags. Rounded<T> therefore spells out
// every operation: on the device by the intrinsics that are never fused, on the host by plain
// operators under the library's flags. fma() is the only fused operation, and explicit.
//
// The files of this folder are the traversal itself, which device code includes by way of
// zkd/cuda/device.hpp. Host programs call zkd/query.hpp: what they would compile from here has the
// bits that their flags give it.
//
// In this folder no sum, difference, product or quotient is taken of plain floats or doubles,
// unless of constants: all are Rounded. Signs, comparisons and conversions are exact or rounded
// once everywhere, and stay plain.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include <zkd/config.hpp>

namespace zkd::core {

#if defined(__CUDA_ARCH__)
__device__ inline float rounded_sum(float a, float b) { return __fadd_rn(a, b); }
__device__ inline float rounded_difference(float a, float b) { return __fsub_rn(a, b); }
__device__ inline float rounded_product(float a, float b) { return __fmul_rn(a, b); }
__device__ inline float rounded_quotient(float a, float b) { return __fdiv_rn(a, b); }
__device__ inline double rounded_sum(double a, double b) { return __dadd_rn(a, b); }
__device__ inline double rounded_difference(double a, double b) { return __dsub_rn(a, b); }
__device__ inline double rounded_product(double a, double b) { return __dmul_rn(a, b); }
__device__ inline double rounded_quotient(double a, double b) { return __ddiv_rn(a, b); }
__device__ inline float rounded_fma(float a, float b, float c) { return __fmaf_rn(a, b, c); }
__device__ inline double rounded_fma(double a, double b, double c) { return __fma_rn(a, b, c); }
#else
template <class T>
ZKD_HOST_DEVICE inline T rounded_sum(T a, T b) {
  return a + b;
}
template <class T>
ZKD_HOST_DEVICE inline T rounded_difference(T a, T b) {
  return a - b;
}
template <class T>
ZKD_HOST_DEVICE inline T rounded_product(T a, T b) {
  return a * b;
}
template <class T>
ZKD_HOST_DEVICE inline T rounded_quotient(T a, T b) {
  return a / b;
}
ZKD_HOST_DEVICE inline float rounded_fma(float a, float b, float c) {
  return __builtin_fmaf(a, b, c);
}
ZKD_HOST_DEVICE inline double rounded_fma(double a, double b, double c) {
  return __builtin_fma(a, b, c);
}
#endif

/// A number each of whose operations is rounded once, to nearest.
template <class T>
struct Rounded {
  T value = T(0);

  Rounded() = default;
  ZKD_HOST_DEVICE constexpr Rounded(T x) : value(x) {}

  friend ZKD_HOST_DEVICE Rounded operator+(Rounded a, Rounded b) {
    return rounded_sum(a.value, b.value);
  }
  friend ZKD_HOST_DEVICE Rounded operator-(Rounded a, Rounded b) {
    return rounded_difference(a.value, b.value);
  }
  friend ZKD_HOST_DEVICE Rounded operator*(Rounded a, Rounded b) {
    return rounded_product(a.value, b.value);
  }
  friend ZKD_HOST_DEVICE Rounded operator/(Rounded a, Rounded b) {
    return rounded_quotient(a.value, b.value);
  }
  friend ZKD_HOST_DEVICE Rounded fma(Rounded a, Rounded b, Rounded c) {
    return rounded_fma(a.value, b.value, c.value);
  }
  friend ZKD_HOST_DEVICE Rounded operator-(Rounded a) { return -a.value; }
  friend ZKD_HOST_DEVICE bool operator<(Rounded a, Rounded b) { return a.value < b.value; }
  friend ZKD_HOST_DEVICE bool operator>(Rounded a, Rounded b) { return a.value > b.value; }
  friend ZKD_HOST_DEVICE bool operator<=(Rounded a, Rounded b) { return a.value <= b.value; }
  friend ZKD_HOST_DEVICE bool operator>=(Rounded a, Rounded b) { return a.value >= b.value; }
  friend ZKD_HOST_DEVICE bool operator==(Rounded a, Rounded b) { return a.value == b.value; }
};

using Real = Rounded<float>;
using Wide = Rounded<double>;

/// a * b - c * d with an error below 1.5 ulp and, short of underflow, the exact sign (Kahan;
/// Jeannerod, Louvet, Muller: Further analysis of Kahan's algorithm, 2013).
template <class T>
ZKD_HOST_DEVICE inline Rounded<T> difference_of_products(Rounded<T> a, Rounded<T> b, Rounded<T> c,
                                                         Rounded<T> d) {
  const Rounded<T> cd = c * d;
  const Rounded<T> rounding = fma(-c, d, cd);
  return fma(a, b, -cd) + rounding;
}

template <class T>
ZKD_HOST_DEVICE constexpr T smaller(T a, T b) {
  return b < a ? b : a;
}
template <class T>
ZKD_HOST_DEVICE constexpr T larger(T a, T b) {
  return a < b ? b : a;
}
template <class T>  // of plain numbers: compilers know a single instruction for that
ZKD_HOST_DEVICE constexpr Rounded<T> smaller(Rounded<T> a, Rounded<T> b) {
  return smaller(a.value, b.value);
}
template <class T>
ZKD_HOST_DEVICE constexpr Rounded<T> larger(Rounded<T> a, Rounded<T> b) {
  return larger(a.value, b.value);
}

ZKD_HOST_DEVICE inline float magnitude(float x) { return __builtin_fabsf(x); }
ZKD_HOST_DEVICE inline double magnitude(double x) { return __builtin_fabs(x); }
template <class T>
ZKD_HOST_DEVICE inline Rounded<T> magnitude(Rounded<T> x) {
  return magnitude(x.value);
}

ZKD_HOST_DEVICE inline std::uint32_t bits_of(float x) {
#if defined(__CUDA_ARCH__)
  return __float_as_uint(x);
#else
  return std::bit_cast<std::uint32_t>(x);
#endif
}

ZKD_HOST_DEVICE inline float float_of(std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(bits);
#else
  return std::bit_cast<float>(bits);
#endif
}

ZKD_HOST_DEVICE inline bool is_finite(float x) { return (bits_of(x) & 0x7F800000u) != 0x7F800000u; }

/// of[i], i a variable. By comparisons where the array should stay in registers: on the device one
/// that is indexed by a variable cannot. On the host an index into two elements is quicker.
template <class T>
[[gnu::always_inline]] ZKD_HOST_DEVICE inline T element(const T (&of)[2], std::uint32_t i) {
#if defined(__CUDA_ARCH__)
  return i == 0 ? of[0] : of[1];
#else
  return of[i];
#endif
}
template <class T>
ZKD_HOST_DEVICE inline T element(const T (&of)[3], std::uint32_t i) {
  return i == 0 ? of[0] : i == 1 ? of[1] : of[2];
}

/// Zeros in front of the first set bit; 64 for 0.
ZKD_HOST_DEVICE inline std::uint32_t leading_zeros(std::uint64_t x) {
#if defined(__CUDA_ARCH__)
  return static_cast<std::uint32_t>(__clzll(static_cast<long long>(x)));
#else
  return static_cast<std::uint32_t>(std::countl_zero(x));
#endif
}

/// 2^exponent, for -1022 <= exponent <= 1023.
ZKD_HOST_DEVICE inline double power_of_two(int exponent) {
  const auto bits = static_cast<std::uint64_t>(exponent + 1023) << 52;
#if defined(__CUDA_ARCH__)
  return __longlong_as_double(static_cast<long long>(bits));
#else
  return std::bit_cast<double>(bits);
#endif
}

/// floor(log2(|x|)) of a finite x that is not 0 and whose magnitude is at least 2^-1022 (every
/// float is).
ZKD_HOST_DEVICE inline int exponent_of(double x) {
#if defined(__CUDA_ARCH__)
  const auto bits = static_cast<std::uint64_t>(__double_as_longlong(x));
#else
  const auto bits = std::bit_cast<std::uint64_t>(x);
#endif
  return static_cast<int>((bits >> 52) & 0x7FF) - 1023;
}

/// floor(x) as an integer, for |x| < 2^31. (std::floor is a library call on portable x86-64.)
ZKD_HOST_DEVICE inline std::int32_t floor_to_int(double x) {
  const auto truncated = static_cast<std::int32_t>(x);
  return truncated - (x < static_cast<double>(truncated) ? 1 : 0);
}

}  // namespace zkd::core
