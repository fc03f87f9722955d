// SPDX-License-Identifier: Apache-2.0
//
// The same tree: one hash over backends, threads, instruction sets, repetition, permuted input, and
// triangles that do not count.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/meshes.hpp"
#include "support/platform_tree.hpp"
#include "support/tree_kinds.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using verify::tree_hash;
using verify::tree_hash_mapped;

std::vector<test::NamedMesh> meshes() {
  std::vector<test::NamedMesh> all;
  for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
    all.push_back(test::small_mesh(kind, 20));
  }
  all.push_back({"large soup", scene::soup(30000, 21)});
  all.push_back({"large sphere", scene::sphere(5)});
  all.push_back({"teapot in a stadium", scene::small_in_large(10000, 1e6F, 22)});
  all.push_back({"large random bits", scene::random_bits(10000, 23)});
  return all;
}

// Room-sized triangles in `all` are quadratic by nature: kept to the small meshes.
bool too_large_for(const BuildOptions& kind, const test::NamedMesh& m) {
  return kind.references == References::all && m.name == "large random bits";
}

// Whatever the backend, the number of threads and the instruction set.
TEST(TreeSame, InEveryWayOfBuilding) {
  for (const test::NamedMesh& m : meshes()) {
    for (const BuildOptions& options : test::tree_kinds()) {
      if (too_large_for(options, m)) continue;
      const std::string want =
          tree_hash(build(cpu::Executor{.threads = 1}, m.mesh.view(), options).view());
      for (const test::WayToBuild& way : test::ways_to_build()) {
        ASSERT_EQ(tree_hash(way.build(m.mesh.view(), options).view()), want)
            << m.name << ", " << test::name_of(options) << ", " << way.name;
      }
    }
  }
}

TEST(TreeSame, HashTellsTreesApart) {
  const Tree a = test::build(scene::soup(1000, 25).view());
  const Tree b = test::build(scene::soup(1000, 26).view());
  EXPECT_NE(tree_hash(a.view()), tree_hash(b.view()));
  EXPECT_NE(
      tree_hash(a.view()),
      tree_hash(test::build(scene::soup(1000, 25).view(), {.references = References::all}).view()));
}

// ---- Permuted input -----------------------------------------------------------------------------

TEST(TreeSame, ForPermutedTriangles) {
  for (const test::NamedMesh& m : meshes()) {
    for (const BuildOptions& options : test::tree_kinds()) {
      if (too_large_for(options, m)) continue;
      const std::string want = tree_hash_mapped(test::build(m.mesh.view(), options).view(), {});
      for (std::uint64_t seed = 0; seed < 3; ++seed) {
        std::vector<std::uint32_t> permutation;
        const scene::Mesh shuffled = scene::shuffled(m.mesh, seed, &permutation);
        const Tree tree = test::build(shuffled.view(), options);
        ASSERT_EQ(tree_hash_mapped(tree.view(), permutation), want)
            << m.name << ", " << test::name_of(options) << ", shuffle " << seed;
      }
      scene::Mesh reversed = m.mesh;
      std::reverse(reversed.faces.begin(), reversed.faces.end());
      std::vector<std::uint32_t> back(m.mesh.faces.size());
      for (std::uint32_t i = 0; i < back.size(); ++i) {
        back[i] = static_cast<std::uint32_t>(back.size()) - 1 - i;
      }
      ASSERT_EQ(tree_hash_mapped(test::build(reversed.view(), options).view(), back), want)
          << m.name << ", " << test::name_of(options) << ", reversed";
    }
  }
}

TEST(TreeSame, ForRotatedCorners) {
  for (const BuildOptions& options : test::tree_kinds()) {
    scene::Mesh mesh = scene::soup(3000, 27);
    const std::string want = tree_hash(test::build(mesh.view(), options).view());
    for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
      glm::uvec3& f = mesh.faces[i];
      if (i % 3 == 0) f = {f.y, f.z, f.x};
      if (i % 3 == 1) f = {f.x, f.z, f.y};
    }
    EXPECT_EQ(tree_hash(test::build(mesh.view(), options).view()), want);
  }
}

TEST(TreeSame, ForNegativeZeros) {
  for (const BuildOptions& options : test::tree_kinds()) {
    scene::Mesh mesh = test::integer_mesh(500, 1, 28);
    for (glm::vec3& p : mesh.positions) p += 0.0F;
    const std::string want = tree_hash(test::build(mesh.view(), options).view());
    for (glm::vec3& p : mesh.positions) {
      for (int a = 0; a < 3; ++a) {
        if (p[a] == 0.0F) p[a] = -0.0F;
      }
    }
    EXPECT_EQ(tree_hash(test::build(mesh.view(), options).view()), want);
  }
}

// ---- Triangles that do not count ----------------------------------------------------------------

TEST(TreeSame, WithInvalidTrianglesAdded) {
  constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const test::NamedMesh& m : meshes()) {
    for (const BuildOptions& options : test::tree_kinds()) {
      if (too_large_for(options, m)) continue;
      const std::string want = tree_hash_mapped(test::build(m.mesh.view(), options).view(), {});

      // At the end, at the front and between: zero area far away, NaN, infinity.
      scene::Mesh mesh = m.mesh;
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.insert(
          mesh.positions.end(),
          {{1e30F, 1e30F, 1e30F}, {-1e30F, 1e20F, 3}, {nan_value, 0, 0}, {0, -infinity, 0}});
      const std::vector<glm::uvec3> invalid = {{first, first, first + 1},
                                               {first, first + 1, first + 2},
                                               {first + 1, first + 3, first},
                                               {first, first, first}};
      std::vector<glm::uvec3> faces;
      std::vector<std::uint32_t> old_ids;
      for (std::uint32_t i = 0; i <= m.mesh.faces.size(); ++i) {
        if (i % 50 == 0 || i == m.mesh.faces.size()) {
          faces.push_back(invalid[i / 50 % 4]);
          old_ids.push_back(no_triangle);
        }
        if (i == m.mesh.faces.size()) break;
        faces.push_back(m.mesh.faces[i]);
        old_ids.push_back(i);
      }
      mesh.faces = faces;
      const Tree tree = test::build(mesh.view(), options);
      ASSERT_EQ(tree_hash_mapped(tree.view(), old_ids), want)
          << m.name << ", " << test::name_of(options);
      EXPECT_GE(tree.statistics().skipped_zero_area + tree.statistics().skipped_non_finite,
                faces.size() - m.mesh.faces.size());
    }
  }
}

TEST(TreeSame, WhateverTheFormOfTheView) {
  const scene::Mesh mesh = scene::sphere(3);
  for (const BuildOptions& options : test::tree_kinds()) {
    const std::string want = tree_hash(test::build(mesh.view(), options).view());
    std::vector<glm::vec3> soup;
    for (const glm::uvec3& f : mesh.faces) {
      for (int c = 0; c < 3; ++c) soup.push_back(mesh.positions[f[c]]);
    }
    EXPECT_EQ(tree_hash(test::build(TriangleView{std::span(std::as_const(soup))}, options).view()),
              want);
    std::vector<float> wide(mesh.positions.size() * 8, 7.0F);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      for (int a = 0; a < 3; ++a) wide[8 * i + static_cast<std::size_t>(a)] = mesh.positions[i][a];
    }
    const TriangleView strided =
        TriangleView::strided(wide.data(), mesh.positions.size(), 32, mesh.faces);
    EXPECT_EQ(tree_hash(test::build(strided, options).view()), want);
  }
}

}  // namespace
}  // namespace zkd
