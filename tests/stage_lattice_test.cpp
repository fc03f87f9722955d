// SPDX-License-Identifier: Apache-2.0
//
// Stage 2, the lattice: integers decide, planes are exact floats, and a coordinate and a plane
// never disagree about which side it is on.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "support/plain_stages.hpp"
#include "support/random.hpp"

namespace zkd {
namespace {

using test::lattice_cell;
using test::lattice_plane;
using test::Random;
using test::ulps;

constexpr float max_float = std::numeric_limits<float>::max();
constexpr float tiny = std::numeric_limits<float>::denorm_min();
constexpr std::int64_t limit = std::int64_t{1} << 24;

Box box_of(float lx, float ly, float lz, float hx, float hy, float hz) {
  return {{lx, ly, lz}, {hx, hy, hz}};
}

struct Case {
  std::string name;
  Box box;
};

std::vector<Case> cases() {
  std::vector<Case> all = {
      {"unit cube", box_of(0, 0, 0, 1, 1, 1)},
      {"centred cube", box_of(-1, -1, -1, 1, 1, 1)},
      {"hi just below a power", box_of(0, 0, 0, ulps(1, -1), ulps(1, -1), ulps(1, -1))},
      {"hi just above a power", box_of(0, 0, 0, ulps(1, 1), ulps(1, 1), ulps(1, 1))},
      {"uneven", box_of(-3, 10, 0.1F, 97, 11, 0.2F)},
      {"corridor", box_of(0, 0, 0, 1e6F, 1, 1e-3F)},
      {"flat x", box_of(5, 0, 0, 5, 1, 1)},
      {"flat y", box_of(0, -7, 0, 1, -7, 1)},
      {"flat z", box_of(0, 0, 0, 1, 1, 0)},
      {"line", box_of(0.1F, 0.1F, -3, 0.1F, 0.1F, 4)},
      {"point", box_of(1, 2, 3, 1, 2, 3)},
      {"origin", box_of(0, 0, 0, 0, 0, 0)},
      {"everything", box_of(-max_float, -max_float, -max_float, max_float, max_float, max_float)},
      {"top half", box_of(max_float / 2, 0, -max_float, max_float, max_float, -max_float / 2)},
      {"top ulp", box_of(ulps(max_float, -1), ulps(max_float, -2), -max_float, max_float, max_float,
                         ulps(-max_float, 1))},
      {"denormals", box_of(0, -tiny, tiny, tiny, tiny, 4 * tiny)},
      {"one denormal and a cube", box_of(0, 0, 0, tiny, 1, 1)},
      {"all denormals", box_of(-1e-39F, 0, 1e-40F, 1e-39F, 1e-38F, 1e-38F)},
      {"straddles 0 by a denormal", box_of(-tiny, -1, -tiny, 1, tiny, tiny)},
      {"tiny and huge", box_of(-1e-30F, -1e30F, 0, 1e-30F, 1e30F, 1)},
      {"wide", box_of(1e-30F, -max_float, 16777216, 1e30F, tiny, 16777218)},
  };
  for (int n = 1; n <= 4; ++n) {
    for (const float at : {1e6F, -1e6F, 148376.0F, 1.6e7F, 1e30F}) {
      all.push_back(
          {"offset by some ulps", box_of(at, ulps(at, -n), at, ulps(at, n), at, ulps(at, 1))});
    }
  }
  for (int e = -149; e <= 127; e += 3) {
    const float s = std::ldexp(1.0F, e);
    all.push_back({"power of two", box_of(0, -s, s, s, s, s)});
    all.push_back({"beside a power of two", box_of(-s, 0, s / 2, 0, ulps(s, -1), ulps(s, 1))});
  }
  Random random(11);
  for (int i = 0; i < 400; ++i) {
    Box box;
    for (int a = 0; a < 3; ++a) {
      const float p = random.any_finite();
      float q = random.any_finite();
      if (random.one_in(3)) q = ulps(p, random.integer(-40, 40));
      if (random.one_in(4)) q = p * random.unit();
      box.lo[a] = std::min(p, q) + 0.0F;
      box.hi[a] = std::max(p, q) + 0.0F;
    }
    all.push_back({"random bits " + std::to_string(i), box});
  }
  for (int i = 0; i < 400; ++i) {
    Box box;
    const float size = std::ldexp(1.0F, random.integer(-20, 20));
    const glm::vec3 at = size * static_cast<float>(random.integer(0, 100)) * random.in_cube();
    for (int a = 0; a < 3; ++a) {
      box.lo[a] = at[a];
      box.hi[a] = at[a] + size * random.unit();
    }
    all.push_back({"random box " + std::to_string(i), box});
  }
  return all;
}

void expect_masks_partition_the_code(const Lattice& lattice) {
  EXPECT_EQ(lattice.code_bits, lattice.bits[0] + lattice.bits[1] + lattice.bits[2]);
  const std::uint64_t all =
      lattice.code_bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << lattice.code_bits) - 1;
  EXPECT_EQ(lattice.mask[0] | lattice.mask[1] | lattice.mask[2], all);
  EXPECT_EQ(lattice.mask[0] & lattice.mask[1], 0u);
  EXPECT_EQ(lattice.mask[0] & lattice.mask[2], 0u);
  EXPECT_EQ(lattice.mask[1] & lattice.mask[2], 0u);
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(static_cast<std::uint32_t>(std::popcount(lattice.mask[a])), lattice.bits[a]);
  }
  for (std::uint32_t level = 0; level < lattice.code_bits; ++level) {
    ASSERT_LT(lattice.axis[level], 3);
    EXPECT_TRUE((lattice.mask[lattice.axis[level]] >> (lattice.code_bits - 1 - level)) & 1u)
        << "level " << level;
  }
}

