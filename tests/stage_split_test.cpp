// SPDX-License-Identifier: Apache-2.0
//
// Between stages 2 and 3: whether triangles are worth splitting, and what they are split into.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "scene/mesh.hpp"
#include "support/caught.hpp"
#include "support/meshes.hpp"
#include "support/platform.hpp"

namespace zkd {
namespace {

using test::room;

struct Input {
  explicit Input(const scene::Mesh& given) : mesh(given), boxes(mesh.faces.size()) {
    const stages::SceneSummary scene = stages::triangle_boxes(
        test::executor(), test::upload(mesh.view()), InvalidTriangles::error, boxes);
    valid = scene.valid;
    lattice = stages::make_lattice(scene.bounds, 32);
  }
  stages::Fragments split(float budget, test::Array<Box>& to,
                          test::Array<std::uint32_t>& owners) const {
    return stages::split_triangles(test::executor(), test::upload(mesh.view()), boxes, lattice,
                                   budget, to, owners);
  }

  scene::Mesh mesh;
  test::Array<Box> boxes;
  std::uint32_t valid = 0;
  Lattice lattice;
};

bool pays(const scene::Mesh& mesh, References policy) {
  return stages::pays_to_split(test::executor(), Input(mesh).boxes, policy);
}

TEST(StageSplit, PaysWhereLargeTrianglesLieAmongSmallOnes) {
  for (const scene::Mesh& mesh : {room(5000, 0), room(5000, 3), room(5000, 40)}) {
    EXPECT_FALSE(pays(mesh, References::once));
    EXPECT_TRUE(pays(mesh, References::budget));
  }
  // A large triangle costs a line a few visits: three are enough for `all`.
  EXPECT_FALSE(pays(room(5000, 0), References::all));
  EXPECT_TRUE(pays(room(5000, 3), References::all));
  EXPECT_FALSE(pays(room(5000, 3), References::automatic));
  EXPECT_TRUE(pays(room(5000, 40), References::all));
  EXPECT_TRUE(pays(room(5000, 40), References::automatic));
  EXPECT_FALSE(pays(room(0, 1000), References::all)) << "all in each other";
  EXPECT_TRUE(pays(room(0, 1000), References::automatic));
  EXPECT_FALSE(pays({}, References::all));
}

TEST(StageSplit, FragmentsHoldWhatTheyAreOf) {
  const Input in{room(1000, 10)};
  const std::vector<Box> boxes = in.boxes.download();
  for (const float budget : {1.0F, 1.3F, 4.0F}) {
    test::Array<Box> no_boxes(0);
    test::Array<std::uint32_t> no_owners(0);
    const stages::Fragments asked = in.split(budget, no_boxes, no_owners);
    ASSERT_GE(asked.places, in.valid);
    EXPECT_LE(asked.count, asked.places);
    EXPECT_LE(asked.places, static_cast<double>(budget) * in.valid);
    EXPECT_EQ(asked.places > in.valid, budget > 1.0F);
    test::Array<Box> made(asked.places);
    test::Array<std::uint32_t> owners(asked.places);
    const stages::Fragments again = in.split(budget, made, owners);
    EXPECT_EQ(again.places, asked.places);
    EXPECT_EQ(again.count, asked.count);

    const std::vector<Box> fragments = made.download();
    const std::vector<std::uint32_t> owner = owners.download();
    std::vector<std::vector<Box>> of(boxes.size());
    std::uint32_t count = 0;
    for (std::size_t k = 0; k < fragments.size(); ++k) {
      ASSERT_LT(owner[k], boxes.size());
      ASSERT_LE(k == 0 ? 0 : owner[k - 1], owner[k]);
      if (fragments[k].empty()) continue;
      ++count;
      of[owner[k]].push_back(fragments[k]);
      for (int a = 0; a < 3; ++a) {
        ASSERT_GE(fragments[k].lo[a], boxes[owner[k]].lo[a]);
        ASSERT_LE(fragments[k].hi[a], boxes[owner[k]].hi[a]);
      }
    }
    EXPECT_EQ(count, asked.count);
    // Points of each triangle, computed to a few ulp, lie in one of its fragments, or by that
    // beside.
    constexpr double margin = 1e-6;
    for (std::size_t t = 0; t < boxes.size(); ++t) {
      const glm::uvec3 face = in.mesh.faces[t];
      for (int i = 0; i <= 8; ++i)
        for (int j = 0; i + j <= 8; ++j) {
          bool held = false;
          for (const Box& box : of[t]) {
            bool inside = true;
            for (int a = 0; a < 3; ++a) {
              const double x = (i * static_cast<double>(in.mesh.positions[face[0]][a]) +
                                j * static_cast<double>(in.mesh.positions[face[1]][a]) +
                                (8 - i - j) * static_cast<double>(in.mesh.positions[face[2]][a])) /
                               8;
              inside = inside && x >= box.lo[a] - margin && x <= box.hi[a] + margin;
            }
            held = held || inside;
          }
          ASSERT_TRUE(held) << "triangle " << t << ", point " << i << ", " << j;
        }
    }
  }
}

TEST(StageSplit, WritesAsManyAsFit) {
  const Input in{room(1000, 10)};
  test::Array<Box> all(stages::split_triangles(test::executor(), test::upload(in.mesh.view()),
                                               in.boxes, in.lattice, 1.3F, {}, {})
                           .places);
  test::Array<std::uint32_t> three(3);
  (void)in.split(1.3F, all, three);
  EXPECT_EQ(three.download(), std::vector<std::uint32_t>({0, 1, 2}));
}

TEST(StageSplit, WhatIsWrongIsRefused) {
  const Input in{room(100, 1)};
  test::Array<Box> none(0);
  test::Array<std::uint32_t> owners(0);
  for (const float budget : {0.99F, std::numeric_limits<float>::infinity(), std::nanf("")}) {
    const test::Caught error = test::caught([&] { (void)in.split(budget, none, owners); });
    EXPECT_EQ(error.code, ErrorCode::invalid_option);
    EXPECT_TRUE(test::names(error, "budget")) << error.message;
  }
  const test::Caught boxes = test::caught([&] {
    (void)stages::split_triangles(test::executor(), test::upload(in.mesh.view()), none, in.lattice,
                                  1.3F, none, owners);
  });
  EXPECT_EQ(boxes.code, ErrorCode::invalid_view);
  EXPECT_TRUE(test::names(boxes, "boxes")) << boxes.message;
  const test::Caught policy = test::caught(
      [&] { (void)stages::pays_to_split(test::executor(), in.boxes, static_cast<References>(9)); });
  EXPECT_EQ(policy.code, ErrorCode::invalid_option);
  EXPECT_TRUE(test::names(policy, "references")) << policy.message;
}

// Nothing can be said of triangles outside the lattice, but it ends.
TEST(StageSplit, ALatticeOverOtherTrianglesEndsToo) {
  Input in{room(1000, 10)};
  in.lattice = stages::make_lattice(Box{{5, 5, 5}, {6, 6, 6}}, 32);
  test::Array<Box> none(0);
  test::Array<std::uint32_t> owners(0);
  EXPECT_GE(in.split(1.3F, none, owners).places, in.valid);
}

}  // namespace
}  // namespace zkd
