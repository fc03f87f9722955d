// SPDX-License-Identifier: Apache-2.0
//
// The CUDA backend's logic on a simulated device: the CPU's bytes for every scene, option and form
// of the input, and what is known of a tree after it was copied.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/meshes.hpp"
#include "support/simulated_machine.hpp"
#include "support/tree_kinds.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using simulated::Machine;
using simulated::Triangles;
using verify::tree_hash;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

Tree on_cpu(const TriangleView& triangles, const BuildOptions& options) {
  return build(cpu::Executor{.threads = 2}, triangles, options);
}

BuildOptions skipping(References references) {
  return {.references = references, .invalid_triangles = InvalidTriangles::skip};
}

void expect_same_statistics(const Statistics& device, const Statistics& host) {
  EXPECT_EQ(device.triangles, host.triangles);
  EXPECT_EQ(device.skipped_zero_area, host.skipped_zero_area);
  EXPECT_EQ(device.skipped_non_finite, host.skipped_non_finite);
  EXPECT_EQ(device.code_bits, host.code_bits);
  EXPECT_EQ(device.crowded_trunks, host.crowded_trunks);
  EXPECT_EQ(device.crowded_triangles, host.crowded_triangles);
  EXPECT_EQ(device.crowded_leaves, host.crowded_leaves);
  EXPECT_EQ(device.crowded_references, host.crowded_references);
  EXPECT_EQ(device.nodes, host.nodes);
  EXPECT_EQ(device.leaves, host.leaves);
  EXPECT_EQ(device.references, host.references);
  EXPECT_EQ(device.largest_leaf, host.largest_leaf);
  EXPECT_EQ(device.depth, host.depth);
  EXPECT_EQ(device.sah_cost, host.sah_cost);
  for (const Skip skip : {Skip::flat_axes, Skip::recoding, Skip::compaction, Skip::subtrees}) {
    EXPECT_EQ(device.skip(skip).taken, host.skip(skip).taken) << to_string(skip);
    EXPECT_EQ(device.skip(skip).amount, host.skip(skip).amount) << to_string(skip);
  }
}

void expect_same_lattice(const Lattice& device, const Lattice& host) {
  EXPECT_EQ(device.code_bits, host.code_bits);
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(device.exponent[a], host.exponent[a]);
    EXPECT_EQ(device.origin[a], host.origin[a]);
    EXPECT_EQ(device.bits[a], host.bits[a]);
    EXPECT_EQ(device.mask[a], host.mask[a]);
  }
  EXPECT_EQ(std::memcmp(device.axis, host.axis, sizeof host.axis), 0);
}

// Builds on the machine and on the CPU; `all` with exactly the room that analyse() finds, or more.
void expect_same(Machine& machine, const TriangleView& on_device, const TriangleView& on_host,
                 BuildOptions options) {
  const Tree want = on_cpu(on_host, options);
  if (options.references == References::all) {
    const BuildOptions found = analyse(machine.executor(), on_device, options);
    ASSERT_EQ(found.reference_capacity, std::max<std::uint64_t>(want.view().reference_count(), 1));
    EXPECT_EQ(found.code_bits, want.options().code_bits);
    const std::uint64_t more[] = {found.reference_capacity, found.reference_capacity + 1,
                                  found.reference_capacity * 2};
    options.reference_capacity = more[machine.stream.random().below(3)];
  }
  const simulated::Tree tree = build(machine.executor(), on_device, options);
  tree.check();
  const Tree got = tree.to_host();
  ASSERT_EQ(tree_hash(got.view()), tree_hash(want.view()));
  expect_same_statistics(got.statistics(), want.statistics());
  EXPECT_EQ(got.statistics().skip(Skip::wide_codes).taken,
            want.statistics().skip(Skip::wide_codes).taken);
  expect_same_lattice(tree.lattice(), want.lattice());
}

// ---- Scenes and options -------------------------------------------------------------------------

class CudaSame : public testing::TestWithParam<test::MeshKind> {};

