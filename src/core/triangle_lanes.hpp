// SPDX-License-Identifier: Apache-2.0
//
// What validation asks of each triangle, over its three axes at once.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>

#include "core/lanes.hpp"

namespace zkd::core {

/// A triangle's corners. Of what they are is part of its name: device code has others.
template <class FloatLanes, class Lanes>
class TriangleLanesOf {
 public:
  [[gnu::always_inline]] explicit ZKD_HOST_DEVICE TriangleLanesOf(const Corners& c) {
    for (int corner = 0; corner < 3; ++corner) load(c.p[corner], p_[corner]);
  }

  /// Finite corners, and a projection that surely has an area; false says only that neither is
  /// certain.
  [[nodiscard, gnu::always_inline]] ZKD_HOST_DEVICE bool is_surely_valid() const {
    Lanes a;
    Lanes b;
    Lanes c;
    widen(p_[0], a);
    widen(p_[1], b);
    widen(p_[2], c);
    const Lanes e = b - a;
    const Lanes f = c - a;
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

  /// Of a valid triangle. Zeros lose their signs, so that equal coordinates have equal bits.
  [[gnu::always_inline]] ZKD_HOST_DEVICE void write_box(Box& box) const {
    FloatLanes least;
    FloatLanes most;
    find_box(least, most);
    for (std::uint32_t a = 0; a < 3; ++a) {
      box.lo[a] = least[a] + 0.0F;
      box.hi[a] = most[a] + 0.0F;
    }
  }

  /// Whether a side of that box is longer.
  [[nodiscard, gnu::always_inline]] ZKD_HOST_DEVICE bool has_side_above(float length) const {
    FloatLanes least;
    FloatLanes most;
    find_box(least, most);
    const FloatLanes sides = most - least;
    return larger(sides[0], larger(sides[1], sides[2])) > length;
  }

 private:
  [[gnu::always_inline]] ZKD_HOST_DEVICE void find_box(FloatLanes& least, FloatLanes& most) const {
    least = most = p_[0];
    for (int corner = 1; corner < 3; ++corner) {
      keep_least(least, p_[corner]);
      keep_most(most, p_[corner]);
    }
  }

  FloatLanes p_[3];
};

using TriangleLanes = TriangleLanesOf<FloatLanes, Lanes>;

}  // namespace zkd::core
