// SPDX-License-Identifier: Apache-2.0
//
// A point's coordinates, and one that is not used, in one value: on the host a vector (in AVX2 code
// a register), on the device, whose threads are the lanes, separate numbers. Every operation is
// rounded once, as written.
#pragma once

#include <cstdint>
#include <cstring>

#include <zkd/config.hpp>
#include <zkd/traversal/arithmetic.hpp>

namespace zkd::core {

/// Three numbers; the fourth is zero after every operation.
template <class Number>
struct SeparateLanes {
  Number at[4];

  ZKD_HOST_DEVICE Number& operator[](std::uint32_t a) { return at[a]; }
  ZKD_HOST_DEVICE const Number& operator[](std::uint32_t a) const { return at[a]; }

  friend ZKD_HOST_DEVICE SeparateLanes operator+(const SeparateLanes& x, const SeparateLanes& y) {
    return {{x.at[0] + y.at[0], x.at[1] + y.at[1], x.at[2] + y.at[2], Number(0)}};
  }
  friend ZKD_HOST_DEVICE SeparateLanes operator-(const SeparateLanes& x, const SeparateLanes& y) {
    return {{x.at[0] - y.at[0], x.at[1] - y.at[1], x.at[2] - y.at[2], Number(0)}};
  }
  friend ZKD_HOST_DEVICE SeparateLanes operator*(const SeparateLanes& x, const SeparateLanes& y) {
    return {{x.at[0] * y.at[0], x.at[1] * y.at[1], x.at[2] * y.at[2], Number(0)}};
  }
  friend ZKD_HOST_DEVICE SeparateLanes operator*(Number s, const SeparateLanes& x) {
    return {{s * x.at[0], s * x.at[1], s * x.at[2], Number(0)}};
  }
};

ZKD_HOST_DEVICE inline void load(const float* point, SeparateLanes<float>& to) {
  to = {{point[0], point[1], point[2], 0.0F}};
}
ZKD_HOST_DEVICE inline void widen(const SeparateLanes<float>& from, SeparateLanes<double>& to) {
  for (int a = 0; a < 4; ++a) to.at[a] = static_cast<double>(from.at[a]);
}
template <class Number>
ZKD_HOST_DEVICE void keep_least(SeparateLanes<Number>& least, const SeparateLanes<Number>& x) {
  for (int a = 0; a < 3; ++a) least.at[a] = smaller(least.at[a], x.at[a]);
}
template <class Number>
ZKD_HOST_DEVICE void keep_most(SeparateLanes<Number>& most, const SeparateLanes<Number>& x) {
  for (int a = 0; a < 3; ++a) most.at[a] = larger(most.at[a], x.at[a]);
}
ZKD_HOST_DEVICE inline void rotate(const SeparateLanes<double>& from, SeparateLanes<double>& to) {
  to = {{from.at[1], from.at[2], from.at[0], 0.0}};
}
ZKD_HOST_DEVICE inline void take_magnitude(const SeparateLanes<double>& x,
                                           SeparateLanes<double>& size) {
  size = {{magnitude(x.at[0]), magnitude(x.at[1]), magnitude(x.at[2]), 0.0}};
}

#if defined(__CUDACC__) || !defined(__GNUC__)
using Lanes = SeparateLanes<double>;
using FloatLanes = SeparateLanes<float>;
#else
// None is passed or returned by value: without AVX code, compilers differ in how.
using Lanes = double __attribute__((vector_size(32)));
using FloatLanes = float __attribute__((vector_size(16)));

/// Three floats, no more, by two loads.
[[gnu::always_inline]] inline void load(const float* point, FloatLanes& to) {
  using Pairs = std::uint64_t __attribute__((vector_size(16)));
  std::uint64_t xy = 0;
  std::uint32_t z = 0;
  std::memcpy(&xy, point, sizeof xy);
  std::memcpy(&z, point + 2, sizeof z);
  to = reinterpret_cast<FloatLanes>(Pairs{xy, z});
}
[[gnu::always_inline]] inline void widen(const FloatLanes& from, Lanes& to) {
  to = __builtin_convertvector(from, Lanes);
}
template <class Vector>
[[gnu::always_inline]] inline void keep_least(Vector& least, const Vector& x) {
  least = x < least ? x : least;
}
template <class Vector>
[[gnu::always_inline]] inline void keep_most(Vector& most, const Vector& x) {
  most = most < x ? x : most;
}
[[gnu::always_inline]] inline void rotate(const Lanes& from, Lanes& to) {
#if defined(__clang__)
  to = __builtin_shufflevector(from, from, 1, 2, 0, 3);
#else
  using Places = std::int64_t __attribute__((vector_size(32)));
  to = __builtin_shuffle(from, Places{1, 2, 0, 3});
#endif
}
[[gnu::always_inline]] inline void take_magnitude(const Lanes& x, Lanes& size) {
  using Bits = std::int64_t __attribute__((vector_size(32)));
  size = reinterpret_cast<Lanes>(reinterpret_cast<Bits>(x) & 0x7FFF'FFFF'FFFF'FFFF);
}
#endif

}  // namespace zkd::core
