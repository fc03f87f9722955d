// SPDX-License-Identifier: Apache-2.0
//
// Stage 1, validation and scene box, against exact arithmetic and the policies of its header.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "support/plain_stages.hpp"
#include "support/platform.hpp"
#include "support/random.hpp"

namespace zkd {
namespace {

using test::Random;
using test::ulps;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float max_float = std::numeric_limits<float>::max();
constexpr float tiny = std::numeric_limits<float>::denorm_min();

struct Validated {
  stages::SceneSummary summary;
  std::vector<Box> boxes;
};

Validated validate(const TriangleView& view, InvalidTriangles policy = InvalidTriangles::error,
                   const test::Executor& executor = test::executor(2)) {
  test::Array<Box> boxes(view.triangle_count);
  const stages::SceneSummary summary =
      stages::triangle_boxes(executor, test::upload(view), policy, boxes);
  return {summary, boxes.download()};
}

bool same_bits(const Box& a, const Box& b) {
  for (int i = 0; i < 3; ++i) {
    if (std::bit_cast<std::uint32_t>(a.lo[i]) != std::bit_cast<std::uint32_t>(b.lo[i]))
      return false;
    if (std::bit_cast<std::uint32_t>(a.hi[i]) != std::bit_cast<std::uint32_t>(b.hi[i]))
      return false;
  }
  return true;
}

// The definition: one triangle after the other, exact zero area, boxes grown in order.
Validated validate_plainly(const TriangleView& view) {
  Validated out;
  for (std::size_t i = 0; i < view.triangle_count; ++i) {
    Box box;
    const float* corner[3];
    bool finite = true;
    for (int c = 0; c < 3; ++c) {
      corner[c] = view.position(view.index(i, c));
      for (int a = 0; a < 3; ++a) finite = finite && std::isfinite(corner[c][a]);
    }
    if (!finite) {
      ++out.summary.non_finite;
    } else if (test::has_zero_area(corner[0], corner[1], corner[2])) {
      ++out.summary.zero_area;
    } else {
      ++out.summary.valid;
      for (int a = 0; a < 3; ++a) {
        for (const float* p : corner) {
          box.lo[a] = std::min(box.lo[a], p[a]);
          box.hi[a] = std::max(box.hi[a], p[a]);
        }
        if (box.lo[a] == 0.0F) box.lo[a] = 0.0F;
        if (box.hi[a] == 0.0F) box.hi[a] = 0.0F;
        out.summary.bounds.lo[a] = std::min(out.summary.bounds.lo[a], box.lo[a]);
        out.summary.bounds.hi[a] = std::max(out.summary.bounds.hi[a], box.hi[a]);
      }
    }
    out.boxes.push_back(box);
  }
  return out;
}

// A box without sign on its zeros.
void expect_no_negative_zero(const Box& box) {
  for (int a = 0; a < 3; ++a) {
    EXPECT_FALSE(box.lo[a] == 0.0F && std::signbit(box.lo[a]));
    EXPECT_FALSE(box.hi[a] == 0.0F && std::signbit(box.hi[a]));
  }
}

void expect_same(const Validated& got, const Validated& want, const TriangleView& view) {
  ASSERT_EQ(got.boxes.size(), want.boxes.size());
  for (std::size_t i = 0; i < want.boxes.size(); ++i) {
    ASSERT_EQ(got.boxes[i].empty(), want.boxes[i].empty())
        << "triangle " << i << " of " << view.triangle_count;
    if (want.boxes[i].empty()) continue;
    for (int a = 0; a < 3; ++a) {
      ASSERT_EQ(got.boxes[i].lo[a], want.boxes[i].lo[a]) << "triangle " << i;
      ASSERT_EQ(got.boxes[i].hi[a], want.boxes[i].hi[a]) << "triangle " << i;
    }
    expect_no_negative_zero(got.boxes[i]);
  }
  EXPECT_EQ(got.summary.valid, want.summary.valid);
  EXPECT_EQ(got.summary.zero_area, want.summary.zero_area);
  EXPECT_EQ(got.summary.non_finite, want.summary.non_finite);
  EXPECT_EQ(got.summary.bounds.empty(), want.summary.bounds.empty());
  if (!want.summary.bounds.empty()) {
    for (int a = 0; a < 3; ++a) {
      EXPECT_EQ(got.summary.bounds.lo[a], want.summary.bounds.lo[a]);
      EXPECT_EQ(got.summary.bounds.hi[a], want.summary.bounds.hi[a]);
    }
    expect_no_negative_zero(got.summary.bounds);
  }
}

void expect_as_defined(const std::vector<glm::vec3>& corners) {
  const TriangleView view{std::span(corners)};
  expect_same(validate(view, InvalidTriangles::skip), validate_plainly(view), view);
}

// ---- Boxes and exact zero area ------------------------------------------------------------------

TEST(StageValidate, NoTriangles) {
  const Validated got = validate(TriangleView{});
  EXPECT_TRUE(got.summary.bounds.empty());
  EXPECT_EQ(got.summary.valid, 0u);
  EXPECT_EQ(got.summary.zero_area, 0u);
  EXPECT_EQ(got.summary.non_finite, 0u);
}

TEST(StageValidate, RandomTriangles) {
  Random random(1);
  std::vector<glm::vec3> corners(3 * 5000);
  for (glm::vec3& p : corners) p = random.in_cube();
  expect_as_defined(corners);
}

TEST(StageValidate, SmallIntegerCoordinatesHaveManyZeroAreas) {
  Random random(2);
  std::vector<glm::vec3> corners(3 * 20000);
  for (glm::vec3& p : corners) {
    p = {static_cast<float>(random.integer(-2, 2)), static_cast<float>(random.integer(-2, 2)),
         random.one_in(2) ? 0.0F : -0.0F};
  }
  const TriangleView view{std::span(corners)};
  const Validated want = validate_plainly(view);
  ASSERT_GT(want.summary.zero_area, 1000u);
  ASSERT_GT(want.summary.valid, 1000u);
  expect_same(validate(view), want, view);
}

// c on the line through a and b, exactly or one ulp beside it: rounding hides the difference.
TEST(StageValidate, SliversAnUlpFromTheirLine) {
  Random random(3);
  std::vector<glm::vec3> corners;
  for (int i = 0; i < 20000; ++i) {
    glm::vec3 a;
    glm::vec3 b;
    glm::vec3 c;
    for (int axis = 0; axis < 3; ++axis) {
      const float start = static_cast<float>(random.integer(-4000000, 4000000));
      const float step = static_cast<float>(random.integer(-1000, 1000));
      a[axis] = start;
      b[axis] = start + step;
      c[axis] = start + 3.0F * step;
    }
    const int nudged = random.integer(-1, 2);
    if (nudged >= 0) c[nudged] = ulps(c[nudged], random.one_in(2) ? 1 : -1);
    corners.insert(corners.end(), {a, b, c});
  }
  const TriangleView view{std::span(corners)};
  const Validated want = validate_plainly(view);
  ASSERT_GT(want.summary.zero_area, 1000u);
  ASSERT_GT(want.summary.valid, 1000u);
  expect_same(validate(view), want, view);
}

TEST(StageValidate, SliverWhoseFloatCrossProductVanishesIsValid) {
  // (b - a) x (c - a) is 2^-70 at its largest, its float evaluation 1 - 1 = 0.
  const float e = 0x1p-23F;
  const std::vector<glm::vec3> corners = {{0, 0, 0}, {1 + e, 1, 0}, {1, 1 - e / 2, 0}};
  const float x = corners[1].x * corners[2].y;
  const float y = corners[1].y * corners[2].x;
  ASSERT_FALSE(test::has_zero_area(&corners[0].x, &corners[1].x, &corners[2].x));
  ASSERT_LE(std::abs(x - y), e) << "the example must be hard";
  EXPECT_EQ(validate(TriangleView{std::span(corners)}).summary.valid, 1u);

  // Products that underflow to nothing in float, in double only just not.
  const std::vector<glm::vec3> small = {{0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}};
  EXPECT_EQ(validate(TriangleView{std::span(small)}).summary.valid, 1u);

  // Edges that overflow float.
  const std::vector<glm::vec3> large = {{-max_float, 0, 0}, {max_float, 0, 0}, {0, tiny, 0}};
  EXPECT_EQ(validate(TriangleView{std::span(large)}).summary.valid, 1u);
  const std::vector<glm::vec3> line = {
      {-max_float, -max_float, 1}, {max_float, max_float, 1}, {tiny, tiny, 1}};
  EXPECT_EQ(validate(TriangleView{std::span(line)}).summary.zero_area, 1u);

  // A point next to a huge segment: every difference rounds to the segment itself.
  const std::vector<glm::vec3> beside = {{1e30F, 1e30F, 0}, {-1e30F, -1e30F, 0}, {tiny, 0, 0}};
  EXPECT_EQ(validate(TriangleView{std::span(beside)}).summary.valid, 1u);
}

TEST(StageValidate, AnyFiniteBits) {
  Random random(4);
  std::vector<glm::vec3> corners(3 * 20000);
  for (glm::vec3& p : corners) p = {random.any_finite(), random.any_finite(), random.any_finite()};
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    switch (random.below(6)) {
      case 0:
        corners[i + 1] = corners[i];
        break;
      case 1:
        corners[i + 2] = corners[i + 1];
        break;
      case 2:  // along an axis: collinear
        corners[i + 1] = {corners[i].x, corners[i].y, corners[i + 1].z};
        corners[i + 2] = {corners[i].x, corners[i].y, corners[i + 2].z};
        break;
      case 3:  // through the origin: collinear with its double
        corners[i] = {0.0F, -0.0F, 0.0F};
        corners[i + 1] *= 0.25F;
        corners[i + 2] = 2.0F * corners[i + 1];
        break;
      default:
        break;
    }
  }
  expect_as_defined(corners);
}

TEST(StageValidate, NegativeZeroBecomesPositive) {
  const std::vector<glm::vec3> corners = {{-0.0F, -1, -0.0F}, {-0.0F, 0, -0.0F}, {1, -0.0F, -0.0F}};
  const Validated got = validate(TriangleView{std::span(corners)});
  ASSERT_EQ(got.summary.valid, 1u);
  expect_no_negative_zero(got.boxes[0]);
  expect_no_negative_zero(got.summary.bounds);
}

// ---- Policies and first offenders ---------------------------------------------------------------

void expect_error(const TriangleView& view, InvalidTriangles policy, ErrorCode code,
                  std::uint64_t offender, const test::Executor& executor) {
  try {
    (void)validate(view, policy, executor);
    FAIL() << "expected " << to_string(code);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_EQ(error.offender(), offender) << error.what();
    EXPECT_NE(std::string(error.what()).find(std::to_string(offender)), std::string::npos)
        << "message names no offender: " << error.what();
  }
}

struct Grid {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;

