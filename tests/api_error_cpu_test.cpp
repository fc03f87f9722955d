// SPDX-License-Identifier: Apache-2.0
//
// Errors that no device has a part in: memory and threads of the CPU, a backend that is not linked,
// names, arguments of stages, and what decides on counts too large to be tried.
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <memory_resource>
#include <string>
#include <vector>

#include <zkd/stages.hpp>
#include <zkd/zkd.hpp>

#include "core/status.hpp"
#include "support/caught.hpp"
#include "support/strip.hpp"

namespace zkd {
namespace {

using test::Caught;
using test::caught;
using test::names;
using test::Strip;

TEST(ApiErrorCpu, BackendThatIsNotThere) {
  const Strip strip(10);
  const Caught error = caught([&] { (void)build(strip.view(), {.backend = Backend::cuda}); });
  ASSERT_TRUE(error.thrown);
  EXPECT_EQ(error.code, ErrorCode::backend_unavailable) << error.message;
  EXPECT_TRUE(names(error, "cuda") || names(error, "CUDA")) << error.message;
  EXPECT_NO_THROW((void)build(strip.view(), {.backend = Backend::cpu}));
  EXPECT_NO_THROW((void)build(strip.view(), {.backend = Backend::automatic}));
  EXPECT_NO_THROW((void)build(cpu::Executor{}, strip.view(), {.backend = Backend::cuda}))
      << "with an executor the backend is not looked at";
}

TEST(ApiErrorCpu, OutOfMemory) {
  const Strip strip(100);
  const Caught error = caught([&] {
    (void)build(cpu::Executor{.memory = std::pmr::null_memory_resource()}, strip.view());
  });
  ASSERT_TRUE(error.thrown);
  EXPECT_EQ(error.code, ErrorCode::out_of_memory) << error.message;
  EXPECT_GT(error.offender, 0u);
  EXPECT_TRUE(names(error, std::to_string(error.offender))) << error.message;
}

// An absurd number of threads is refused or made sensible; it never crashes or changes the tree.
TEST(ApiErrorCpu, AbsurdThreadCounts) {
  const Strip strip(100);
  for (const int threads : {-1, std::numeric_limits<int>::min(), 1000}) {
    const Caught error =
        caught([&] { (void)build(cpu::Executor{.threads = threads}, strip.view()); });
    if (threads > 0) {
      EXPECT_FALSE(error.thrown) << error.message;
    } else if (error.thrown) {
      EXPECT_EQ(error.code, ErrorCode::invalid_option) << error.message;
    }
  }
}

// ---- Names and stages ---------------------------------------------------------------------------

TEST(ApiErrorCpu, CodesHaveTheirNames) {
  EXPECT_STREQ(to_string(ErrorCode::index_out_of_range), "index_out_of_range");
  EXPECT_STREQ(to_string(ErrorCode::non_finite_vertex), "non_finite_vertex");
  EXPECT_STREQ(to_string(ErrorCode::too_many_triangles), "too_many_triangles");
  EXPECT_STREQ(to_string(ErrorCode::too_many_references), "too_many_references");
  EXPECT_STREQ(to_string(ErrorCode::reference_capacity), "reference_capacity");
  EXPECT_STREQ(to_string(ErrorCode::invalid_view), "invalid_view");
  EXPECT_STREQ(to_string(ErrorCode::invalid_option), "invalid_option");
  EXPECT_STREQ(to_string(ErrorCode::unsupported_option), "unsupported_option");
  EXPECT_STREQ(to_string(ErrorCode::backend_unavailable), "backend_unavailable");
  EXPECT_STREQ(to_string(ErrorCode::out_of_memory), "out_of_memory");
}

TEST(ApiErrorCpu, OptionsHaveTheirNames) {
  EXPECT_STREQ(to_string(Backend::automatic), "auto");
  EXPECT_STREQ(to_string(Backend::cpu), "cpu");
  EXPECT_STREQ(to_string(Backend::cuda), "cuda");
  EXPECT_STREQ(to_string(References::once), "once");
  EXPECT_STREQ(to_string(References::budget), "budget");
  EXPECT_STREQ(to_string(References::all), "all");
  EXPECT_STREQ(to_string(References::automatic), "auto");
  EXPECT_STREQ(to_string(Builder::morton), "morton");
  EXPECT_STREQ(to_string(Builder::sah), "sah");
  EXPECT_STREQ(to_string(Builder::wu2011), "wu2011");
  EXPECT_STREQ(to_string(Quality::fast), "fast");
  EXPECT_STREQ(to_string(Quality::balanced), "balanced");
  EXPECT_STREQ(to_string(Quality::high), "high");
  EXPECT_STREQ(to_string(InvalidTriangles::error), "error");
  EXPECT_STREQ(to_string(InvalidTriangles::skip), "skip");
  EXPECT_STREQ(to_string(AxisOrder::by_extent), "extent");
  EXPECT_STREQ(to_string(AxisOrder::cyclic), "cyclic");
  EXPECT_STREQ(to_string(Stage::validate), "validate");
  EXPECT_STREQ(to_string(Stage::tight_boxes), "tight_boxes");
}

TEST(ApiErrorCpu, StagesCheckTheirArguments) {
  const Box unit{{0, 0, 0}, {1, 1, 1}};
  for (const std::uint32_t code_bits : {0u, 65u}) {
    EXPECT_ERROR(caught([&] { (void)stages::make_lattice(unit, code_bits); }),
                 ErrorCode::invalid_option, code_bits);
  }
  const std::vector<stages::TrunkKey> keys(3);
  std::vector<std::uint32_t> first(3);
  for (const std::uint32_t leaf_size : {0u, 1025u}) {
    EXPECT_ERROR(
        caught([&] { (void)stages::find_trunks(cpu::Executor{}, keys, leaf_size, first); }),
        ErrorCode::invalid_option, leaf_size);
  }
}

// More than 2^31 - 1 references would take tens of GB: what decides is asked directly.
TEST(ApiErrorCpu, TooManyReferences) {
  core::BuildCounts counts;
  counts.references_needed = max_count;
  core::AdmitReferences{&counts, &counts.references, max_count}(0);
  EXPECT_FALSE(counts.status.failed);
  EXPECT_EQ(counts.references, max_count);

  const std::uint64_t needed = (std::uint64_t{1} << 32) + 5;  // 5 in 32 bits
  counts.references_needed = needed;
  counts.trunks = 7;
  core::AdmitReferences{&counts, &counts.references, max_count}(0);
  EXPECT_EQ(counts.trunks, 0u) << "a build that failed goes on with nothing";
  EXPECT_ERROR(caught([&] { core::raise(counts.status, {}); }), ErrorCode::too_many_references,
               needed);
}

// Where room was made beforehand, too little of it is an error that says how much there should be.
TEST(ApiErrorCpu, ReferenceCapacity) {
  core::BuildCounts counts;
  counts.references_needed = 1001;
  core::AdmitReferences{&counts, &counts.references, 1000}(0);
  const auto error = caught([&] { core::raise(counts.status, {}); });
  EXPECT_ERROR(error, ErrorCode::reference_capacity, 1001);
  EXPECT_NE(error.message.find("1000"), std::string::npos) << error.message;
}

// Single stages check the indices that they follow.
TEST(ApiErrorCpu, StagesCheckTheIndicesThatTheyFollow) {
  const std::vector<Box> boxes(2);
  const std::vector<std::uint64_t> codes(2);
  std::vector<std::uint32_t> ids = {0, 7};
  std::vector<stages::TrunkKey> keys(2);
  std::vector<std::uint32_t> crowd(2);
  const auto code_of = [](const auto& call) {
    try {
      call();
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::out_of_memory;  // none of these
  };
  EXPECT_EQ(code_of([&] {
              (void)stages::recode_crowded(cpu::Executor{}, boxes, {}, codes, ids, 4,
                                           AxisOrder::by_extent, true, keys, crowd, {});
            }),
            ErrorCode::invalid_view);

  const std::vector<std::uint8_t> levels = {stages::first_fine_level};
  std::vector<std::uint32_t> axes(1);
  std::vector<float> planes(1);
  crowd = {0, 3};
  EXPECT_EQ(code_of([&] {
              stages::split_planes(cpu::Executor{}, keys, levels, crowd, {},
                                   std::vector<Lattice>(1), axes, planes);
            }),
            ErrorCode::invalid_view);

  const std::vector<std::uint32_t> first = {0, 1};
  const std::vector<Link> children = {Link::leaf(0), Link::leaf(9)};
  ids = {0, 1};
  const stages::Skeleton skeleton{ids, first, levels, children, Link::node(0), axes, planes};
  const std::vector<std::uint32_t> offsets = {0, 1, 2};
  std::vector<Node> nodes(1);
  EXPECT_EQ(
      code_of([&] { stages::tight_boxes(cpu::Executor{}, boxes, skeleton, offsets, ids, nodes); }),
      ErrorCode::invalid_view);

  Box infinite;
  infinite.lo[0] = infinite.lo[1] = infinite.lo[2] = 0.0F;
  infinite.hi[0] = infinite.hi[1] = infinite.hi[2] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(code_of([&] { (void)stages::make_lattice(infinite, 32); }), ErrorCode::invalid_view);
}

}  // namespace
}  // namespace zkd
