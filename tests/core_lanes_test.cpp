// SPDX-License-Identifier: Apache-2.0
//
// What the host does with vectors the device does with separate numbers: both to the same bits.
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <limits>

#include "core/polygon.hpp"
#include "core/triangle_lanes.hpp"
#include "support/random.hpp"

namespace zkd::core {
namespace {

using test::Random;
using DevicePolygon = PolygonOf<SeparateLanes<double>>;
using DeviceTriangle = TriangleLanesOf<SeparateLanes<float>, SeparateLanes<double>>;

std::uint64_t bits(double x) { return std::bit_cast<std::uint64_t>(x); }
std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x); }

struct Coordinates {
  float at[3][3];
  [[nodiscard]] Corners corners() const { return {{at[0], at[1], at[2]}}; }
};

// One after the other: coordinates of a small lattice, with -0 and equal ones; of a unit box; any.
Coordinates random_triangle(Random& random, int kind) {
  Coordinates triangle{};
  for (auto& corner : triangle.at) {
    for (float& x : corner) {
      if (kind % 3 == 0)
        x = (random.one_in(2) ? -0.5F : 0.5F) * static_cast<float>(random.below(3));
      else
        x = kind % 3 == 1 ? random.unit() : random.any_finite();
    }
  }
  return triangle;
}

TEST(CoreLanes, TrianglesOfBothKindsAgree) {
  Random random(1);
  int certain = 0;
  int uncertain = 0;
  for (int i = 0; i < 30000; ++i) {
    const Coordinates triangle = random_triangle(random, i);
    const Corners corners = triangle.corners();
    const TriangleLanes host(corners);
    const DeviceTriangle device(corners);
    ASSERT_EQ(host.is_surely_valid(), device.is_surely_valid()) << i;
    ++(host.is_surely_valid() ? certain : uncertain);
    Box expected;
    Box got;
    host.write_box(expected);
    device.write_box(got);
    for (int a = 0; a < 3; ++a) {
      ASSERT_EQ(bits(expected.lo[a]), bits(got.lo[a])) << i;
      ASSERT_EQ(bits(expected.hi[a]), bits(got.hi[a])) << i;
    }
  }
  EXPECT_GT(certain, 1000);
  EXPECT_GT(uncertain, 100);
}

TEST(CoreLanes, NothingIsCertainOfWhatIsNotFinite) {
  Random random(2);
  constexpr float infinity = std::numeric_limits<float>::infinity();
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {infinity, -infinity, nan}) {
    for (int at = 0; at < 9; ++at) {
      Coordinates triangle = random_triangle(random, 1);
      triangle.at[at / 3][at % 3] = bad;
      const Corners corners = triangle.corners();
      EXPECT_FALSE(TriangleLanes(corners).is_surely_valid()) << bad << " at " << at;
      EXPECT_FALSE(DeviceTriangle(corners).is_surely_valid()) << bad << " at " << at;
    }
  }
}

template <class Polygon>
struct Cut {
  Polygon before;
  Polygon after;
  void place(const Corners& corners) { after.place(corners, 1.0); }
  void cut(std::uint32_t axis, double h, double sign) {
    before = after;
    after.cut(before, axis, h, sign);
  }
};

TEST(CoreLanes, PolygonsOfBothKindsAgree) {
  Random random(3);
  std::uint32_t longest = 0;
  for (int i = 0; i < 20000; ++i) {
    const Coordinates triangle = random_triangle(random, i);
    const Corners corners = triangle.corners();
    Cut<Polygon> host{};
    Cut<DevicePolygon> device{};
    host.place(corners);
    device.place(corners);
    for (std::uint32_t cut = 0; cut < 12; ++cut) {
      const std::uint32_t axis = random.below(3);
      const double lo = host.after.lo[axis];
      const double hi = host.after.hi[axis];
      const double sign = random.one_in(2) ? 1.0 : -1.0;
      const double h = lo + (hi - lo) * static_cast<double>(random.unit());
      host.cut(axis, h, sign);
      device.cut(axis, h, sign);
      ASSERT_EQ(host.after.corners, device.after.corners) << i;
      longest = larger(longest, host.after.corners);
      for (std::uint32_t a = 0; a < 3; ++a) {
        ASSERT_EQ(bits(host.after.lo[a] + 0.0), bits(device.after.lo[a] + 0.0)) << i;
        ASSERT_EQ(bits(host.after.hi[a] + 0.0), bits(device.after.hi[a] + 0.0)) << i;
        for (std::uint32_t k = 0; k < host.after.corners; ++k)
          ASSERT_EQ(bits(host.after.corner[k][a]), bits(device.after.corner[k][a])) << i;
      }
    }
  }
  EXPECT_GE(longest, 6u);
}

}  // namespace
}  // namespace zkd::core