  explicit Grid(std::uint32_t count) {
    Random random(5);
    vertices.resize(count + 2);
    for (glm::vec3& p : vertices) p = random.in_cube();
    for (std::uint32_t i = 0; i < count; ++i) faces.emplace_back(i, i + 1, i + 2);
  }
  [[nodiscard]] TriangleView view() const { return {vertices, faces}; }
};

TEST(StageValidate, FirstNonFiniteTriangleIsNamed) {
  for (const float bad : {nan_value, infinity, -infinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      Grid grid(50000);
      const auto corner = [&](std::uint32_t face, int c) -> glm::vec3& {
        grid.vertices.push_back(grid.vertices[grid.faces[face][c]]);
        grid.faces[face][c] = static_cast<std::uint32_t>(grid.vertices.size() - 1);
        return grid.vertices.back();
      };
      corner(49999, 0)[axis] = bad;
      corner(31007, axis)[axis] = bad;
      corner(31008, 1)[axis] = nan_value;
      for (const test::Executor& executor : test::executors(4)) {
        expect_error(grid.view(), InvalidTriangles::error, ErrorCode::non_finite_vertex, 31007,
                     executor);
      }
      const Validated skipped = validate(grid.view(), InvalidTriangles::skip);
      EXPECT_EQ(skipped.summary.non_finite, 3u);
      EXPECT_EQ(skipped.summary.valid, 49997u);
      EXPECT_TRUE(skipped.boxes[31007].empty());
      expect_same(skipped, validate_plainly(grid.view()), grid.view());
    }
  }
}

TEST(StageValidate, NonFiniteAndZeroAreaIsNonFinite) {
  const std::vector<glm::vec3> corners(3, glm::vec3(1.0F, nan_value, 0.0F));
  const Validated got = validate(TriangleView{std::span(corners)}, InvalidTriangles::skip);
  EXPECT_EQ(got.summary.non_finite, 1u);
  EXPECT_EQ(got.summary.zero_area, 0u);
  EXPECT_TRUE(got.summary.bounds.empty());
}

TEST(StageValidate, FirstTriangleWithAnIndexOutOfRangeIsNamed) {
  for (const std::uint32_t offset : {0u, 1u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
    for (int c = 0; c < 3; ++c) {
      Grid grid(50000);
      const auto past = static_cast<std::uint32_t>(grid.vertices.size());
      const std::uint32_t bad = offset > 1 ? offset : past + offset;
      grid.faces[49999][c] = bad;
      grid.faces[12345][c] = bad;
      for (const InvalidTriangles policy : {InvalidTriangles::error, InvalidTriangles::skip}) {
        for (const test::Executor& executor : test::executors(4)) {
          expect_error(grid.view(), policy, ErrorCode::index_out_of_range, 12345, executor);
        }
      }
      grid.faces[12345][c] = past - 1;
      grid.faces[49999][c] = past - 1;
      EXPECT_NO_THROW((void)validate(grid.view()));
    }
  }
}

TEST(StageValidate, IndicesWithoutAnyVertex) {
  const std::vector<glm::uvec3> faces = {{0, 1, 2}};
  const TriangleView view{std::span<const glm::vec3>{}, std::span<const glm::uvec3>(faces)};
  EXPECT_THROW((void)validate(view), Error);
}

TEST(StageValidate, UnreferencedVerticesDoNotMatter) {
  Grid grid(100);
  const Validated before = validate(grid.view());
  grid.vertices.emplace_back(nan_value, 0.0F, infinity);
  grid.vertices.emplace_back(1e30F, 1e30F, 1e30F);
  const Validated after = validate(grid.view());
  EXPECT_EQ(after.summary.valid, before.summary.valid);
  EXPECT_TRUE(same_bits(after.summary.bounds, before.summary.bounds));
}

// ---- Views --------------------------------------------------------------------------------------

TEST(StageValidate, StridedAndPackedAndSoupAgree) {
  const Grid grid(3001);
  const Validated packed = validate(grid.view());
  for (const std::size_t stride : {12u, 16u, 20u, 24u, 36u, 100u}) {
    std::vector<float> vertices(grid.vertices.size() * stride / 4, nan_value);
    for (std::size_t i = 0; i < grid.vertices.size(); ++i) {
      for (int a = 0; a < 3; ++a) {
        vertices[i * stride / 4 + static_cast<std::size_t>(a)] = grid.vertices[i][a];
      }
    }
    const TriangleView view =
        TriangleView::strided(vertices.data(), grid.vertices.size(), stride, grid.faces);
    const Validated strided = validate(view);
    EXPECT_TRUE(same_bits(strided.summary.bounds, packed.summary.bounds));
    for (std::size_t i = 0; i < packed.boxes.size(); ++i) {
      ASSERT_TRUE(same_bits(strided.boxes[i], packed.boxes[i])) << "stride " << stride;
    }
  }
  std::vector<glm::vec3> corners;
  for (const glm::uvec3& face : grid.faces) {
    for (int c = 0; c < 3; ++c) corners.push_back(grid.vertices[face[c]]);
  }
  const Validated soup = validate(TriangleView{std::span(corners)});
  for (std::size_t i = 0; i < packed.boxes.size(); ++i) {
    ASSERT_TRUE(same_bits(soup.boxes[i], packed.boxes[i]));
  }
}

TEST(StageValidate, EveryThreadCountAgrees) {
  const Grid grid(10007);
  const Validated one = validate(grid.view(), InvalidTriangles::error, test::executor(1));
  for (const test::Executor& executor : test::executors(4)) {
    const Validated more = validate(grid.view(), InvalidTriangles::error, executor);
    EXPECT_TRUE(same_bits(more.summary.bounds, one.summary.bounds));
    for (std::size_t i = 0; i < one.boxes.size(); ++i) {
      ASSERT_TRUE(same_bits(more.boxes[i], one.boxes[i]));
    }
  }
}

TEST(StageValidate, BoxesOfTheWrongLengthAreRefused) {
  const Grid grid(10);
  for (const std::size_t length : {0u, 9u, 11u}) {
    test::Array<Box> boxes(length);
    try {
      (void)stages::triangle_boxes(test::executor(), test::upload(grid.view()),
                                   InvalidTriangles::error, boxes);
      ADD_FAILURE() << "length " << length << " was taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_view);
    }
  }
}

}  // namespace
}  // namespace zkd
