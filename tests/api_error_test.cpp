// SPDX-License-Identifier: Apache-2.0
//
// Errors of builds: reached by the input that they name, with the first offender, in every way to
// build, and nothing leaked.
#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "support/caught.hpp"
#include "support/platform_tree.hpp"
#include "support/strip.hpp"

namespace zkd {
namespace {

using test::Caught;
using test::caught;
using test::names;
using test::Strip;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

// The CPU's, which every way to build must give.
Caught build_error(const TriangleView& triangles, const BuildOptions& options = {}) {
  const Caught want = caught([&] { (void)build(cpu::Executor{.threads = 2}, triangles, options); });
  for (const test::WayToBuild& way : test::ways_to_build()) {
    const Caught got = caught([&] { (void)way.build(triangles, options); });
    EXPECT_EQ(got.thrown, want.thrown) << way.name;
    EXPECT_EQ(got.code, want.code) << way.name;
    EXPECT_EQ(got.offender, want.offender) << way.name;
    EXPECT_EQ(got.message, want.message) << way.name;
  }
  return want;
}

// ---- Triangles ----------------------------------------------------------------------------------

TEST(ApiError, IndexOutOfRange) {
  for (const std::uint32_t bad : {5002u, 5003u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
    Strip strip(5000);
    strip.faces[4321].z = bad;
    strip.faces[4999].x = bad;
    for (const InvalidTriangles policy : {InvalidTriangles::error, InvalidTriangles::skip}) {
      const Caught error = build_error(strip.view(), {.invalid_triangles = policy});
      EXPECT_ERROR(error, ErrorCode::index_out_of_range, 4321);
    }
  }
}

TEST(ApiError, NonFiniteVertex) {
  for (const float bad : {nan_value, infinity, -infinity}) {
    Strip strip(5000);
    strip.vertices[1234].y = bad;  // corner of triangles 1232, 1233, 1234
    strip.vertices[4000].x = nan_value;
    EXPECT_ERROR(build_error(strip.view()), ErrorCode::non_finite_vertex, 1232);
    EXPECT_FALSE(build_error(strip.view(), {.invalid_triangles = InvalidTriangles::skip}).thrown);
    const Tree tree = test::build(strip.view(), {.invalid_triangles = InvalidTriangles::skip});
    EXPECT_EQ(tree.statistics().skipped_non_finite, 6u);
  }
}

TEST(ApiError, TooManyTriangles) {
  const Strip strip(1);
  for (const std::uint64_t count : {max_count + 1, std::uint64_t{0xFFFFFFFF},
                                    std::uint64_t{0x100000001}, std::uint64_t{1} << 60}) {
    TriangleView view = strip.view();
    view.triangle_count = count;  // counted before anything is read
    EXPECT_ERROR(build_error(view), ErrorCode::too_many_triangles, count);
    EXPECT_ERROR(caught([&] { (void)memory_requirement(cpu::Executor{}, count); }),
                 ErrorCode::too_many_triangles, count);
  }
}

// ---- Views --------------------------------------------------------------------------------------

TEST(ApiError, SoupWithARemainder) {
  const std::vector<glm::vec3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}, {6, 6, 6}};
  for (const std::size_t count : {4u, 5u}) {
    const Caught error = build_error(TriangleView{std::span(corners).first(count)});
    ASSERT_TRUE(error.thrown);
    EXPECT_EQ(error.code, ErrorCode::invalid_view) << error.message;
    EXPECT_TRUE(names(error, std::to_string(error.offender))) << error.message;
  }
}

TEST(ApiError, OddStrides) {
  const Strip strip(3);
  for (const std::size_t stride : {0u, 1u, 4u, 8u, 11u, 13u, 14u, 15u, 17u}) {
    TriangleView view = strip.view();
    view.position_stride = stride;
    EXPECT_ERROR(build_error(view), ErrorCode::invalid_view, stride);
  }
}

TEST(ApiError, NullPositions) {
  TriangleView view = Strip(3).view();
  view.positions = nullptr;
  const std::vector<glm::uvec3> faces = {{0, 1, 2}};
  view.indices = &faces[0].x;
  view.triangle_count = 1;
  const Caught error = build_error(view);
  ASSERT_TRUE(error.thrown);
  EXPECT_EQ(error.code, ErrorCode::invalid_view) << error.message;
}

TEST(ApiError, MisalignedData) {
  const Strip strip(3);
  std::vector<std::byte> bytes(4 * strip.vertices.size() * sizeof(glm::vec3) + 8);
  for (const std::size_t by : {1u, 2u, 3u}) {
    TriangleView view = strip.view();
    view.positions = reinterpret_cast<const float*>(bytes.data() + by);
    Caught error = build_error(view);
    ASSERT_TRUE(error.thrown) << "positions";
    EXPECT_EQ(error.code, ErrorCode::invalid_view) << error.message;
    view = strip.view();
    view.indices = reinterpret_cast<const std::uint32_t*>(bytes.data() + by);
    error = build_error(view);
    ASSERT_TRUE(error.thrown) << "indices";
    EXPECT_EQ(error.code, ErrorCode::invalid_view) << error.message;
  }
}

TEST(ApiError, SoupWithFewerPositionsThanItNeeds) {
  const std::vector<glm::vec3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  TriangleView view{std::span(corners)};
  view.triangle_count = 2;
  EXPECT_TRUE(build_error(view).thrown);
}

// ---- Options ------------------------------------------------------------------------------------

TEST(ApiError, OptionsOutsideTheirRange) {
  const Strip strip(10);
  for (const std::uint32_t leaf_size : {1025u, 0xFFFFFFFFu}) {
    EXPECT_ERROR(build_error(strip.view(), {.leaf_size = leaf_size}), ErrorCode::invalid_option,
                 leaf_size);
  }
  for (const std::uint32_t code_bits : {65u, 128u, 0xFFFFFFFFu}) {
    EXPECT_ERROR(build_error(strip.view(), {.code_bits = code_bits}), ErrorCode::invalid_option,
                 code_bits);
  }
  for (const float budget : {0.0F, 0.99F, -1.0F, nan_value, infinity, -infinity}) {
    const Caught error = build_error(strip.view(), {.budget = budget});
    ASSERT_TRUE(error.thrown) << budget;
    EXPECT_EQ(error.code, ErrorCode::invalid_option) << budget << ": " << error.message;
    EXPECT_TRUE(names(error, "budget")) << error.message;
  }
  EXPECT_TRUE(names(build_error(strip.view(), {.leaf_size = 1025}), "leaf_size"));
  EXPECT_TRUE(names(build_error(strip.view(), {.code_bits = 65}), "code_bits"));
  for (const std::uint32_t good : {0u, 1u, 1024u}) {
    EXPECT_FALSE(build_error(strip.view(), {.leaf_size = good}).thrown);
  }
  for (std::uint32_t good = 0; good <= 64; ++good) {
    EXPECT_FALSE(build_error(strip.view(), {.code_bits = good}).thrown) << good;
  }
  EXPECT_FALSE(build_error(strip.view(), {.budget = 1.0F}).thrown);
}

TEST(ApiError, EnumeratorsThatDoNotExist) {
  const Strip strip(10);
  BuildOptions options;
  options.references = static_cast<References>(99);
  EXPECT_ERROR(build_error(strip.view(), options), ErrorCode::invalid_option, 99);
  options = {};
  options.builder = static_cast<Builder>(99);
  EXPECT_ERROR(build_error(strip.view(), options), ErrorCode::invalid_option, 99);
  options = {};
  options.quality = static_cast<Quality>(99);
  EXPECT_ERROR(build_error(strip.view(), options), ErrorCode::invalid_option, 99);
  options = {};
  options.axis_order = static_cast<AxisOrder>(99);
  EXPECT_ERROR(build_error(strip.view(), options), ErrorCode::invalid_option, 99);
  options = {};
  options.invalid_triangles = static_cast<InvalidTriangles>(99);
  EXPECT_ERROR(build_error(strip.view(), options), ErrorCode::invalid_option, 99);
  options = {};
  options.backend = static_cast<Backend>(99);
  EXPECT_ERROR(build_error(strip.view(), options), ErrorCode::invalid_option, 99);
}

TEST(ApiError, TheSahBuilderOnADevice) {
  if (test::backend() == Backend::cpu) GTEST_SKIP() << "not a device: see sah_build_test.cpp";
  const Strip strip(10);
  for (const BuildOptions& options :
       {BuildOptions{.builder = Builder::sah}, BuildOptions{.quality = Quality::high}}) {
    for (const test::WayToBuild& way : test::ways_to_build()) {
      const Caught error = caught([&] { (void)way.build(strip.view(), options); });
      ASSERT_TRUE(error.thrown) << way.name;
      EXPECT_EQ(error.code, ErrorCode::unsupported_option) << way.name << ": " << error.message;
      EXPECT_TRUE(names(error, "sah")) << way.name << ": " << error.message;
    }
  }
}

TEST(ApiError, OptionsAreCheckedForEmptyInputToo) {
  EXPECT_ERROR(build_error(TriangleView{}, {.leaf_size = 1025}), ErrorCode::invalid_option, 1025);
  EXPECT_ERROR(caught([] { (void)memory_requirement(cpu::Executor{}, 10, {.leaf_size = 1025}); }),
               ErrorCode::invalid_option, 1025);
}

}  // namespace
}  // namespace zkd