void expect_box_strictly_inside(const Lattice& lattice, const Box& box) {
  for (int a = 0; a < 3; ++a) {
    if (!(box.lo[a] < box.hi[a])) {
      EXPECT_EQ(lattice.bits[a], 0u) << "axis " << a << " is flat";
      continue;
    }
    if (lattice.bits[a] == 0) continue;  // no plane, so no cell to be in
    const std::int64_t cells = std::int64_t{1} << lattice.bits[a];
    EXPECT_LE(std::abs(std::int64_t{lattice.origin[a]}), limit) << "axis " << a;
    EXPECT_LE(std::abs(lattice.origin[a] + cells), limit) << "axis " << a;
    EXPECT_LE(lattice_plane(lattice, a, 0), static_cast<double>(box.lo[a])) << "axis " << a;
    EXPECT_GT(lattice_plane(lattice, a, cells), static_cast<double>(box.hi[a])) << "axis " << a;
  }
}

// Planes that can split something, those between two cells and within the box, are floats. (The
// outermost may lie beyond FLT_MAX.)
void expect_planes_are_floats_and_increase(const Lattice& lattice, const Box& box, int a,
                                           Random& random) {
  const std::int64_t cells = std::int64_t{1} << lattice.bits[a];
  for (int i = 0; i < 64; ++i) {
    const std::int64_t k =
        1 + (cells <= 64
                 ? i % (cells - 1)
                 : static_cast<std::int64_t>(random.below(static_cast<std::uint32_t>(cells - 1))));
    const double exact = lattice_plane(lattice, a, k);
    if (exact > static_cast<double>(box.hi[a])) continue;
    const auto rounded = static_cast<float>(exact);
    ASSERT_TRUE(std::isfinite(rounded)) << "plane " << k << " of axis " << a;
    ASSERT_EQ(static_cast<double>(rounded), exact) << "plane " << k << " of axis " << a;
    ASSERT_LT(lattice_plane(lattice, a, k - 1), exact);
    ASSERT_LT(exact, lattice_plane(lattice, a, k + 1));
  }
}

