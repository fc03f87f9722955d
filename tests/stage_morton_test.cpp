// SPDX-License-Identifier: Apache-2.0
//
// Stage 3, Morton encoding, against a code put together bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
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

Box bounds_of(const std::vector<Box>& boxes) {
  Box all;
  for (const Box& box : boxes) {
    for (int a = 0; a < 3; ++a) {
      all.lo[a] = std::min(all.lo[a], box.lo[a]);
      all.hi[a] = std::max(all.hi[a], box.hi[a]);
    }
  }
  return all;
}

Box random_box(Random& random, float scale, float size, const glm::vec3& at) {
  Box box;
  const glm::vec3 p = random.in_cube();
  for (int a = 0; a < 3; ++a) {
    const float lo = scale * p[a] + at[a];
    const float hi = lo + scale * size * random.unit();
    box.lo[a] = std::min(lo, hi) + 0.0F;
    box.hi[a] = std::max(lo, hi) + 0.0F;
  }
  return box;
}

void expect_codes_as_defined(const std::vector<Box>& boxes, const Lattice& lattice) {
  std::vector<std::uint64_t> want_codes;
  std::vector<std::uint32_t> want_ids;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (boxes[i].empty()) continue;
    want_codes.push_back(test::plain_code(lattice, boxes[i]));
    want_ids.push_back(i);
  }
  const test::Array<Box> given = test::upload(boxes);
  for (const test::Executor& executor : test::all_executors(3)) {
    test::Array<std::uint64_t> codes(want_codes.size());
    test::Array<std::uint32_t> ids(want_ids.size());
    stages::morton_encode(executor, given, lattice, codes, ids);
    ASSERT_EQ(codes.download(), want_codes) << test::name(executor);
    ASSERT_EQ(ids.download(), want_ids) << test::name(executor);
    if (lattice.code_bits > 32) continue;
    test::Array<std::uint32_t> narrow_codes(want_codes.size());
    test::Array<std::uint32_t> narrow_ids(want_ids.size());
    stages::morton_encode(executor, given, lattice, narrow_codes, narrow_ids);
    const std::vector<std::uint32_t> narrow = narrow_codes.download();
    ASSERT_TRUE(std::equal(narrow.begin(), narrow.end(), want_codes.begin()))
        << test::name(executor);
    ASSERT_EQ(narrow_ids.download(), want_ids) << test::name(executor);
  }
}

void expect_codes_for_every_lattice(const std::vector<Box>& boxes) {
  for (const std::uint32_t width : {1u, 2u, 3u, 8u, 21u, 31u, 32u, 33u, 47u, 63u, 64u}) {
    for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
      SCOPED_TRACE(std::to_string(width) + " bits, " + to_string(order));
      expect_codes_as_defined(boxes, stages::make_lattice(bounds_of(boxes), width, order));
      if (testing::Test::HasFatalFailure()) return;
    }
  }
}

TEST(StageMorton, RandomBoxes) {
  Random random(21);
  for (const float scale : {1.0F, 1e-20F, 1e20F}) {
    std::vector<Box> boxes;
    for (int i = 0; i < 501; ++i) boxes.push_back(random_box(random, scale, 0.1F, glm::vec3(0)));
    expect_codes_for_every_lattice(boxes);
  }
}

TEST(StageMorton, UnevenScene) {
  Random random(22);
  std::vector<Box> boxes;
  for (int i = 0; i < 501; ++i) {
    Box box = random_box(random, 1.0F, 0.3F, glm::vec3(0));
    box.lo[1] *= 100.0F;
    box.hi[1] *= 100.0F;
    box.lo[2] *= 0.01F;
    box.hi[2] *= 0.01F;
    boxes.push_back(box);
  }
  expect_codes_for_every_lattice(boxes);
}

TEST(StageMorton, FlatAxes) {
  Random random(23);
  for (int flat = 1; flat < 8; ++flat) {
    std::vector<Box> boxes;
    for (int i = 0; i < 100; ++i) {
      Box box = random_box(random, 1.0F, 0.3F, glm::vec3(0));
      for (int a = 0; a < 3; ++a) {
        if ((flat & (1 << a)) != 0) box.lo[a] = box.hi[a] = 7.25F;
      }
      boxes.push_back(box);
    }
    expect_codes_for_every_lattice(boxes);
  }
}

TEST(StageMorton, FewUlpsWideFarFromTheOrigin) {
  Random random(24);
  for (const float at : {1e6F, -148376.0F, 1.6e7F}) {
    std::vector<Box> boxes;
    for (int i = 0; i < 100; ++i) {
      Box box;
      for (int a = 0; a < 3; ++a) {
        box.lo[a] = ulps(at, random.integer(0, 3));
        box.hi[a] = ulps(box.lo[a], random.integer(0, 2));
      }
      boxes.push_back(box);
    }
    expect_codes_for_every_lattice(boxes);
  }
}