// Each combination on every fifth kind of mesh.
TEST_P(CudaSame, ForEveryOption) {
  const test::NamedMesh m = test::small_mesh(GetParam().number, 40);
  int combination = GetParam().number;
  Machine machine(static_cast<std::uint64_t>(GetParam().number));
  const Triangles triangles(machine, m.mesh);
  for (const References references : {References::once, References::budget, References::all}) {
    for (const std::uint32_t leaf_size : {1u, 2u, 4u, 8u, 1024u}) {
      for (const std::uint32_t code_bits : {0u, 6u, 32u, 64u}) {
        for (const AxisOrder order : {AxisOrder::by_extent, AxisOrder::cyclic}) {
          for (const bool recode : {true, false}) {
            if (++combination % 5 != 0) continue;
            SCOPED_TRACE(m.name + ", " + to_string(references) + ", leaf size " +
                         std::to_string(leaf_size) + ", " + std::to_string(code_bits) + " bits, " +
                         to_string(order) + (recode ? "" : ", not coded again"));
            const bool even = leaf_size == 2 || leaf_size == 8;
            expect_same(machine, triangles.view(), m.mesh.view(),
                        {.quality = even ? Quality::balanced : Quality::fast,
                         .references = references,
                         .leaf_size = leaf_size,
                         .code_bits = code_bits,
                         .axis_order = order,
                         .recode_crowded = recode,
                         .invalid_triangles = InvalidTriangles::skip,
                         .measure_quality = leaf_size == 4});
            if (HasFailure()) return;
          }
        }
      }
    }
  }
  EXPECT_FALSE(machine.memory.misused());
}

INSTANTIATE_TEST_SUITE_P(Every, CudaSame, testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

TEST(CudaSameTree, ForManySeeds) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    for (int kind = 0; kind < test::small_mesh_kinds; ++kind) {
      const test::NamedMesh m = test::small_mesh(kind, 50 + seed);
      Machine machine(seed);
      const Triangles triangles(machine, m.mesh);
      for (const BuildOptions& options : test::tree_kinds()) {
        SCOPED_TRACE(m.name + ", " + test::name_of(options) + ", seed " + std::to_string(seed));
        expect_same(machine, triangles.view(), m.mesh.view(), options);
        if (HasFailure()) return;
      }
    }
  }
}

struct LargerScene {
  const char* name;
  scene::Mesh (*mesh)();

  friend void PrintTo(const LargerScene& one, std::ostream* out) { *out << one.name; }
};

// Each a test of its own: the simulation takes its time.
class CudaSameLarger : public testing::TestWithParam<LargerScene> {};