// P(k(x)) <= x < P(k(x) + 1) for x on planes, an ulp beside them, and anywhere.
void expect_cells_and_planes_agree(const Lattice& lattice, const Box& box, int a, Random& random) {
  const std::int64_t cells = std::int64_t{1} << lattice.bits[a];
  for (int i = 0; i < 48; ++i) {
    const auto k = static_cast<std::int64_t>(random.below(static_cast<std::uint32_t>(cells)));
    if (std::abs(lattice_plane(lattice, a, k)) > static_cast<double>(max_float)) continue;
    const auto plane = static_cast<float>(lattice_plane(lattice, a, k));
    const float between = box.lo[a] + (box.hi[a] / 2 - box.lo[a] / 2) * (2.0F * random.unit());
    for (const float x : {plane, ulps(plane, -1), ulps(plane, 1), box.lo[a], box.hi[a], between}) {
      if (!(x >= box.lo[a] && x <= box.hi[a])) continue;
      const std::int64_t cell = lattice_cell(lattice, a, static_cast<double>(x));
      ASSERT_GE(cell, 0);
      ASSERT_LT(cell, cells);
      ASSERT_LE(lattice_plane(lattice, a, cell), static_cast<double>(x));
      ASSERT_GT(lattice_plane(lattice, a, cell + 1), static_cast<double>(x));
      if (x == plane) {
        ASSERT_EQ(cell, k);
      }
      if (x < plane) {
        ASSERT_LT(cell, k);
      }
    }
  }
}

TEST(StageLattice, HoldsForEveryBoxWidthAndOrder) {
  Random random(12);
  for (const Case& c : cases()) {
    for (const std::uint32_t width : {1u, 2u, 3u, 7u, 16u, 31u, 32u, 33u, 48u, 63u, 64u}) {
      for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
        SCOPED_TRACE(c.name + ", " + std::to_string(width) + " bits, " + to_string(order));
        const Lattice lattice = stages::make_lattice(c.box, width, order);
        EXPECT_LE(lattice.code_bits, width);
        expect_masks_partition_the_code(lattice);
        expect_box_strictly_inside(lattice, c.box);
        for (int a = 0; a < 3; ++a) {
          if (lattice.bits[a] == 0) continue;
          ASSERT_LE(lattice.bits[a], 25u);
          expect_planes_are_floats_and_increase(lattice, c.box, a, random);
          expect_cells_and_planes_agree(lattice, c.box, a, random);
        }
        if (testing::Test::HasFailure()) return;
      }
    }
  }
}

// All bits are given out unless halving a cell would leave the floats or the 2^24 limit.
// Planes have to be floats where TreeView::scale puts them, too.
int finest_cell(const Box& box) {
  float largest = 0;
  for (int a = 0; a < 3; ++a) {
    largest = std::max({largest, std::abs(box.lo[a]), std::abs(box.hi[a])});
  }
  const int exponent = largest > 0 ? std::ilogb(largest) : 0;
  return exponent < 32 ? -149 : -149 + std::min(exponent, 126);
}

TEST(StageLattice, NoBitIsHeldBack) {
  for (const Case& c : cases()) {
    for (const std::uint32_t width : {1u, 3u, 16u, 32u, 64u}) {
      for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
        SCOPED_TRACE(c.name + ", " + std::to_string(width) + " bits, " + to_string(order));
        const Lattice lattice = stages::make_lattice(c.box, width, order);
        if (lattice.code_bits == width) continue;
        for (int a = 0; a < 3; ++a) {
          if (!(c.box.lo[a] < c.box.hi[a])) continue;
          const int finer = lattice.exponent[a] - 1;
          // What a lattice of half the cell needs at the least.
          const double low = std::floor(std::ldexp(static_cast<double>(c.box.lo[a]), -finer));
          const double high = std::floor(std::ldexp(static_cast<double>(c.box.hi[a]), -finer)) + 1;
          const double cells = std::exp2(std::ceil(std::log2(high - low)));
          const bool representable = finer >= finest_cell(c.box);
          const bool within = std::abs(low) <= static_cast<double>(limit) &&
                              std::abs(low + cells) <= static_cast<double>(limit);
          EXPECT_FALSE(representable && within && lattice.bits[a] < 23)
              << "axis " << a << " could be finer than 2^" << lattice.exponent[a] << ", bits "
              << lattice.bits[a];
        }
        if (testing::Test::HasFailure()) return;
      }
    }
  }
}

