// SPDX-License-Identifier: Apache-2.0
//
// Every ErrorCode: reached by the input that it names, with the first offender, and nothing leaked.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <zkd/stages.hpp>
#include <zkd/zkd.hpp>

#include "core/status.hpp"
#include "support/memory.hpp"

namespace zkd {
namespace {

using test::CountingResource;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

// A strip of `count` triangles.
struct Strip {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;

  explicit Strip(std::uint32_t count) {
    for (std::uint32_t i = 0; i < count + 2; ++i) {
      vertices.emplace_back(static_cast<float>(i / 2), static_cast<float>(i % 2), 0.0F);
    }
    for (std::uint32_t i = 0; i < count; ++i) faces.emplace_back(i, i + 1, i + 2);
  }
  [[nodiscard]] TriangleView view() const { return {vertices, faces}; }
};

struct Caught {
  bool thrown = false;
  ErrorCode code{};
  std::uint64_t offender = 0;
  std::string message;
};

Caught caught(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_STRNE(error.what(), "");
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "one line";
    return {true, error.code(), error.offender(), error.what()};
  }
  return {};
}

bool names(const Caught& error, const std::string& what) {
  return error.message.find(what) != std::string::npos;
}

// Builds with and without an executor; both must throw the same and leak nothing.
Caught build_error(const TriangleView& triangles, const BuildOptions& options = {}) {
  const Caught plain = caught([&] { (void)build(triangles, options); });
  for (int threads = 1; threads <= 3; ++threads) {
    CountingResource memory;
    const Caught with_executor =
        caught([&] { (void)build({.threads = threads, .memory = &memory}, triangles, options); });
    EXPECT_EQ(with_executor.thrown, plain.thrown);
    EXPECT_EQ(with_executor.code, plain.code);
    EXPECT_EQ(with_executor.offender, plain.offender);
    EXPECT_EQ(with_executor.message, plain.message);
    EXPECT_EQ(memory.live_bytes(), 0u);
  }
  return plain;
}

#define EXPECT_ERROR(error, expected, first_offender)                               \
  do {                                                                              \
    const Caught& e = (error);                                                      \
    ASSERT_TRUE(e.thrown) << "nothing was thrown";                                  \
    EXPECT_EQ(e.code, expected) << e.message;                                       \
    EXPECT_EQ(e.offender, static_cast<std::uint64_t>(first_offender)) << e.message; \
    EXPECT_TRUE(names(e, std::to_string(first_offender))) << e.message;             \
  } while (false)

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
    const Tree tree = build(strip.view(), {.invalid_triangles = InvalidTriangles::skip});
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
    EXPECT_ERROR(caught([&] { (void)memory_requirement({}, count); }),
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
  for (const std::uint32_t leaf_size : {0u, 1025u, 0xFFFFFFFFu}) {
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
  EXPECT_TRUE(names(build_error(strip.view(), {.leaf_size = 0}), "leaf_size"));
  EXPECT_TRUE(names(build_error(strip.view(), {.code_bits = 65}), "code_bits"));
  for (const std::uint32_t good : {1u, 1024u}) {
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
  EXPECT_ERROR(caught([&] { (void)build(strip.view(), options); }), ErrorCode::invalid_option, 99);
}

TEST(ApiError, OptionsOfLaterVersions) {
  const Strip strip(10);
  std::vector<BuildOptions> later(6);
  later[0].references = References::budget;
  later[1].references = References::automatic;
  later[2].builder = Builder::sah;
  later[3].builder = Builder::wu2011;
  later[4].quality = Quality::balanced;
  later[5].quality = Quality::high;
  const char* words[] = {"budget", "auto", "sah", "wu2011", "balanced", "high"};
  for (std::size_t i = 0; i < later.size(); ++i) {
    const Caught error = build_error(strip.view(), later[i]);
    ASSERT_TRUE(error.thrown) << words[i];
    EXPECT_EQ(error.code, ErrorCode::unsupported_option) << error.message;
    EXPECT_TRUE(names(error, words[i])) << error.message;
    EXPECT_EQ(caught([&] { (void)memory_requirement({}, 10, later[i]); }).code,
              ErrorCode::unsupported_option);
  }
}

TEST(ApiError, OptionsAreCheckedForEmptyInputToo) {
  EXPECT_ERROR(build_error(TriangleView{}, {.leaf_size = 0}), ErrorCode::invalid_option, 0);
  EXPECT_ERROR(caught([] { (void)memory_requirement({}, 10, {.leaf_size = 0}); }),
               ErrorCode::invalid_option, 0);
}

TEST(ApiError, BackendThatIsNotThere) {
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

TEST(ApiError, OutOfMemory) {
  const Strip strip(100);
  const Caught error =
      caught([&] { (void)build({.memory = std::pmr::null_memory_resource()}, strip.view()); });
  ASSERT_TRUE(error.thrown);
  EXPECT_EQ(error.code, ErrorCode::out_of_memory) << error.message;
  EXPECT_GT(error.offender, 0u);
  EXPECT_TRUE(names(error, std::to_string(error.offender))) << error.message;
}

// An absurd number of threads is refused or made sensible; it never crashes or changes the tree.
TEST(ApiError, AbsurdThreadCounts) {
  const Strip strip(100);
  for (const int threads : {-1, std::numeric_limits<int>::min(), 1000}) {
    const Caught error = caught([&] { (void)build({.threads = threads}, strip.view()); });
    if (threads > 0) {
      EXPECT_FALSE(error.thrown) << error.message;
    } else if (error.thrown) {
      EXPECT_EQ(error.code, ErrorCode::invalid_option) << error.message;
    }
  }
}

// ---- Names and stages ---------------------------------------------------------------------------

TEST(ApiError, CodesHaveTheirNames) {
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

TEST(ApiError, OptionsHaveTheirNames) {
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

TEST(ApiError, StagesCheckTheirArguments) {
  const Box unit{{0, 0, 0}, {1, 1, 1}};
  for (const std::uint32_t code_bits : {0u, 65u}) {
    EXPECT_ERROR(caught([&] { (void)stages::make_lattice(unit, code_bits); }),
                 ErrorCode::invalid_option, code_bits);
  }
  const std::vector<stages::TrunkKey> keys(3);
  std::vector<std::uint32_t> first(3);
  for (const std::uint32_t leaf_size : {0u, 1025u}) {
    EXPECT_ERROR(caught([&] { (void)stages::find_trunks({}, keys, leaf_size, first); }),
                 ErrorCode::invalid_option, leaf_size);
  }
}

// More than 2^31 - 1 references would take tens of GB: what decides is asked directly.
TEST(ApiError, TooManyReferences) {
  core::BuildCounts counts;
  counts.references_needed = max_count;
  core::AdmitReferences{&counts, max_count}(0);
  EXPECT_FALSE(counts.status.failed);
  EXPECT_EQ(counts.references, max_count);

  const std::uint64_t needed = (std::uint64_t{1} << 32) + 5;  // 5 in 32 bits
  counts.references_needed = needed;
  counts.trunks = 7;
  core::AdmitReferences{&counts, max_count}(0);
  EXPECT_EQ(counts.trunks, 0u) << "a build that failed goes on with nothing";
  EXPECT_ERROR(caught([&] { core::raise(counts.status, {}); }), ErrorCode::too_many_references,
               needed);
}

// Where room was made beforehand, too little of it is an error that says how much there should be.
TEST(ApiError, ReferenceCapacity) {
  core::BuildCounts counts;
  counts.references_needed = 1001;
  core::AdmitReferences{&counts, 1000}(0);
  const auto error = caught([&] { core::raise(counts.status, {}); });
  EXPECT_ERROR(error, ErrorCode::reference_capacity, 1001);
  EXPECT_NE(error.message.find("1000"), std::string::npos) << error.message;
}

}  // namespace
}  // namespace zkd
