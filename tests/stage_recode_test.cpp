// SPDX-License-Identifier: Apache-2.0
//
// Stage 5, crowded trunks: triangles that share a code are coded again on a lattice over their own
// centres. Checked against the lattices that the stage returns, bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
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

struct Sorted {
  std::vector<Box> boxes;
  Lattice lattice;
  std::vector<std::uint64_t> codes;
  std::vector<std::uint32_t> ids;
};

// Stages 2 to 4 on the definition's side: nothing of the library but the lattice.
Sorted sorted(std::vector<Box> boxes, std::uint32_t code_bits,
              AxisOrder order = AxisOrder::by_extent) {
  Sorted out;
  Box bounds;
  for (const Box& box : boxes) {
    for (int a = 0; a < 3; ++a) {
      bounds.lo[a] = std::min(bounds.lo[a], box.lo[a]);
      bounds.hi[a] = std::max(bounds.hi[a], box.hi[a]);
    }
  }
  out.lattice = stages::make_lattice(bounds, code_bits, order);
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (!boxes[i].empty()) out.ids.push_back(i);
  }
  std::stable_sort(out.ids.begin(), out.ids.end(), [&](std::uint32_t a, std::uint32_t b) {
    return test::plain_code(out.lattice, boxes[a]) < test::plain_code(out.lattice, boxes[b]);
  });
  for (const std::uint32_t id : out.ids) {
    out.codes.push_back(test::plain_code(out.lattice, boxes[id]));
  }
  out.boxes = std::move(boxes);
  return out;
}

struct Recoded {
  std::uint32_t crowded = 0;
  std::vector<std::uint32_t> ids;
  std::vector<stages::TrunkKey> keys;
  std::vector<std::uint32_t> crowd;
  std::vector<Lattice> lattices;
};

Recoded recode(const Sorted& in, std::uint32_t leaf_size, bool enabled = true,
               const test::Executor& executor = test::executor(2),
               AxisOrder order = AxisOrder::by_extent,
               std::size_t room = std::numeric_limits<std::size_t>::max()) {
  test::Array<std::uint32_t> ids = test::upload(in.ids);
  test::Array<stages::TrunkKey> keys(in.ids.size());
  test::Array<std::uint32_t> crowd(in.ids.size(), 12345);
  test::Array<Lattice> lattices(std::min(room, in.ids.size()));
  const std::uint32_t crowded =
      stages::recode_crowded(executor, test::upload(in.boxes), in.lattice, test::upload(in.codes),
                             ids, leaf_size, order, enabled, keys, crowd, lattices);
  return {crowded, ids.download(), keys.download(), crowd.download(), lattices.download()};
}

std::uint64_t left_aligned(std::uint64_t code, std::uint32_t bits) {
  return bits == 0 ? 0 : code << (64 - bits);
}

// The lattice of one crowd: over the centres [begin, end) of ids, and not much larger.
void expect_lattice_over_centres(const Sorted& in, const std::vector<std::uint32_t>& ids,
                                 std::size_t begin, std::size_t end, const Lattice& lattice) {
  ASSERT_LE(lattice.code_bits, 32u);
  for (int a = 0; a < 3; ++a) {
    double lo = std::numeric_limits<double>::infinity();
    double hi = -lo;
    for (std::size_t i = begin; i < end; ++i) {
      const double c = test::centre(in.boxes[ids[i]], a);
      lo = std::min(lo, c);
      hi = std::max(hi, c);
      if (lattice.bits[a] == 0) continue;
      const std::int64_t cell = test::lattice_cell(lattice, a, c);
      ASSERT_GE(cell, 0) << "axis " << a;
      ASSERT_LT(cell, std::int64_t{1} << lattice.bits[a]) << "axis " << a;
    }
    if (lo == hi) {
      EXPECT_EQ(lattice.bits[a], 0u) << "axis " << a << " is flat";
    } else if (lattice.bits[a] > 2) {
      const double side = std::ldexp(1.0, lattice.exponent[a] + static_cast<int>(lattice.bits[a]));
      EXPECT_LE(side, 5.0 * (hi - lo)) << "axis " << a << ": not their own box";
    }
  }
}

