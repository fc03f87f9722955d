// SPDX-License-Identifier: Apache-2.0
//
// Exact predicates against polygon clipping in fractions and against cases made by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "support/random.hpp"
#include "verify/exact.hpp"

namespace zkd::verify {
namespace {

struct Fraction {
  std::int64_t n = 0;
  std::int64_t d = 1;

  Fraction(std::int64_t numerator = 0, std::int64_t denominator = 1)
      : n(denominator < 0 ? -numerator : numerator),
        d(denominator < 0 ? -denominator : denominator) {
    const std::int64_t common = std::gcd(n, d);
    n /= common;
    d /= common;
  }
  friend Fraction operator-(Fraction a, Fraction b) { return {a.n * b.d - b.n * a.d, a.d * b.d}; }
  friend Fraction operator+(Fraction a, Fraction b) { return {a.n * b.d + b.n * a.d, a.d * b.d}; }
  friend Fraction operator*(Fraction a, Fraction b) { return {a.n * b.n, a.d * b.d}; }
  friend Fraction operator/(Fraction a, Fraction b) { return {a.n * b.d, a.d * b.n}; }
};

using Vertex = std::array<Fraction, 3>;

// What of the polygon has sign * (x - at) >= 0 along the axis (Sutherland and Hodgman).
std::vector<Vertex> clipped(const std::vector<Vertex>& polygon, std::size_t axis, int sign,
                            int at) {
  std::vector<Vertex> rest;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vertex& a = polygon[i];
    const Vertex& b = polygon[(i + 1) % polygon.size()];
    const Fraction above_a = (a[axis] - at) * sign;
    const Fraction above_b = (b[axis] - at) * sign;
    if (above_a.n >= 0) rest.push_back(a);
    if ((above_a.n > 0 && above_b.n < 0) || (above_a.n < 0 && above_b.n > 0)) {
      const Fraction part = above_a / (above_a - above_b);
      Vertex between;
      for (std::size_t k = 0; k < 3; ++k) between[k] = a[k] + part * (b[k] - a[k]);
      rest.push_back(between);
    }
  }
  return rest;
}

TEST(VerifyExact, OverlapEqualsClippingOnSmallIntegers) {
  test::Random random(1);
  int overlaps = 0;
  int grazes = 0;
  constexpr int cases = 60000;
  for (int i = 0; i < cases; ++i) {
    const int width = 2 + i % 5;
    Corners corners{};
    std::vector<Vertex> polygon(3);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int x = random.integer(-width, width);
        corners[c][axis] = x;
        polygon[c][axis] = x;
      }
    }
    ExactBox box{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Points, segments and rectangles among the boxes.
      const int lo = random.integer(-width, width);
      const int hi = lo + random.integer(0, 2);
      box.lo[axis] = lo;
      box.hi[axis] = hi;
      polygon = clipped(clipped(polygon, axis, 1, lo), axis, -1, hi);
    }
    const bool want = !polygon.empty();
    ASSERT_EQ(exact_overlap(corners, box), want) << "case " << i;
    const double gap = separation(corners, box);
    if (want) {
      ASSERT_LE(gap, 1e-14) << "case " << i;
    } else {
      ASSERT_GT(gap, 1e-3) << "case " << i;
    }
    overlaps += want;
    grazes += want && gap > -1e-12;
    // The same decision anywhere a power of two puts it, and moved where floats are sparse.
    for (const double scale : {0x1p-200, 0x1p+200}) {
      Corners scaled = corners;
      ExactBox scaled_box = box;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (Point& corner : scaled) corner[axis] = corner[axis] * scale + 0x1p20 * scale;
        scaled_box.lo[axis] = scaled_box.lo[axis] * scale + 0x1p20 * scale;
        scaled_box.hi[axis] = scaled_box.hi[axis] * scale + 0x1p20 * scale;
      }
      ASSERT_EQ(exact_overlap(scaled, scaled_box), want) << "case " << i << " times " << scale;
    }
  }
  EXPECT_GT(overlaps, cases / 20);
  EXPECT_GT(grazes, cases / 50);
}

TEST(VerifyExact, OneUlpDecidesAnOverlap) {
  // The hypotenuse x + y = 2 passes the corner (1, 1) of the box.
  const Corners corners = {{{2, 0, 0}, {0, 2, 0}, {2, 2, 0}}};
  Box box;
  box.lo[0] = box.lo[1] = box.lo[2] = 0;
  box.hi[0] = box.hi[1] = box.hi[2] = 1;
  EXPECT_TRUE(exact_overlap(corners, box));
  box.hi[1] = test::ulps(1.0F, -1);
  EXPECT_FALSE(exact_overlap(corners, box));
  const Corners far_edge = {{{2, 0, 0}, {0, 2, -0x1p-149}, {2, 2, 0}}};
  box.hi[1] = 1.0F;
  box.lo[2] = 0.0F;
  EXPECT_FALSE(exact_overlap(far_edge, box));  // the middle of the edge is below z = 0
  EXPECT_FALSE(exact_overlap(corners, Box{}));
}