// Centres exactly on planes, and half an ulp of a float beside them: only double can tell.
TEST(StageMorton, CentresOnPlanes) {
  Random random(25);
  std::vector<Box> boxes = {{{0, 0, 0}, {1, 1, 1}}, {{63, 63, 63}, {64, 64, 64}}};
  for (int i = 0; i < 500; ++i) {
    Box box;
    for (int a = 0; a < 3; ++a) {
      const auto plane = static_cast<float>(random.integer(1, 62));
      box.lo[a] = ulps(plane, -random.integer(0, 2));
      box.hi[a] = ulps(plane, random.integer(0, 2));
      if (random.one_in(4)) {
        box.lo[a] = plane - 0.75F;
        box.hi[a] = plane + 0.75F;
      }
    }
    boxes.push_back(box);
  }
  expect_codes_for_every_lattice(boxes);
}

TEST(StageMorton, EmptyBoxesAreLeftOut) {
  Random random(26);
  std::vector<Box> boxes;
  for (int i = 0; i < 1000; ++i) {
    boxes.push_back(random.one_in(3) ? Box{} : random_box(random, 1.0F, 0.1F, glm::vec3(0)));
  }
  expect_codes_for_every_lattice(boxes);
  expect_codes_as_defined({}, stages::make_lattice(Box{}, 32));
  expect_codes_as_defined(std::vector<Box>(17), stages::make_lattice(Box{}, 32));
}

TEST(StageMorton, ExtremeCoordinates) {
  Random random(27);
  constexpr float max_float = std::numeric_limits<float>::max();
  std::vector<Box> boxes = {
      {{-max_float, -max_float, -max_float}, {max_float, max_float, max_float}},
      {{max_float, max_float, max_float}, {max_float, max_float, max_float}},
      {{-max_float, 0, 0}, {-max_float, 0, 0}}};
  for (int i = 0; i < 500; ++i) {
    Box box;
    for (int a = 0; a < 3; ++a) {
      const float p = random.any_finite();
      const float q = random.any_finite();
      box.lo[a] = std::min(p, q) + 0.0F;
      box.hi[a] = std::max(p, q) + 0.0F;
    }
    boxes.push_back(box);
  }
  expect_codes_for_every_lattice(boxes);

  constexpr float tiny = std::numeric_limits<float>::denorm_min();
  boxes.clear();
  for (int i = 0; i < 200; ++i) {
    Box box;
    for (int a = 0; a < 3; ++a) {
      box.lo[a] = tiny * static_cast<float>(random.integer(-3, 3)) + 0.0F;
      box.hi[a] = box.lo[a] + tiny * static_cast<float>(random.integer(0, 3)) + 0.0F;
    }
    boxes.push_back(box);
  }
  expect_codes_for_every_lattice(boxes);
}

TEST(StageMorton, ManyBoxesOnEveryThread) {
  Random random(28);
  std::vector<Box> boxes;
  for (int i = 0; i < 100003; ++i) {
    boxes.push_back(random.one_in(50) ? Box{} : random_box(random, 1.0F, 0.01F, glm::vec3(0)));
  }
  expect_codes_as_defined(boxes, stages::make_lattice(bounds_of(boxes), 32));
}

TEST(StageMorton, WrongLengthsAndWidthsAreRefused) {
  const std::vector<Box> boxes = {{{0, 0, 0}, {1, 1, 1}}, Box{}, {{2, 2, 2}, {3, 3, 3}}};
  const Lattice lattice = stages::make_lattice(bounds_of(boxes), 32);
  const auto code_of_error = [&](std::size_t codes_length, std::size_t ids_length) {
    test::Array<std::uint64_t> codes(codes_length);
    test::Array<std::uint32_t> ids(ids_length);
    try {
      stages::morton_encode(test::executor(), test::upload(boxes), lattice, codes, ids);
    } catch (const Error& error) {
      return error.code() == ErrorCode::invalid_view;
    }
    return false;
  };
  EXPECT_TRUE(code_of_error(1, 1));
  EXPECT_TRUE(code_of_error(3, 3));
  EXPECT_TRUE(code_of_error(2, 1));
  EXPECT_FALSE(code_of_error(2, 2));

  const Lattice wide = stages::make_lattice(bounds_of(boxes), 48);
  test::Array<std::uint32_t> codes(2);
  test::Array<std::uint32_t> ids(2);
  EXPECT_THROW(stages::morton_encode(test::executor(), test::upload(boxes), wide, codes, ids),
               Error);
}

}  // namespace
}  // namespace zkd