TEST_P(CudaSameLarger, Scene) {
  const scene::Mesh mesh = GetParam().mesh();
  std::uint64_t seed = 0;
  for (const References references : {References::once, References::budget, References::all}) {
    SCOPED_TRACE(to_string(references));
    Machine machine(++seed);
    const Triangles triangles(machine, mesh);
    BuildOptions options = skipping(references);
    options.code_bits = seed % 2 == 0 ? 63 : 0;
    options.quality = seed % 3 != 0 ? Quality::balanced : Quality::fast;
    expect_same(machine, triangles.view(), mesh.view(), options);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, CudaSameLarger,
    testing::Values(
        LargerScene{"Soup", [] { return scene::soup(100000, 41); }},
        LargerScene{"Sphere", [] { return scene::sphere(6); }},
        LargerScene{"Grid", [] { return scene::grid(16); }},
        LargerScene{"TeapotInAStadium", [] { return scene::small_in_large(40000, 1e6F, 41); }},
        LargerScene{"Crowds",
                    [] { return scene::joined(scene::soup(20000, 42), scene::identical(10000)); }},
        LargerScene{
            "Stairs",
            [] { return scene::joined(scene::staircase(300), scene::same_centre(3000, 43)); }}),
    [](const auto& one) { return std::string(one.param.name); });

TEST(CudaSameTree, ForAThousandTriangles) {
  for (const std::uint32_t n : {999u, 1000u, 1023u, 1024u, 1025u}) {
    Machine machine(n);
    const scene::Mesh mesh = scene::soup(n, n);
    const Triangles triangles(machine, mesh);
    for (const References references : {References::once, References::budget, References::all})
      expect_same(machine, triangles.view(), mesh.view(), skipping(references));
  }
}

// From 2^22 triangles on codes have room for 64 bits, whether the triangles are valid or not; how
// many bits they have is decided by the valid ones, on the device.
TEST(CudaSameTree, WhereCodesBecomeWide) {
  scene::Mesh mesh = scene::soup(2000, 44);
  mesh.faces.resize((1u << 22) + 5, glm::uvec3(0));
  Machine machine(2);
  const Triangles triangles(machine, mesh);
  const Tree tree = build(machine.executor(), triangles.view()).to_host();
  EXPECT_EQ(tree_hash(tree.view()), tree_hash(on_cpu(mesh.view(), {}).view()));
  EXPECT_EQ(tree.options().code_bits, 32u);
  EXPECT_EQ(tree.statistics().skipped_zero_area, mesh.faces.size() - 2000);
}

// ---- Little or nothing to build -----------------------------------------------------------------

TEST(CudaSameTree, NothingToBuild) {
  scene::Mesh not_finite = scene::soup(100, 45);
  for (glm::vec3& p : not_finite.positions) p = glm::vec3(nan_value);
  scene::Mesh zero_area = scene::identical(50);
  for (glm::uvec3& face : zero_area.faces) face = {0, 1, 1};
  const test::NamedMesh meshes[] = {{"nothing", {}},
                                    {"vertices only", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}}},
                                    {"all NaN", not_finite},
                                    {"all of zero area", zero_area}};
  for (const test::NamedMesh& m : meshes) {
    for (const References references : {References::once, References::budget, References::all}) {
      for (std::uint64_t seed = 0; seed < 3; ++seed) {
        SCOPED_TRACE(m.name + ", " + to_string(references));
        Machine machine(seed);
        const Triangles triangles(machine, m.mesh);
        expect_same(machine, triangles.view(), m.mesh.view(), skipping(references));
        const Tree tree = simulated::build(machine.executor(), m.mesh.view(), skipping(references));
        EXPECT_TRUE(tree.view().empty());
        EXPECT_TRUE(verify::check_tree(tree, m.mesh.view()).empty());
      }
    }
  }
}

TEST(CudaSameTree, SomeAreNotFinite) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    scene::Mesh mesh = scene::soup(1500, 46 + seed);
    test::Random random(seed);
    for (int i = 0; i < 200; ++i) mesh.positions[random.below(4500)].y = nan_value;
    Machine machine(seed);
    const Triangles triangles(machine, mesh);
    for (const References references : {References::once, References::budget, References::all})
      expect_same(machine, triangles.view(), mesh.view(), skipping(references));
  }
}

TEST(CudaSameTree, AnEmptyTreeSaysNothing) {
  const simulated::Tree tree;
  EXPECT_NO_THROW(tree.check());
  EXPECT_TRUE(tree.to_host().view().empty());
  EXPECT_EQ(tree.statistics().triangles, 0u);
  EXPECT_EQ(tree.lattice().code_bits, 0u);
}

// ---- Where the triangles lie --------------------------------------------------------------------

TEST(CudaSameTree, FromHostAndDeviceMemory) {
  const scene::Mesh mesh = scene::sphere(3);
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    Machine machine(seed);
    const Triangles on_device(machine, mesh);
    TriangleView positions_there = mesh.view();
    positions_there.positions = on_device.view().positions;
    TriangleView indices_there = mesh.view();
    indices_there.indices = on_device.view().indices;
    for (const References references : {References::once, References::budget, References::all}) {
      expect_same(machine, on_device.view(), mesh.view(), skipping(references));
      expect_same(machine, mesh.view(), mesh.view(), skipping(references));
      expect_same(machine, positions_there, mesh.view(), skipping(references));
      expect_same(machine, indices_there, mesh.view(), skipping(references));
    }
    EXPECT_EQ(build(machine.executor(), on_device.view()).triangle_bytes(), 0u);
    EXPECT_GE(build(machine.executor(), mesh.view()).triangle_bytes(),
              mesh.positions.size() * 12 + mesh.faces.size() * 12);
  }
}

