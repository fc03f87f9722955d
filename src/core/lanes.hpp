// SPDX-License-Identifier: Apache-2.0
//
// Four doubles at once: a point and a coordinate that is not used. On the host one vector (in AVX2
// code a register), on the device four numbers; every operation is rounded once, as written.
#pragma once

#include <cstdint>

#include <zkd/traversal/arithmetic.hpp>

namespace zkd::core {

#if defined(__CUDACC__) || !defined(__GNUC__)
struct Lanes {
  double at[4];
  ZKD_HOST_DEVICE double& operator[](std::uint32_t a) { return at[a]; }
  ZKD_HOST_DEVICE const double& operator[](std::uint32_t a) const { return at[a]; }
};
ZKD_HOST_DEVICE inline void lower(Lanes& least, const Lanes& x) {
  for (int a = 0; a < 3; ++a) least.at[a] = smaller(least.at[a], x.at[a]);
}
ZKD_HOST_DEVICE inline void raise(Lanes& most, const Lanes& x) {
  for (int a = 0; a < 3; ++a) most.at[a] = larger(most.at[a], x.at[a]);
}
/// from + s * (to - from)
ZKD_HOST_DEVICE inline void go(const Lanes& from, const Lanes& to, double s, Lanes& at) {
  for (int a = 0; a < 3; ++a) at.at[a] = from.at[a] + s * (to.at[a] - from.at[a]);
  at.at[3] = 0.0;
}
#else
// None is passed or returned by value: without AVX code, compilers differ in how.
using Lanes = double __attribute__((vector_size(32)));
[[gnu::always_inline]] inline void lower(Lanes& least, const Lanes& x) {
  least = x < least ? x : least;
}
[[gnu::always_inline]] inline void raise(Lanes& most, const Lanes& x) {
  most = most < x ? x : most;
}
[[gnu::always_inline]] inline void go(const Lanes& from, const Lanes& to, double s, Lanes& at) {
  at = from + s * (to - from);
}
/// (x, y, z) to (y, z, x).
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
