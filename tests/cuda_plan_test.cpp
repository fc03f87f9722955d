// SPDX-License-Identifier: Apache-2.0
//
// What a build on a device does beforehand and leaves alone: its memory is what was said, its
// passes depend on counts and options, nobody waits, and a graph replays it over what is in the
// arrays then.
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/frames.hpp"
#include "support/meshes.hpp"
#include "support/simulated_machine.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using simulated::Array;
using simulated::Graph;
using simulated::Launch;
using simulated::Machine;
using simulated::Stream;
using simulated::Triangles;
using verify::tree_hash;
using Bytes = std::vector<std::size_t>;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

std::string cpu_hash(const scene::Mesh& mesh, const BuildOptions& options) {
  return tree_hash(build(cpu::Executor{.threads = 2}, mesh.view(), options).view());
}

// Options as builds on a device take them, in all the ways that change what is launched.
std::vector<BuildOptions> plans() {
  std::vector<BuildOptions> all;
  for (const References references : {References::once, References::all})
    for (const std::uint32_t code_bits : {0u, 20u, 48u})
      for (const std::uint32_t leaf_size : {1u, 4u, 1024u})
        for (const bool recode : {true, false})
          all.push_back({.references = references,
                         .reference_capacity = 40000,
                         .leaf_size = leaf_size,
                         .code_bits = code_bits,
                         .recode_crowded = recode,
                         .invalid_triangles = InvalidTriangles::skip});
  return all;
}

// Very different scenes of n triangles.
std::vector<scene::Mesh> scenes_of(std::uint32_t n) {
  scene::Mesh with_nan = scene::soup(n, 60);
  for (std::size_t i = 0; i < with_nan.positions.size(); i += 7)
    with_nan.positions[i].x = nan_value;
  scene::Mesh out_of_range = scene::soup(n, 61);
  out_of_range.faces[n / 2].y = 0xFFFFFFFFu;
  return {
      scene::soup(n, 62), scene::identical(n), scene::same_centre(n, 63), scene::random_bits(n, 64),
      with_nan,           out_of_range};
}

// ---- Memory -------------------------------------------------------------------------------------

TEST(CudaPlan, AllocatesWhatWasSaid) {
  for (const std::uint32_t n : {1u, 3u, 400u}) {
    const std::vector<scene::Mesh> scenes = scenes_of(n);
    const std::vector<BuildOptions> all = plans();
    for (std::size_t p = 0; p < all.size(); ++p) {
      const BuildOptions& options = all[p];
      // Two scenes for each plan; plans that differ in one option meet others.
      const std::size_t pair = (p + p / 6) % 3;
      for (const std::size_t number : {2 * pair, 2 * pair + 1}) {
        const scene::Mesh& mesh = scenes.at(number);
        Machine machine(number);
        const Triangles triangles(machine, mesh);
        const MemoryRequirement need = memory_requirement(machine.executor(), n, options);
        EXPECT_EQ(machine.memory.asked(), Bytes{});
        EXPECT_EQ(need.tree_bytes % 256, 0u);
        EXPECT_EQ(need.workspace_bytes % 256, 0u);
        {
          const simulated::Tree tree = build(machine.executor(), triangles.view(), options);
          EXPECT_EQ(machine.memory.asked(), (Bytes{need.tree_bytes, need.workspace_bytes}));
          EXPECT_EQ(machine.memory.live_blocks(), 1u) << "the workspace was given back";
          EXPECT_EQ(tree.tree_bytes(), need.tree_bytes);
          EXPECT_EQ(tree.triangle_bytes(), 0u);
        }
        EXPECT_EQ(machine.memory.live_blocks(), 0u);

        machine.memory.forget();
        Array<std::byte> workspace = machine.workspace(need.workspace_bytes);
        simulated::Tree tree = build(machine.executor(workspace), triangles.view(), options);
        EXPECT_EQ(machine.memory.asked(), Bytes{need.tree_bytes});
        machine.memory.forget();
        rebuild(machine.executor(workspace), tree, triangles.view());
        EXPECT_EQ(machine.memory.asked(), Bytes{});
        rebuild(machine.executor(), tree, triangles.view());
        EXPECT_EQ(machine.memory.asked(), Bytes{need.workspace_bytes});
        EXPECT_FALSE(machine.memory.misused());
      }
    }
  }
}