TEST(StageLattice, OrdinaryScenesGetEveryBit) {
  for (const std::uint32_t width : {1u, 2u, 3u, 30u, 32u, 63u, 64u}) {
    for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
      EXPECT_EQ(stages::make_lattice(box_of(-1, -1, -1, 1, 1, 1), width, order).code_bits, width);
      EXPECT_EQ(stages::make_lattice(box_of(0, 0, 0, 3, 2, 1.5F), width, order).code_bits, width);
    }
  }
}

TEST(StageLattice, EmptyBoxAndPointHaveNoBits) {
  EXPECT_EQ(stages::make_lattice(Box{}, 32).code_bits, 0u);
  EXPECT_EQ(stages::make_lattice(box_of(1, 2, 3, 1, 2, 3), 32).code_bits, 0u);
}

TEST(StageLattice, ByExtentHalvesTheLongestSide) {
  for (const Case& c : cases()) {
    for (const std::uint32_t width : {3u, 16u, 32u, 64u}) {
      SCOPED_TRACE(c.name + ", " + std::to_string(width) + " bits");
      const Lattice lattice = stages::make_lattice(c.box, width, AxisOrder::by_extent);
      int left[3];
      for (int a = 0; a < 3; ++a) left[a] = static_cast<int>(lattice.bits[a]);
      for (std::uint32_t level = 0; level < lattice.code_bits; ++level) {
        int longest = std::numeric_limits<int>::min();
        for (int a = 0; a < 3; ++a) {
          if (left[a] > 0) longest = std::max(longest, lattice.exponent[a] + left[a]);
        }
        const int a = lattice.axis[level];
        ASSERT_EQ(lattice.exponent[a] + left[a], longest) << "level " << level;
        --left[a];
      }
    }
  }
}

TEST(StageLattice, CyclicTakesTurns) {
  for (const Case& c : cases()) {
    for (const std::uint32_t width : {3u, 16u, 32u, 64u}) {
      SCOPED_TRACE(c.name + ", " + std::to_string(width) + " bits");
      const Lattice lattice = stages::make_lattice(c.box, width, AxisOrder::cyclic);
      std::uint32_t left[3];
      for (int a = 0; a < 3; ++a) left[a] = lattice.bits[a];
      int turn = 0;
      for (std::uint32_t level = 0; level < lattice.code_bits; ++level) {
        while (left[turn] == 0) turn = (turn + 1) % 3;
        ASSERT_EQ(lattice.axis[level], turn) << "level " << level;
        --left[turn];
        turn = (turn + 1) % 3;
      }
    }
  }
}

TEST(StageLattice, LongSidesAreSplitFirst) {
  const Lattice lattice = stages::make_lattice(box_of(0, 0, 0, 1000, 1, 1), 16);
  for (int level = 0; level < 8; ++level) EXPECT_EQ(lattice.axis[level], 0);
  EXPECT_GT(lattice.bits[0], lattice.bits[1] + 7);
}

TEST(StageLattice, PowersOfTwoOnlyMoveTheExponent) {
  Random random(13);
  for (int i = 0; i < 100; ++i) {
    Box box;
    for (int a = 0; a < 3; ++a) {
      const float p = random.signed_unit();
      const float q = random.signed_unit();
      box.lo[a] = std::min(p, q);
      box.hi[a] = std::max(p, q);
    }
    const Lattice at_one = stages::make_lattice(box, 48);
    for (const int e : {-60, -1, 1, 40, 100}) {
      Box scaled;
      for (int a = 0; a < 3; ++a) {
        scaled.lo[a] = std::ldexp(box.lo[a], e);
        scaled.hi[a] = std::ldexp(box.hi[a], e);
      }
      const Lattice lattice = stages::make_lattice(scaled, 48);
      ASSERT_EQ(lattice.code_bits, at_one.code_bits);
      for (int a = 0; a < 3; ++a) {
        ASSERT_EQ(lattice.bits[a], at_one.bits[a]);
        ASSERT_EQ(lattice.origin[a], at_one.origin[a]);
        ASSERT_EQ(lattice.exponent[a], at_one.exponent[a] + e);
        ASSERT_EQ(lattice.mask[a], at_one.mask[a]);
      }
      ASSERT_EQ(std::memcmp(lattice.axis, at_one.axis, sizeof lattice.axis), 0);
    }
  }
}

}  // namespace
}  // namespace zkd
