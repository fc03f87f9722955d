// SPDX-License-Identifier: Apache-2.0
//
// Stage 9, split planes, against integers.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "support/keys.hpp"
#include "support/plain_stages.hpp"
#include "support/platform.hpp"

namespace zkd {
namespace {

using test::Random;

struct Trunks {
  Lattice lattice;
  std::vector<Lattice> lattices;
  test::Keys keys;
  std::vector<std::uint32_t> crowd;
  std::vector<std::uint8_t> levels;
};

// Random trunks on `scene`; about every other code is crowded and has a lattice of its own.
Trunks random_trunks(std::uint64_t seed, const Box& scene, std::uint32_t code_bits,
                     AxisOrder order) {
  Random random(seed);
  Trunks out;
  out.lattice = stages::make_lattice(scene, code_bits, order);
  test::Keys keys =
      test::without_duplicates(test::random_keys(seed, 300, out.lattice.code_bits, 0, 200));
  for (const stages::TrunkKey& key : keys) {
    if (random.one_in(2)) {
      out.keys.push_back(key);
      out.crowd.push_back(stages::no_crowd);
      continue;
    }
    Box own;
    for (int a = 0; a < 3; ++a) {
      const float p = scene.lo[a] + (scene.hi[a] / 2 - scene.lo[a] / 2) * random.unit();
      own.lo[a] = p;
      own.hi[a] = random.one_in(5) ? p : p + (scene.hi[a] / 2 - scene.lo[a] / 2) * 0.001F;
    }
    const Lattice lattice = stages::make_lattice(own, 32, order);
    const auto number = static_cast<std::uint32_t>(out.lattices.size());
    out.lattices.push_back(lattice);
    test::Keys fine;
    for (int i = 0; i < 8; ++i) {
      fine.push_back({key.code, test::top_bits(random.bits64(), lattice.code_bits)});
    }
    std::sort(fine.begin(), fine.end());
    for (const stages::TrunkKey& f : test::without_duplicates(fine)) {
      out.keys.push_back(f);
      out.crowd.push_back(number);
    }
  }
  for (std::size_t j = 0; j + 1 < out.keys.size(); ++j) {
    out.levels.push_back(
        static_cast<std::uint8_t>(test::first_difference(out.keys[j], out.keys[j + 1])));
  }
  return out;
}

struct Planes {
  std::vector<std::uint32_t> axes;
  std::vector<float> planes;
};

Planes split(const Trunks& in, const test::Executor& executor = test::executor()) {
  test::Array<std::uint32_t> axes(in.levels.size(), 7);
  test::Array<float> planes(in.levels.size(), -1.0F);
  stages::split_planes(executor, test::upload(in.keys), test::upload(in.levels),
                       test::upload(in.crowd), in.lattice, test::upload(in.lattices), axes, planes);
  return {axes.download(), planes.download()};
}

void expect_planes_as_defined(const Trunks& in) {
  for (const test::Executor& executor : test::executors(3)) {
    const auto [axes, planes] = split(in, executor);
    for (std::size_t j = 0; j < in.levels.size(); ++j) {
      const std::uint32_t crowd = in.crowd[j + 1];
      const test::PlainPlane want =
          test::plain_plane(in.keys[j + 1], in.levels[j], in.lattice,
                            crowd == stages::no_crowd ? nullptr : &in.lattices[crowd]);
      ASSERT_EQ(axes[j], want.axis) << "node " << j << ", level " << int{in.levels[j]};
      ASSERT_EQ(static_cast<double>(planes[j]), want.position)
          << "node " << j << ", level " << int{in.levels[j]};
      ASSERT_FALSE(planes[j] == 0.0F && std::signbit(planes[j])) << "node " << j;
    }
  }
}

TEST(StagePlanes, AreExactOnLatticesOfEverySize) {
  constexpr float max_float = std::numeric_limits<float>::max();
  constexpr float tiny = std::numeric_limits<float>::denorm_min();
  const std::vector<Box> scenes = {
      {{0, 0, 0}, {1, 1, 1}},
      {{-1, -1, -1}, {1, 1, 1}},
      {{-3, 10, 0.1F}, {97, 11, 0.2F}},
      {{1e6F, -1e6F, 0}, {1000001, -999999, 1}},
      {{5, 0, 0}, {5, 1, 1}},
      {{-max_float, -max_float, -max_float}, {max_float, max_float, max_float}},
      {{0, -1000 * tiny, 0}, {1000 * tiny, 0, 1e-38F}},
      {{0, 0, 0}, {1e6F, 1, 1e-3F}},
  };
  std::uint64_t seed = 80;
  for (const Box& scene : scenes) {
    for (const std::uint32_t code_bits : {3u, 16u, 32u, 64u}) {
      for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
        SCOPED_TRACE("scene " + std::to_string(&scene - scenes.data()) + ", " +
                     std::to_string(code_bits) + " bits");
        expect_planes_as_defined(random_trunks(++seed, scene, code_bits, order));
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  }
}

// A plane separates the cells of the trunks beside it.
TEST(StagePlanes, SeparateTheCellsOfTheirNeighbours) {
  const Trunks in = random_trunks(99, {{-1, -1, -1}, {1, 1, 1}}, 32, AxisOrder::by_extent);
  const Planes found = split(in);
  const std::vector<std::uint32_t>& axes = found.axes;
  const std::vector<float>& planes = found.planes;
  for (std::size_t j = 0; j < in.levels.size(); ++j) {
    if (in.levels[j] >= stages::first_fine_level) continue;
    // The lowest corner of a trunk's cell along the axis: all its bits, not only the prefix.
    const auto corner = [&](const stages::TrunkKey& key) {
      std::int64_t cell = 0;
      for (std::uint32_t level = 0; level < in.lattice.code_bits; ++level) {
        if (in.lattice.axis[level] == axes[j])
          cell = cell * 2 + (test::key_bit(key, level) ? 1 : 0);
      }
      return test::lattice_plane(in.lattice, static_cast<int>(axes[j]), cell);
    };
    ASSERT_LT(corner(in.keys[j]), static_cast<double>(planes[j]));
    ASSERT_GE(corner(in.keys[j + 1]), static_cast<double>(planes[j]));
  }
}

TEST(StagePlanes, LengthsThatDisagreeAreRefused) {
  Trunks in = random_trunks(98, {{-1, -1, -1}, {1, 1, 1}}, 32, AxisOrder::by_extent);
  in.crowd.pop_back();
  EXPECT_THROW((void)split(in), Error);
}

}  // namespace
}  // namespace zkd