TEST(CudaPlan, AllocatesForTrianglesInHostMemory) {
  const scene::Mesh mesh = scene::soup(1000, 65);
  Machine machine;
  const MemoryRequirement need = memory_requirement(machine.executor(), 1000);
  const simulated::Tree tree = build(machine.executor(), mesh.view());
  EXPECT_EQ(machine.memory.asked(),
            (Bytes{need.tree_bytes, tree.triangle_bytes(), need.workspace_bytes}));
  EXPECT_LT(tree.triangle_bytes(), 3000 * 12 + 3000 * 4 + 128u);
}

// A tree has room for any scene of its size, and no more than that.
TEST(CudaPlan, TheWorkspaceIsUsedToItsEnd) {
  for (const BuildOptions& options : plans()) {
    Machine machine;
    const MemoryRequirement need = memory_requirement(machine.executor(), 1000, options);
    EXPECT_GE(need.tree_bytes, 999 * sizeof(Node) + 1001 * 4 + 1000 * 4);
    const std::uint64_t strict =
        options.references == References::all ? options.reference_capacity * 320 : 0;
    EXPECT_LE(need.workspace_bytes, 4 * 1024 * 1024u + strict);
  }
}

TEST(CudaPlan, SaysWhatTheMostTrianglesTake) {
  Machine machine;
  for (const BuildOptions& options : plans()) {
    const MemoryRequirement most = memory_requirement(machine.executor(), max_count, options);
    EXPECT_GT(most.tree_bytes, max_count * sizeof(Node));
    EXPECT_GT(most.workspace_bytes, max_count * 40);
  }
  EXPECT_EQ(machine.memory.asked(), Bytes{});
  EXPECT_TRUE(machine.stream.launches().empty());
}

// The largest scenes of the paper have 1.1 million triangles: tree, workspace and a copy of the
// triangles at once.
TEST(CudaPlan, PaperScenesFitIn1500Megabytes) {
  constexpr std::uint64_t n = 1100000;
  constexpr std::uint64_t limit = 1500000000;
  constexpr std::uint64_t copy = n * 3 * (sizeof(glm::vec3) + sizeof(std::uint32_t));
  Machine machine;
  for (const std::uint32_t code_bits : {0u, 64u}) {
    const MemoryRequirement need =
        memory_requirement(machine.executor(), n, {.code_bits = code_bits});
    EXPECT_LT(need.tree_bytes + need.workspace_bytes + copy, limit) << code_bits << " bits";
    EXPECT_GT(need.tree_bytes, n * sizeof(Node)) << "not so little that it says nothing";
  }
}

TEST(CudaPlan, AnUnusedWorkspaceIsLeftAlone) {
  const scene::Mesh mesh = scene::soup(1000, 66);
  Machine machine;
  const MemoryRequirement need = memory_requirement(machine.executor(), 1000);
  Array<std::byte> workspace(need.workspace_bytes + 5000, std::byte{0x3C}, machine.aside());
  simulated::Executor executor = machine.executor(workspace);
  const simulated::Tree tree = build(executor, mesh.view());
  EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(mesh, {}));
  const std::vector<std::byte> bytes = workspace.download();
  for (std::size_t i = need.workspace_bytes; i < bytes.size(); ++i)
    ASSERT_EQ(bytes[i], std::byte{0x3C}) << "byte " << i;
}

// ---- Passes -------------------------------------------------------------------------------------

TEST(CudaPlan, PassesDependOnCountsAndOptions) {
  for (const std::uint32_t n : {1u, 3u, 1000u}) {
    const std::vector<scene::Mesh> scenes = scenes_of(n);
    std::size_t plan = 0;
    for (const BuildOptions& options : plans()) {
      std::vector<Launch> want;
      // The soup and one of the others, in turn.
      for (const std::size_t number : {std::size_t{0}, 1 + plan++ % (scenes.size() - 1)}) {
        const scene::Mesh& mesh = scenes.at(number);
        Machine machine(number);
        const Triangles triangles(machine, mesh);
        machine.stream.forget();
        simulated::Tree tree = build(machine.executor(), triangles.view(), options);
        const std::vector<Launch> got = machine.stream.launches();
        if (want.empty()) want = got;
        ASSERT_TRUE(got == want);
        EXPECT_EQ(machine.stream.synchronisations(), 0u);

        simulated::Device device(machine.executor());
        EXPECT_EQ(
            cuda::plan_build(device, triangles.view(), options, cuda::capacity_for(n, options))
                .passes,
            got.size());
        machine.stream.forget();
        rebuild(machine.executor(), tree, triangles.view());
        EXPECT_TRUE(machine.stream.launches() == want) << "a rebuild is the same passes";
        EXPECT_EQ(machine.stream.synchronisations(), 0u);
      }
      EXPECT_LE(want.size(), options.references == References::all ? 80u : 45u)
          << "so few that small scenes are not all launches";
    }
  }
}