void expect_as_defined(const Sorted& in, std::uint32_t leaf_size, const Recoded& got) {
  std::uint32_t crowded = 0;
  for (std::size_t begin = 0; begin < in.ids.size();) {
    std::size_t end = begin;
    while (end < in.ids.size() && in.codes[end] == in.codes[begin]) ++end;
    const std::uint64_t code = left_aligned(in.codes[begin], in.lattice.code_bits);
    if (end - begin <= leaf_size) {
      for (std::size_t i = begin; i < end; ++i) {
        ASSERT_EQ(got.ids[i], in.ids[i]) << "position " << i << " is not crowded";
        ASSERT_EQ(got.crowd[i], stages::no_crowd);
        ASSERT_TRUE((got.keys[i] == stages::TrunkKey{code, 0}));
      }
    } else {
      ASSERT_LT(crowded, got.lattices.size());
      const Lattice& lattice = got.lattices[crowded];
      expect_lattice_over_centres(in, in.ids, begin, end, lattice);
      const auto fine = [&](std::uint32_t id) {
        return left_aligned(test::plain_code(lattice, in.boxes[id]), lattice.code_bits);
      };
      std::vector<std::uint32_t> want(in.ids.begin() + static_cast<std::ptrdiff_t>(begin),
                                      in.ids.begin() + static_cast<std::ptrdiff_t>(end));
      std::stable_sort(want.begin(), want.end(),
                       [&](std::uint32_t a, std::uint32_t b) { return fine(a) < fine(b); });
      for (std::size_t i = begin; i < end; ++i) {
        ASSERT_EQ(got.ids[i], want[i - begin]) << "position " << i << " of crowd " << crowded;
        ASSERT_EQ(got.crowd[i], crowded);
        ASSERT_TRUE((got.keys[i] == stages::TrunkKey{code, fine(got.ids[i])}))
            << "position " << i << " of crowd " << crowded;
      }
      ++crowded;
    }
    begin = end;
  }
  EXPECT_EQ(got.crowded, crowded);
}

Box small_box(Random& random, const glm::vec3& at, float spread, float size) {
  Box box;
  for (int a = 0; a < 3; ++a) {
    const float p = at[a] + spread * random.signed_unit();
    const float q = p + size * random.signed_unit();
    box.lo[a] = std::min(p, q) + 0.0F;
    box.hi[a] = std::max(p, q) + 0.0F;
  }
  return box;
}

// Clusters in a large scene, some boxes left out.
std::vector<Box> clusters(std::uint64_t seed, float ratio) {
  Random random(seed);
  std::vector<Box> boxes;
  for (int i = 0; i < 300; ++i) boxes.push_back(small_box(random, glm::vec3(0), 1.0F, 0.1F));
  for (int k = 0; k < 5; ++k) {
    const glm::vec3 at = random.in_cube();
    for (int i = 0; i < 200; ++i) boxes.push_back(small_box(random, at, 1 / ratio, 0.1F / ratio));
  }
  for (int i = 0; i < 20; ++i) boxes[random.below(1300)] = Box{};
  return boxes;
}

TEST(StageRecode, ClustersInALargeScene) {
  for (const float ratio : {1e2F, 1e4F, 1e6F}) {
    for (const std::uint32_t code_bits : {3u, 12u, 32u, 64u}) {
      for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
        const Sorted in = sorted(clusters(51, ratio), code_bits, order);
        for (const std::uint32_t leaf_size : {1u, 4u, 16u}) {
          for (const test::Executor& executor : test::executors(3)) {
            SCOPED_TRACE("ratio " + std::to_string(ratio) + ", " + std::to_string(code_bits) +
                         " bits, leaf size " + std::to_string(leaf_size));
            expect_as_defined(in, leaf_size, recode(in, leaf_size, true, executor, order));
            if (testing::Test::HasFatalFailure()) return;
          }
        }
      }
    }
  }
}

TEST(StageRecode, SmallModelInALargeSceneComesApart) {
  Random random(52);
  std::vector<Box> boxes = {{{-1e7F, -1e7F, -1e7F}, {1e7F, 1e7F, 1e7F}}};
  for (int i = 0; i < 5000; ++i) boxes.push_back(small_box(random, glm::vec3(3), 1.0F, 0.01F));
  const Sorted in = sorted(boxes, 32);
  const Recoded got = recode(in, 4);
  expect_as_defined(in, 4, got);
  EXPECT_GE(got.crowded, 1u);
  std::size_t different = 1;
  for (std::size_t i = 1; i < got.keys.size(); ++i) {
    if (!(got.keys[i] == got.keys[i - 1])) ++different;
  }
  EXPECT_GT(different, 4000u);
}

