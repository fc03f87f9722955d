// SPDX-License-Identifier: Apache-2.0
//
// What validation asks of each triangle, over its three axes at once: on the host vectors of four
// lanes, the last one unused; on the device one axis after the other. Every answer is exact or says
// that it is not certain, so that both give the same.
#pragma once

#include <cstdint>
#include <cstring>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>

#include "core/lanes.hpp"

namespace zkd::core {

#if defined(__CUDACC__) || !defined(__GNUC__)
class TriangleLanes {
 public:
  explicit ZKD_HOST_DEVICE TriangleLanes(const Corners& c) : c_(c) {}

  [[nodiscard]] ZKD_HOST_DEVICE bool is_surely_valid() const {
    return all_finite(c_) && any_projection_surely_has_area(c_);
  }
  ZKD_HOST_DEVICE void write_box(Box& box) const {
    for (int a = 0; a < 3; ++a) {
      box.lo[a] = smaller(c_.p[0][a], smaller(c_.p[1][a], c_.p[2][a])) + 0.0F;
      box.hi[a] = larger(c_.p[0][a], larger(c_.p[1][a], c_.p[2][a])) + 0.0F;
    }
  }

 private:
  Corners c_;
};
#else
class TriangleLanes {
 public:
  [[gnu::always_inline]] explicit TriangleLanes(const Corners& c) {
    for (int corner = 0; corner < 3; ++corner) load(c.p[corner], p_[corner]);
  }

  [[nodiscard, gnu::always_inline]] bool is_surely_valid() const {
    const Lanes a = __builtin_convertvector(p_[0], Lanes);
    const Lanes e = __builtin_convertvector(p_[1], Lanes) - a;
    const Lanes f = __builtin_convertvector(p_[2], Lanes) - a;
    Lanes e_next;
    Lanes f_next;
    rotate(e, e_next);
    rotate(f, f_next);
    // projection_surely_has_area() in each lane: positive for certain. Without underflow a
    // difference has the sign that it should have.
    const Lanes left = e * f_next;
    const Lanes right = e_next * f;
    const Lanes difference = left - right;
    Lanes sizes[3];
    take_magnitude(difference, sizes[0]);
    take_magnitude(left, sizes[1]);
    take_magnitude(right, sizes[2]);
    const Lanes certain = sizes[0] - projection_bound * (sizes[1] + sizes[2]);
    // An infinite coordinate, or one that is no number, makes the two projections of its axis none;
    // here the third.
    const Lanes sum = a + e + f;
    const Lanes zero = sum - sum;
    Lanes zero_next;
    rotate(zero, zero_next);
    Lanes third;
    rotate(zero_next, third);
    const Lanes all = certain + third;
    return larger(all[0], larger(all[1], all[2])) > 0.0;
  }

  [[gnu::always_inline]] void write_box(Box& box) const {
    Floats least = p_[0] < p_[1] ? p_[0] : p_[1];
    least = (least < p_[2] ? least : p_[2]) + 0.0F;
    Floats most = p_[1] < p_[0] ? p_[0] : p_[1];
    most = (p_[2] < most ? most : p_[2]) + 0.0F;
    for (int a = 0; a < 3; ++a) {
      box.lo[a] = least[a];
      box.hi[a] = most[a];
    }
  }

 private:
  using Floats = float __attribute__((vector_size(16)));
  using Pairs = std::uint64_t __attribute__((vector_size(16)));

  /// Three floats, no more, by two loads.
  [[gnu::always_inline]] static void load(const float* from, Floats& to) {
    std::uint64_t xy = 0;
    std::uint32_t z = 0;
    std::memcpy(&xy, from, sizeof xy);
    std::memcpy(&z, from + 2, sizeof z);
    to = reinterpret_cast<Floats>(Pairs{xy, z});
  }

  Floats p_[3];
};
#endif

}  // namespace zkd::core