TEST(CudaPlan, PassesAreThoseOfTheirStage) {
  Machine machine;
  const scene::Mesh mesh = scene::soup(1000, 67);
  const Triangles triangles(machine, mesh);
  std::vector<int> passes(static_cast<std::size_t>(Stage::count) + 1);
  for (const BuildOptions& options :
       {BuildOptions{.references = References::all, .reference_capacity = 10000},
        BuildOptions{.quality = Quality::balanced, .references = References::budget}}) {
    machine.stream.forget();
    (void)build(machine.executor(), triangles.view(), options);
    Stage before = Stage::validate;
    for (const Launch& launch : machine.stream.launches()) {
      EXPECT_GE(launch.stage, before) << launch.name;
      before = launch.stage;
      ++passes[static_cast<std::size_t>(launch.stage)];
    }
  }
  EXPECT_EQ(passes.back(), 0) << "after the last stage";
  passes.pop_back();
  for (std::size_t stage = 0; stage < passes.size(); ++stage)
    EXPECT_GT(passes[stage], 0) << to_string(static_cast<Stage>(stage));
}

// ---- Nobody waits -------------------------------------------------------------------------------

TEST(CudaPlan, RunsWhenTheDeviceGetsToIt) {
  for (const References references : {References::once, References::all}) {
    const scene::Mesh mesh = scene::small_in_large(1000, 1e6F, 68);
    const BuildOptions options{.references = references, .reference_capacity = 40000};
    Machine machine(1, Stream::Pace::when_waited_for);
    const Triangles triangles(machine, mesh);
    simulated::Tree tree;
    {
      // What the caller passed is gone before anything runs; the trees move.
      auto view = std::make_unique<TriangleView>(triangles.view());
      auto given = std::make_unique<BuildOptions>(options);
      simulated::Tree first = build(machine.executor(), *view, *given);
      tree = std::move(first);
    }
    EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(mesh, options));
  }
}

TEST(CudaPlan, BuildsFollowEachOther) {
  Machine machine(1, Stream::Pace::when_waited_for);
  const MemoryRequirement need = memory_requirement(machine.executor(), 3000);
  Array<std::byte> workspace = machine.workspace(need.workspace_bytes);
  std::vector<scene::Mesh> meshes;
  std::vector<simulated::Tree> trees;
  for (std::uint32_t i = 0; i < 5; ++i) meshes.push_back(scene::soup(1000 + 500 * (i % 4), i));
  for (const scene::Mesh& mesh : meshes)
    trees.push_back(build(machine.executor(workspace), mesh.view()));
  { const simulated::Tree dropped = build(machine.executor(), meshes[0].view()); }
  for (std::size_t i = 0; i < trees.size(); ++i)
    EXPECT_EQ(tree_hash(trees[i].to_host().view()), cpu_hash(meshes[i], {}));
  trees.clear();
  EXPECT_EQ(machine.memory.live_blocks(), 0u);
}

TEST(CudaPlan, RaysFollowABuildAtOnce) {
  const scene::Mesh mesh = scene::sphere(3);
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 200, 69);
  Machine machine(1, Stream::Pace::when_waited_for);
  const Array<Ray> uploaded(rays, machine.aside());
  Array<Hit> hits(rays.size(), Hit{}, machine.aside());
  machine.stream.forget();
  const simulated::Tree tree = build(machine.executor(), mesh.view());
  closest_hit(machine.executor(), tree.view(), tree.triangles(), uploaded, hits);
  EXPECT_EQ(machine.stream.synchronisations(), 0u);
  const std::vector<Hit> got = hits.download();
  const Tree on_cpu = build(mesh.view());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto want = closest_hit(on_cpu.view(), mesh.view(), rays[i]);
    ASSERT_EQ(got[i].triangle, want.has_value() ? want->triangle : no_triangle) << "ray " << i;
  }
}

// ---- Rebuilding ---------------------------------------------------------------------------------

TEST(CudaPlan, RebuildsOverFewerTriangles) {
  for (const References references : {References::once, References::all}) {
    const BuildOptions options{.references = references, .reference_capacity = 60000};
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      Machine machine(seed);
      const Triangles most(machine, scene::soup(3000, 70));
      simulated::Tree tree = build(machine.executor(), most.view(), options);
      const void* const header = tree.view().header;
      for (const std::uint32_t n : {2999u, 1u, 0u, 40u, 3000u}) {
        const scene::Mesh mesh = scene::soup(n, 71 + n);
        const Triangles triangles(machine, mesh);
        rebuild(machine.executor(), tree, triangles.view());
        EXPECT_EQ(tree.view().header, header) << "views stay valid";
        EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(mesh, options)) << n;
        EXPECT_EQ(tree.statistics().triangles, n);
      }
    }
  }
}