TEST(StageRecode, EqualCentresStayTogether) {
  std::vector<Box> boxes;
  for (int i = 1; i <= 500; ++i) {
    const auto r = static_cast<float>(i);
    boxes.push_back({{-r, -r, -r}, {r, r, r}});
  }
  const Sorted in = sorted(boxes, 32);
  const Recoded got = recode(in, 4);
  expect_as_defined(in, 4, got);
  EXPECT_EQ(got.crowded, 1u);
  EXPECT_EQ(got.lattices[0].code_bits, 0u);
}

TEST(StageRecode, FlatAndFewUlpsWideCrowds) {
  Random random(53);
  std::vector<Box> boxes;
  for (int i = 0; i < 600; ++i) {
    Box box = small_box(random, glm::vec3(0.5F), 1e-5F, 1e-6F);
    box.lo[i % 2] = box.hi[i % 2] = 0.25F;
    if (i % 3 == 0) {
      for (int a = 0; a < 3; ++a) {
        box.lo[a] = test::ulps(0.75F, random.integer(0, 2));
        box.hi[a] = test::ulps(box.lo[a], random.integer(0, 1));
      }
    }
    boxes.push_back(box);
  }
  boxes.push_back({{-1, -1, -1}, {1, 1, 1}});
  for (const std::uint32_t code_bits : {6u, 32u}) {
    const Sorted in = sorted(boxes, code_bits);
    expect_as_defined(in, 4, recode(in, 4));
  }
}

TEST(StageRecode, LatticeWithoutBitsIsOneCrowd) {
  std::vector<Box> boxes(50, Box{{1, 2, 3}, {1, 2, 3}});
  Sorted in = sorted(boxes, 32);
  ASSERT_EQ(in.lattice.code_bits, 0u);
  expect_as_defined(in, 4, recode(in, 4));
  expect_as_defined(in, 50, recode(in, 50));
}

TEST(StageRecode, DisabledMakesKeysAndNothingElse) {
  const Sorted in = sorted(clusters(54, 1e4F), 12);
  const Recoded got = recode(in, 4, false);
  EXPECT_EQ(got.crowded, 0u);
  EXPECT_EQ(got.ids, in.ids);
  for (std::size_t i = 0; i < in.ids.size(); ++i) {
    ASSERT_EQ(got.crowd[i], stages::no_crowd);
    ASSERT_TRUE(
        (got.keys[i] == stages::TrunkKey{left_aligned(in.codes[i], in.lattice.code_bits), 0}));
  }
}

TEST(StageRecode, NothingCrowdedNothingDone) {
  const Sorted in = sorted(clusters(55, 1e2F), 64);
  const Recoded got = recode(in, 1024);
  EXPECT_EQ(got.crowded, 0u);
  expect_as_defined(in, 1024, got);
  const Recoded none = recode(sorted({}, 32), 4);
  EXPECT_EQ(none.crowded, 0u);
}

TEST(StageRecode, WritesAsManyLatticesAsFit) {
  const Sorted in = sorted(clusters(56, 1e4F), 12);
  const Recoded all = recode(in, 4);
  ASSERT_GE(all.crowded, 5u);
  for (const std::size_t room : {0u, 1u, 3u}) {
    const Recoded some = recode(in, 4, true, test::executor(2), AxisOrder::by_extent, room);
    EXPECT_EQ(some.crowded, all.crowded);
    EXPECT_EQ(some.ids, all.ids);
    for (std::size_t i = 0; i < room; ++i) {
      EXPECT_EQ(some.lattices[i].code_bits, all.lattices[i].code_bits);
      for (int a = 0; a < 3; ++a) {
        EXPECT_EQ(some.lattices[i].exponent[a], all.lattices[i].exponent[a]);
        EXPECT_EQ(some.lattices[i].origin[a], all.lattices[i].origin[a]);
        EXPECT_EQ(some.lattices[i].bits[a], all.lattices[i].bits[a]);
      }
    }
  }
}

TEST(StageRecode, LengthsThatDisagreeAreRefused) {
  Sorted in = sorted(clusters(57, 1e4F), 12);
  in.codes.pop_back();
  try {
    (void)recode(in, 4);
    ADD_FAILURE() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::invalid_view);
  }
}

}  // namespace
}  // namespace zkd