TEST(CudaSameTree, WhateverTheFormOfTheView) {
  const scene::Mesh mesh = scene::sphere(3);
  std::vector<glm::vec3> corners;
  for (const glm::uvec3& f : mesh.faces)
    for (int c = 0; c < 3; ++c) corners.push_back(mesh.positions[f[c]]);
  const TriangleView soup{std::span<const glm::vec3>(corners)};
  // Behind the last position there is nothing, not even the rest of its stride.
  std::vector<float> wide(8 * (mesh.positions.size() - 1) + 3, 7.0F);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    for (int a = 0; a < 3; ++a) wide[8 * i + static_cast<std::size_t>(a)] = mesh.positions[i][a];
  const TriangleView strided =
      TriangleView::strided(wide.data(), mesh.positions.size(), 32, mesh.faces);
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    Machine machine(seed);
    const simulated::Array<float> uploaded(std::span<const float>(wide), machine.aside());
    TriangleView on_device = strided;
    on_device.positions = uploaded.data();
    for (const References references : {References::once, References::budget, References::all}) {
      expect_same(machine, soup, mesh.view(), skipping(references));
      expect_same(machine, strided, mesh.view(), skipping(references));
      expect_same(machine, on_device, mesh.view(), skipping(references));
    }
  }
}

// ---- Rays and copies ----------------------------------------------------------------------------

TEST(CudaSameTree, RaysFindTheSame) {
  for (const int kind : {0, 2, 8, 10, 13, 24, 28}) {
    const test::NamedMesh m = test::small_mesh(kind, 47);
    const std::vector<Ray> rays = scene::rays_at_features(m.mesh, 300, 48);
    Machine machine(static_cast<std::uint64_t>(kind));
    for (const References references : {References::once, References::budget, References::all}) {
      const Tree tree = on_cpu(m.mesh.view(), skipping(references));
      std::vector<Hit> want(rays.size());
      closest_hit(cpu::Executor{}, tree.view(), m.mesh.view(), rays, want);
      const std::vector<Hit> got =
          simulated::closest_hits(machine.executor(), tree, m.mesh.view(), rays);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(got[i].triangle, want[i].triangle) << m.name << ", ray " << i;
        ASSERT_EQ(got[i].t, want[i].t) << m.name << ", ray " << i;
      }
    }
  }
}

TEST(CudaSameTree, ToTheDeviceAndBack) {
  std::vector<test::NamedMesh> meshes;
  for (int kind = 0; kind < test::small_mesh_kinds; ++kind)
    meshes.push_back(test::small_mesh(kind, 49));
  meshes.push_back({"nothing", {}});
  std::uint64_t seed = 0;
  for (const test::NamedMesh& m : meshes) {
    Machine machine(++seed);
    for (const References references : {References::once, References::budget, References::all}) {
      SCOPED_TRACE(m.name + ", " + to_string(references));
      BuildOptions options = skipping(references);
      options.measure_quality = true;
      const Tree tree = on_cpu(m.mesh.view(), options);
      const simulated::Tree there = simulated::to_device(machine.executor(), tree, m.mesh.view());
      const Tree back = there.to_host();
      ASSERT_EQ(tree_hash(back.view()), tree_hash(tree.view()));
      ASSERT_EQ(back.view().leaf_offsets[0], 0u) << "of an empty tree too";
      expect_same_statistics(back.statistics(), tree.statistics());
      expect_same_lattice(back.lattice(), tree.lattice());
      EXPECT_EQ(back.options().code_bits, tree.options().code_bits);
      for (const std::string& violation : verify::check_tree(back, m.mesh.view()))
        ADD_FAILURE() << violation;
    }
    EXPECT_EQ(machine.memory.live_blocks(), 0u);
  }
  // A tree that was never built.
  Machine machine;
  EXPECT_TRUE(simulated::to_device(machine.executor(), Tree(), {}).to_host().view().empty());
}

}  // namespace
}  // namespace zkd