TEST(CudaPlan, RebuildsFromHostMemory) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    Machine machine(seed);
    const scene::Mesh most = scene::soup(500, 72);
    const scene::Mesh fewer = scene::sphere(2);
    simulated::Tree tree = build(machine.executor(), most.view());
    rebuild(machine.executor(), tree, fewer.view());
    EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(fewer, {}));
    rebuild(machine.executor(), tree, most.view());
    EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(most, {}));
    const Triangles on_device(machine, fewer);
    rebuild(machine.executor(), tree, on_device.view());
    EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(fewer, {}));
    EXPECT_EQ(tree.triangles().positions, on_device.view().positions);
  }
}

// ---- Graphs -------------------------------------------------------------------------------------

void expect_replays(const BuildOptions& options, std::uint64_t seed) {
  Machine machine(seed);
  const std::vector<test::NamedMesh> scenes = test::frames();
  Triangles triangles(machine, scenes[0].mesh);
  const MemoryRequirement need = memory_requirement(machine.executor(), 2000, options);
  Array<std::byte> workspace = machine.workspace(need.workspace_bytes);
  simulated::Tree tree = build(machine.executor(workspace), triangles.view(), options);
  machine.memory.forget();
  machine.stream.begin_capture();
  rebuild(machine.executor(workspace), tree, triangles.view());
  const Graph graph = machine.stream.end_capture();
  EXPECT_EQ(machine.memory.asked(), Bytes{});

  for (int round = 0; round < 2; ++round) {
    for (const test::NamedMesh& frame : scenes) {
      SCOPED_TRACE(frame.name + ", " + to_string(options.references));
      triangles.assign(frame.mesh);
      machine.stream.launch(graph);
      std::string want;
      std::string failure;
      try {
        const Tree on_cpu = build(cpu::Executor{.threads = 2}, frame.mesh.view(), options);
        want = tree_hash(on_cpu.view());
        if (options.references == References::all &&
            on_cpu.view().reference_count() > options.reference_capacity)
          failure = "needs ";  // how many: once crowded leaves are split, or before
      } catch (const Error& error) {
        failure = error.what();
      }
      try {
        EXPECT_EQ(tree_hash(tree.to_host().view()), want);
        EXPECT_EQ(failure, "");
      } catch (const Error& error) {
        EXPECT_NE(failure, "") << error.what();
        EXPECT_NE(std::string(error.what()).find(failure), std::string::npos) << error.what();
      }
    }
  }
}

TEST(CudaPlan, AGraphReplaysABuild) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    for (const auto invalid : {InvalidTriangles::error, InvalidTriangles::skip})
      for (const bool recode : {true, false})
        expect_replays({.recode_crowded = recode, .invalid_triangles = invalid}, seed);
    expect_replays({.references = References::all, .reference_capacity = 15000}, seed);
  }
}

TEST(CudaPlan, AGraphReadsHostMemoryAtEachReplay) {
  const scene::Mesh first = scene::soup(500, 82);
  const scene::Mesh second = scene::soup(500, 83);
  scene::Mesh mesh = first;
  Machine machine;
  const MemoryRequirement need = memory_requirement(machine.executor(), 500);
  Array<std::byte> workspace = machine.workspace(need.workspace_bytes);
  simulated::Tree tree = build(machine.executor(workspace), mesh.view());
  machine.stream.begin_capture();
  rebuild(machine.executor(workspace), tree, mesh.view());
  const Graph graph = machine.stream.end_capture();
  for (const scene::Mesh* now : {&second, &first}) {
    tree.check();
    std::copy(now->positions.begin(), now->positions.end(), mesh.positions.begin());
    machine.stream.launch(graph);
    EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(*now, {}));
  }
}

TEST(CudaPlan, WithoutAWorkspaceACaptureIsRefused) {
  const scene::Mesh mesh = scene::soup(500, 84);
  Machine machine;
  const Triangles triangles(machine, mesh);
  simulated::Tree tree = build(machine.executor(), triangles.view());
  machine.stream.begin_capture();
  EXPECT_THROW(rebuild(machine.executor(), tree, triangles.view()), Error);
  (void)machine.stream.end_capture();
  EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(mesh, {}));
}

}  // namespace
}  // namespace zkd
