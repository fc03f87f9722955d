// SPDX-License-Identifier: Apache-2.0
//
// Stage 2, the lattice that codes and planes live on. See zkd/lattice.hpp for what it promises.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/options.hpp>
#include <zkd/traversal/arithmetic.hpp>

namespace zkd::core {

/// 32-bit codes below this many valid triangles, 64-bit from there on, unless the caller decides:
/// a surface crosses about 2^21 cells of a lattice of 2^32.
inline constexpr std::uint32_t wide_code_threshold = 1u << 22;

ZKD_HOST_DEVICE inline std::uint32_t choose_code_bits(std::uint32_t asked, std::uint32_t valid) {
  if (asked != 0) return asked;
  return valid < wide_code_threshold ? 32 : 64;
}

/// A box in double, as the centres of crowded triangles have it.
struct WideBox {
  double lo[3] = {1.0e300, 1.0e300, 1.0e300};
  double hi[3] = {-1.0e300, -1.0e300, -1.0e300};

  ZKD_HOST_DEVICE void include(const double (&point)[3]) {
    for (int a = 0; a < 3; ++a) {
      lo[a] = smaller(lo[a], point[a]);
      hi[a] = larger(hi[a], point[a]);
    }
  }
  ZKD_HOST_DEVICE void combine(const WideBox& other) {
    for (int a = 0; a < 3; ++a) {
      lo[a] = smaller(lo[a], other.lo[a]);
      hi[a] = larger(hi[a], other.hi[a]);
    }
  }
};

ZKD_HOST_DEVICE inline WideBox widen(const Box& box) {
  WideBox wide;
  for (int a = 0; a < 3; ++a) {
    wide.lo[a] = static_cast<double>(box.lo[a]);
    wide.hi[a] = static_cast<double>(box.hi[a]);
  }
  return wide;
}

/// The smallest power of two that is larger than `x` >= 0, as an exponent.
ZKD_HOST_DEVICE inline int exponent_above(double x) { return exponent_of(x) + 1; }

/// One axis while the lattice is being made.
struct LatticeAxis {
  double lo;
  double hi;
  int side;      ///< the whole side is 2^side
  int smallest;  ///< cells are not smaller than 2^smallest: planes have to be floats
  std::uint32_t bits;

  [[nodiscard]] ZKD_HOST_DEVICE int cell() const { return side - static_cast<int>(bits); }
  [[nodiscard]] ZKD_HOST_DEVICE bool can_split() const { return lo < hi && cell() > smallest; }
};

/// Which axis the next level splits, or 3 for none.
ZKD_HOST_DEVICE inline int next_axis(const LatticeAxis (&axes)[3], AxisOrder order, int last) {
  if (order == AxisOrder::cyclic) {
    for (int step = 1; step <= 3; ++step) {
      const int a = (last + step) % 3;
      if (axes[a].can_split()) return a;
    }
    return 3;
  }
  int longest = 3;
  for (int a = 0; a < 3; ++a)
    if (axes[a].can_split() && (longest == 3 || axes[a].cell() > axes[longest].cell())) longest = a;
  return longest;
}

/// Deals `code_bits` bits to the axes and writes the schedule.
ZKD_HOST_DEVICE inline void schedule_axes(LatticeAxis (&axes)[3], std::uint32_t code_bits,
                                          AxisOrder order, Lattice& lattice) {
  for (LatticeAxis& axis : axes) axis.bits = 0;
  lattice = Lattice{};
  int last = 2;
  while (lattice.code_bits < code_bits) {
    last = next_axis(axes, order, last);
    if (last == 3) break;
    ++axes[last].bits;
    lattice.axis[lattice.code_bits++] = static_cast<std::uint8_t>(last);
  }
}

/// Whether [lo, hi] lies inside the lattice's cells along this axis and all their planes are
/// floats; if not, widens what was too tight. One cell needs neither: it has no planes.
ZKD_HOST_DEVICE inline bool settle(LatticeAxis& axis) {
  if (axis.bits == 0) return true;
  const double inverse = power_of_two(-axis.cell());
  const std::int64_t origin = floor_to_int(axis.lo * inverse);
  const std::int64_t last = floor_to_int(axis.hi * inverse);
  const std::int64_t end = origin + (std::int64_t{1} << axis.bits);
  constexpr std::int64_t exact = std::int64_t{1} << 24;
  if (last >= end) {
    ++axis.side;
    return false;
  }
  if (origin < -exact || end > exact) {
    ++axis.smallest;
    return false;
  }
  return true;
}

/// See zkd::stages::make_lattice. An inverted box gives a lattice without bits; cells are not
/// smaller than 2^finest.
ZKD_HOST_DEVICE inline Lattice make_lattice(const WideBox& box, std::uint32_t code_bits,
                                            AxisOrder order, std::int32_t finest) {
  Lattice lattice;
  LatticeAxis axes[3];
  for (int a = 0; a < 3; ++a) {
    if (!(box.lo[a] <= box.hi[a])) return lattice;
    const double extent = box.hi[a] - box.lo[a];
    const double largest = larger(magnitude(box.lo[a]), magnitude(box.hi[a]));
    const int resolution = largest > 0.0 ? exponent_above(largest) - 24 : finest;
    const int smallest = larger(resolution, finest);
    const int side = extent > 0.0 ? exponent_above(extent) : smallest;
    axes[a] = {box.lo[a], box.hi[a], larger(side, smallest), smallest, 0};
  }
  // Widening an axis once is enough to hold its box; dealing the bits again may disturb another.
  bool settled = false;
  while (!settled) {
    schedule_axes(axes, code_bits, order, lattice);
    settled = true;
    for (LatticeAxis& axis : axes) settled = settle(axis) && settled;
  }
  for (int a = 0; a < 3; ++a) {
    lattice.exponent[a] = axes[a].cell();
    lattice.bits[a] = axes[a].bits;
    lattice.origin[a] = floor_to_int(axes[a].lo * power_of_two(-axes[a].cell()));
  }
  for (std::uint32_t level = 0; level < lattice.code_bits; ++level)
    lattice.mask[lattice.axis[level]] |= std::uint64_t{1} << (lattice.code_bits - 1 - level);
  return lattice;
}

/// Position of plane `k` of axis `a`, exact.
ZKD_HOST_DEVICE inline double plane_position(const Lattice& lattice, int a, std::uint32_t k) {
  return static_cast<double>(lattice.origin[a] + static_cast<std::int64_t>(k)) *
         power_of_two(lattice.exponent[a]);
}

}  // namespace zkd::core