TEST(VerifyExact, ZeroArea) {
  EXPECT_TRUE(exact_zero_area({{{1, 2, 3}, {1, 2, 3}, {4, 5, 6}}}));
  EXPECT_TRUE(exact_zero_area({{{0, 0, 0}, {1, 2, 3}, {3, 6, 9}}}));
  EXPECT_FALSE(exact_zero_area({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}));
  // A float cross product of these is zero; their area is not.
  EXPECT_FALSE(exact_zero_area({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0x1p-149}}}));
  EXPECT_FALSE(exact_zero_area({{{0, 0, 0}, {0x1p127, 0x1p-149, 0}, {0x1p-149, 0x1p-149, 0}}}));
  EXPECT_FALSE(exact_zero_area({{{0x1p-149, 0, 0}, {0, 0x1p-149, 0}, {0, 0, 0x1p-149}}}));
}

TEST(VerifyExact, NormalsOfSliversCancel) {
  EXPECT_EQ(normal_condition({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}), 1.0);
  // The normal is (0, 0, 1) * 2^-30, from products of 1 and 1 + 2^-30.
  const double tiny = 0x1p-30;
  EXPECT_EQ(normal_condition({{{0, 0, 0}, {1, 1, 0}, {2, 2 + tiny, 0}}}), 0x1p31 + 1.0);
  EXPECT_EQ(normal_condition({{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}}),
            std::numeric_limits<double>::infinity());
}

TEST(VerifyExact, ValidTriangles) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<glm::vec3> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {nan, 0, 0}};
  const std::vector<glm::uvec3> faces = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 1, 1}};
  const TriangleView view(positions, faces);
  EXPECT_TRUE(valid_triangle(view, 0));
  EXPECT_FALSE(valid_triangle(view, 1));
  EXPECT_FALSE(valid_triangle(view, 2));
  EXPECT_FALSE(valid_triangle(view, 3));
  EXPECT_FALSE(finite_corners(view, 2).has_value());
  EXPECT_TRUE(finite_corners(view, 3).has_value());
}

TEST(VerifyExact, DeterminantSignsOfAnyFloats) {
  // Swapping two rows turns the sign, a repeated row gives zero: rules that no rounding keeps.
  test::Random random(2);
  const auto any = [&] {
    Point p{};
    for (double& x : p) x = static_cast<double>(random.any_finite());
    return p;
  };
  for (int i = 0; i < 20000; ++i) {
    const Point d = any();
    const Point o = any();
    const Point a = any();
    const Point b = any();
    ASSERT_EQ(determinant_sign(d, o, a, b), -determinant_sign(d, o, b, a));
    ASSERT_EQ(determinant_sign(d, o, a, a), 0);
    Point doubled = a;
    for (double& x : doubled) x *= 2;
    ASSERT_EQ(determinant_sign(d, {0, 0, 0}, a, doubled), 0);
    ASSERT_EQ(determinant_sign(a, {0, 0, 0}, a, b), 0);
  }
}

TEST(VerifyExact, PlaneHitIsTheNearestDouble) {
  const Corners third = {{{3, 0, 0}, {0, 3, 0}, {0, 0, 3}}};
  const PlaneHit hit = plane_hit({0, 0, 0}, {3, 3, 3}, third);
  EXPECT_EQ(hit.t, 1.0 / 3.0);
  EXPECT_EQ(hit.denominator, 81.0);
  EXPECT_NEAR(hit.normal, 9.0 * std::sqrt(3.0), 1e-14);
  EXPECT_EQ(plane_hit({0, 0, 0}, {-3, -3, -3}, third).t, -1.0 / 3.0);
  EXPECT_EQ(plane_hit({1, 1, 1}, {1, 0, 0}, third).t, 0.0);
  EXPECT_TRUE(std::isnan(plane_hit({0, 0, 0}, {1, -1, 0}, third).t));
  // 1 / (1 + 2^-60) rounds to 1, 2^400 apart from anything a float t could hold.
  const Corners far = {{{0x1p127, 0, 0}, {0x1p127, 1, 0}, {0x1p127, 0, 1}}};
  EXPECT_EQ(plane_hit({0, 0, 0}, {0x1p-149, 0, 0}, far).t, 0x1p276);
}

}  // namespace
// Corners a, b, c are at 1 along x, y, z: a ray from 0 meets their plane at its own shares.
TEST(VerifyExact, BarycentricsAreTheNearestDoubles) {
  const Corners unit = {Point{1, 0, 0}, Point{0, 1, 0}, Point{0, 0, 1}};
  const Barycentrics thirds = barycentrics({0, 0, 0}, {1, 1, 1}, unit);
  EXPECT_EQ(thirds.u, 1.0 / 3.0);
  EXPECT_EQ(thirds.v, 1.0 / 3.0);
  const Barycentrics sevenths = barycentrics({0, 0, 0}, {-1, -2, -4}, unit);
  EXPECT_EQ(sevenths.u, 2.0 / 7.0);
  EXPECT_EQ(sevenths.v, 4.0 / 7.0);
  const Barycentrics outside = barycentrics({2, 2, -1}, {0, 0, 1}, unit);  // meets it at z = -3
  EXPECT_EQ(outside.u, 2.0);
  EXPECT_EQ(outside.v, -3.0);
  EXPECT_TRUE(std::isnan(barycentrics({0, 0, 0}, {1, -1, 0}, unit).u));
}

}  // namespace zkd::verify
