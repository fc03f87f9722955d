// SPDX-License-Identifier: Apache-2.0
//
// What goes wrong in builds on a device: the CPU's errors, at once where the host knows, from the
// tree where only the device does; and a tree that rays can still be sent through.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/simulated_machine.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using simulated::Array;
using simulated::Machine;
using simulated::Triangles;
using verify::tree_hash;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

struct Caught {
  bool thrown = false;
  ErrorCode code{};
  std::uint64_t offender = 0;
  std::string message;

  friend bool operator==(const Caught&, const Caught&) = default;
};

void PrintTo(const Caught& caught, std::ostream* out) {
  *out << (caught.thrown ? caught.message : "nothing thrown");
}

Caught caught(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return {true, error.code(), error.offender(), error.what()};
  }
  return {};
}

Caught cpu_error(const TriangleView& triangles, const BuildOptions& options) {
  return caught([&] { (void)build(cpu::Executor{.threads = 2}, triangles, options); });
}

void expect_empty_and_traceable(Machine& machine, const simulated::Tree& tree) {
  TreeHeader header;
  simulated::Device device(machine.aside());
  device.copy_to_host(&header, tree.view().header, sizeof header);
  EXPECT_EQ(header.leaf_count, 0u);
  EXPECT_EQ(header.reference_count, 0u);
  EXPECT_TRUE(header.root.is_none());
  EXPECT_TRUE(header.bounds.empty());
  const std::vector<Ray> rays = scene::random_rays({}, 20, 90);
  const Array<Ray> uploaded(rays, machine.aside());
  Array<Hit> hits(rays.size(), Hit{1.0F, 0.0F, 0.0F, 0}, machine.aside());
  closest_hit(machine.aside(), tree.view(), tree.triangles(), uploaded, hits);
  for (const Hit& hit : hits.download()) EXPECT_EQ(hit.triangle, no_triangle);
}

// Everything that asks the tree throws the CPU's error; the tree can be built again.
void expect_cpu_error(const scene::Mesh& mesh, const BuildOptions& options) {
  const Caught want = cpu_error(mesh.view(), options);
  ASSERT_TRUE(want.thrown);
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    for (const bool on_device : {true, false}) {
      Machine machine(seed);
      const Triangles uploaded(machine, mesh);
      const TriangleView view = on_device ? uploaded.view() : mesh.view();
      simulated::Tree tree;
      EXPECT_EQ(caught([&] { tree = build(machine.executor(), view, options); }), Caught{})
          << "the host does not wait for it";
      EXPECT_EQ(caught([&] { tree.check(); }), want);
      EXPECT_EQ(caught([&] { (void)tree.to_host(); }), want);
      EXPECT_EQ(caught([&] { (void)tree.statistics(); }), want);
      EXPECT_EQ(caught([&] { (void)tree.lattice(); }), want);
      EXPECT_EQ(caught([&] { tree.check(); }), want) << "asked again";
      EXPECT_EQ(caught([&] { (void)analyse(machine.executor(), view, options); }), want);
      expect_empty_and_traceable(machine, tree);

      const scene::Mesh good = scene::soup(static_cast<std::uint32_t>(mesh.faces.size()) / 2, 91);
      const Triangles good_uploaded(machine, good);
      rebuild(machine.executor(), tree, good_uploaded.view());
      EXPECT_EQ(tree_hash(tree.to_host().view()), tree_hash(build(good.view(), options).view()));
      rebuild(machine.executor(), tree, uploaded.view());
      EXPECT_EQ(caught([&] { tree.check(); }), want);
      EXPECT_FALSE(machine.memory.misused());
    }
  }
}

// ---- What only the device knows -----------------------------------------------------------------

TEST(CudaError, IndexOutOfRange) {
  int combination = 0;
  for (const References references : {References::once, References::all}) {
    for (const std::uint32_t bad : {9000u, 9001u, 0x7FFFFFFFu, 0xFFFFFFFFu, 9000u}) {
      // Five in a row, so that each meets both.
      const InvalidTriangles invalid =
          combination++ % 2 == 0 ? InvalidTriangles::error : InvalidTriangles::skip;
      scene::Mesh mesh = scene::soup(3000, 92);
      mesh.faces[2999].x = bad;
      mesh.faces[1234].z = bad;
      mesh.faces[1234].y = bad;
      mesh.positions[30].x = nan_value;
      const BuildOptions options{
          .references = references, .reference_capacity = 60000, .invalid_triangles = invalid};
      expect_cpu_error(mesh, options);
      EXPECT_EQ(cpu_error(mesh.view(), options).offender, 1234u);
    }
  }
}

TEST(CudaError, NonFiniteVertex) {
  for (const References references : {References::once, References::all}) {
    for (const float bad : {nan_value, infinity, -infinity}) {
      scene::Mesh mesh = scene::soup(3000, 93);
      mesh.positions[3 * 777 + 1].z = bad;
      mesh.positions[8999].x = bad;
      const BuildOptions options{.references = references, .reference_capacity = 60000};
      expect_cpu_error(mesh, options);
      EXPECT_EQ(cpu_error(mesh.view(), options).offender, 777u);
    }
  }
}

TEST(CudaError, ReferenceCapacity) {
  const scene::Mesh mesh = scene::needles(1000, 94);
  BuildOptions options{.references = References::all, .reference_capacity = 0};
  const Tree want = build(mesh.view(), options);
  const std::uint64_t needed = want.view().reference_count();
  ASSERT_GT(needed, 2000u);
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    for (const std::uint64_t capacity : {std::uint64_t{1}, needed / 2, needed - 1}) {
      Machine machine(seed);
      const Triangles triangles(machine, mesh);
      options.reference_capacity = capacity;
      simulated::Tree tree = build(machine.executor(), triangles.view(), options);
      const Caught error = caught([&] { tree.check(); });
      ASSERT_TRUE(error.thrown);
      EXPECT_EQ(error.code, ErrorCode::reference_capacity);
      // Without room for those of leaves before crowded ones are split, their number is all that is
      // known.
      if (capacity == 1) {
        EXPECT_GT(error.offender, capacity);
        EXPECT_LE(error.offender, needed);
      } else {
        EXPECT_EQ(error.offender, needed);
      }
      EXPECT_NE(error.message.find(std::to_string(error.offender)), std::string::npos)
          << error.message;
      EXPECT_NE(error.message.find(std::to_string(capacity)), std::string::npos) << error.message;
      expect_empty_and_traceable(machine, tree);

      const scene::Mesh one = scene::soup(1, 95);
      const Triangles less(machine, one);
      rebuild(machine.executor(), tree, less.view());
      EXPECT_EQ(tree_hash(tree.to_host().view()), tree_hash(build(one.view(), options).view()));
      rebuild(machine.executor(), tree, triangles.view());
      EXPECT_EQ(caught([&] { tree.check(); }), error);
    }
    Machine machine(seed);
    options.reference_capacity = needed;
    EXPECT_EQ(tree_hash(build(machine.executor(), mesh.view(), options).to_host().view()),
              tree_hash(want.view()));
  }
}

TEST(CudaError, AnalyseGivesItsMemoryBack) {
  for (const std::size_t invalid : {0u, 1u}) {
    scene::Mesh mesh = scene::soup(1000, 96);
    if (invalid != 0) mesh.positions[0].x = nan_value;
    Machine machine;
    (void)caught(
        [&] { (void)analyse(machine.executor(), mesh.view(), {.references = References::all}); });
    machine.stream.synchronize();
    EXPECT_EQ(machine.memory.live_blocks(), 0u);
  }
}

// What analyse() says is a set of options to build with, whatever was asked of it.
TEST(CudaError, AnalysedOptionsAreOptions) {
  const scene::Mesh mesh = scene::needles(300, 97);
  Machine machine;
  const BuildOptions once = analyse(machine.executor(), mesh.view(), {.reference_capacity = 12345});
  EXPECT_EQ(once.reference_capacity, 12345u) << "not looked at with `once`, so left as it was";
  EXPECT_EQ(tree_hash(build(machine.executor(), mesh.view(), once).to_host().view()),
            tree_hash(build(mesh.view()).view()));
}

// ---- What is known beforehand -------------------------------------------------------------------

TEST(CudaError, OptionsAndViewsAsOnTheCpu) {
  const scene::Mesh mesh = scene::soup(100, 98);
  std::vector<BuildOptions> wrong(8);
  wrong[0].quality = static_cast<Quality>(99);
  wrong[1].leaf_size = 1025;
  wrong[2].code_bits = 65;
  wrong[3].axis_order = static_cast<AxisOrder>(99);
  wrong[4].references = static_cast<References>(99);
  wrong[5].sah.test_cost = 0.0F;
  wrong[6].reference_capacity = max_count + 1;
  wrong[7].budget = nan_value;
  Machine machine;
  for (const BuildOptions& options : wrong) {
    const Caught want = cpu_error(mesh.view(), options);
    ASSERT_TRUE(want.thrown);
    EXPECT_EQ(caught([&] { (void)build(machine.executor(), mesh.view(), options); }), want);
    EXPECT_EQ(caught([&] { (void)analyse(machine.executor(), mesh.view(), options); }), want);
    EXPECT_EQ(caught([&] { (void)memory_requirement(machine.executor(), 100, options); }), want);
  }
  simulated::Tree tree = build(machine.executor(), mesh.view());
  std::vector<TriangleView> views(4, mesh.view());
  views[0].position_stride = 13;
  views[1].positions = nullptr;
  views[2].triangle_count = max_count + 1;
  views[3].indices = nullptr;
  views[3].triangle_count = 99;
  for (const TriangleView& view : views) {
    const Caught want = cpu_error(view, {});
    ASSERT_TRUE(want.thrown);
    EXPECT_EQ(caught([&] { (void)build(machine.executor(), view); }), want);
    EXPECT_EQ(caught([&] { (void)analyse(machine.executor(), view); }), want);
    EXPECT_EQ(caught([&] { rebuild(machine.executor(), tree, view); }), want);
  }
  EXPECT_EQ(caught([&] { (void)memory_requirement(machine.executor(), max_count + 1); }).code,
            ErrorCode::too_many_triangles);
  EXPECT_EQ(tree_hash(tree.to_host().view()), tree_hash(build(mesh.view()).view()));
}

TEST(CudaError, AllWithoutACapacity) {
  const scene::Mesh mesh = scene::soup(100, 99);
  const BuildOptions options{.references = References::all};
  Machine machine;
  for (const Caught& error :
       {caught([&] { (void)build(machine.executor(), mesh.view(), options); }),
        caught([&] { (void)memory_requirement(machine.executor(), 100, options); })}) {
    EXPECT_TRUE(error.thrown);
    EXPECT_EQ(error.code, ErrorCode::invalid_option);
    EXPECT_NE(error.message.find("analyse"), std::string::npos) << error.message;
  }
  EXPECT_TRUE(machine.stream.launches().empty());
}

TEST(CudaError, Workspaces) {
  const scene::Mesh mesh = scene::soup(1000, 100);
  Machine machine;
  const Triangles triangles(machine, mesh);
  const MemoryRequirement need = memory_requirement(machine.executor(), 1000);
  Array<std::byte> workspace = machine.workspace(need.workspace_bytes + 256);
  machine.stream.forget();
  simulated::Executor executor = machine.executor(workspace);
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, need.workspace_bytes - 1}) {
    executor.workspace_bytes = bytes;
    const Caught error = caught([&] { (void)build(executor, triangles.view()); });
    EXPECT_TRUE(error.thrown);
    EXPECT_EQ(error.code, ErrorCode::out_of_memory);
    EXPECT_EQ(error.offender, need.workspace_bytes);
    EXPECT_NE(error.message.find(std::to_string(need.workspace_bytes)), std::string::npos);
  }
  for (const std::size_t by : {1u, 64u, 128u}) {
    executor = machine.executor(workspace);
    executor.workspace = static_cast<std::byte*>(executor.workspace) + by;
    executor.workspace_bytes -= by;
    const Caught error = caught([&] { (void)build(executor, triangles.view()); });
    EXPECT_TRUE(error.thrown);
    EXPECT_EQ(error.code, ErrorCode::invalid_option);
  }
  EXPECT_TRUE(machine.stream.launches().empty());
  machine.stream.synchronize();
  EXPECT_EQ(machine.memory.live_blocks(), 0u);

  simulated::Tree tree = build(machine.executor(workspace), triangles.view());
  executor = machine.executor(workspace);
  executor.workspace_bytes = need.workspace_bytes - 256;
  EXPECT_EQ(caught([&] { rebuild(executor, tree, triangles.view()); }).code,
            ErrorCode::out_of_memory);
  EXPECT_EQ(tree_hash(tree.to_host().view()), tree_hash(build(mesh.view()).view()));
}

TEST(CudaError, RebuildsOnlyWhatHasRoom) {
  const scene::Mesh mesh = scene::soup(100, 101);
  const scene::Mesh more = scene::soup(101, 101);
  Machine machine;
  const Triangles triangles(machine, mesh);
  const Triangles more_triangles(machine, more);
  simulated::Tree tree = build(machine.executor(), triangles.view());
  machine.stream.forget();
  const Caught error = caught([&] { rebuild(machine.executor(), tree, more_triangles.view()); });
  EXPECT_TRUE(error.thrown);
  EXPECT_EQ(error.code, ErrorCode::invalid_view);
  EXPECT_EQ(error.offender, 101u);
  // Host memory where it was device memory.
  EXPECT_EQ(caught([&] { rebuild(machine.executor(), tree, mesh.view()); }).code,
            ErrorCode::invalid_view);
  EXPECT_TRUE(machine.stream.launches().empty());
  EXPECT_EQ(tree_hash(tree.to_host().view()), tree_hash(build(mesh.view()).view()));

  // More positions than were copied.
  simulated::Tree copied = build(machine.executor(), mesh.view());
  scene::Mesh more_positions = mesh;
  more_positions.positions.resize(400);
  EXPECT_EQ(caught([&] { rebuild(machine.executor(), copied, more_positions.view()); }).code,
            ErrorCode::invalid_view);
}

// A tree that was not built on the device has no room, not even for nothing.
TEST(CudaError, RebuildsOnlyWhatWasBuilt) {
  const scene::Mesh mesh = scene::soup(100, 102);
  Machine machine;
  const Triangles triangles(machine, mesh);
  simulated::Tree built = build(machine.executor(), triangles.view());
  const simulated::Tree moved_to = std::move(built);
  const Tree on_cpu = build(mesh.view());
  simulated::Tree copied = simulated::to_device(machine.executor(), on_cpu, triangles.view());
  simulated::Tree never;
  machine.stream.forget();
  for (simulated::Tree* tree : {&never, &built, &copied})
    for (const TriangleView& view : {TriangleView{}, triangles.view()})
      EXPECT_EQ(caught([&] { rebuild(machine.executor(), *tree, view); }).code,
                ErrorCode::invalid_view);
  EXPECT_TRUE(machine.stream.launches().empty());
  EXPECT_EQ(tree_hash(copied.to_host().view()), tree_hash(on_cpu.view()));
}

// ---- Level by level
// ------------------------------------------------------------------------------

// It waits, so it throws at once.
TEST(CudaError, Wu2011ThrowsWhatTheCpuThrows) {
  scene::Mesh mesh = scene::soup(300, 105);
  mesh.positions[100].x = nan_value;
  const BuildOptions options{.builder = Builder::wu2011};
  const auto expect_at_once = [&] {
    const Caught want = cpu_error(mesh.view(), options);
    ASSERT_TRUE(want.thrown);
    Machine machine;
    const Triangles uploaded(machine, mesh);
    const std::size_t live = machine.memory.live_blocks();
    EXPECT_EQ(caught([&] { (void)build(machine.executor(), uploaded.view(), options); }), want);
    EXPECT_EQ(caught([&] { (void)build(machine.executor(), mesh.view(), options); }), want);
    machine.stream.synchronize();
    EXPECT_EQ(machine.memory.live_blocks(), live);
  };
  expect_at_once();
  mesh.faces[7].y = 900;
  expect_at_once();
}

TEST(CudaError, Wu2011MakesRoomAsItGoes) {
  const scene::Mesh mesh = scene::soup(300, 106);
  BuildOptions options{.builder = Builder::wu2011, .references = References::all};
  Machine machine;
  EXPECT_EQ(caught([&] { (void)memory_requirement(machine.executor(), 300, options); }).code,
            ErrorCode::unsupported_option);
  const BuildOptions found = analyse(machine.executor(), mesh.view(), options);
  EXPECT_EQ(found.builder, Builder::wu2011);
  EXPECT_EQ(found.reference_capacity, 0u);
  simulated::Tree tree = build(machine.executor(), mesh.view(), found);
  const std::string hash = tree_hash(build(mesh.view(), {.builder = Builder::sah}).view());
  EXPECT_EQ(tree_hash(tree.to_host().view()), hash);
  const Caught again = caught([&] { rebuild(machine.executor(), tree, mesh.view()); });
  EXPECT_EQ(again.code, ErrorCode::unsupported_option) << again.message;
  EXPECT_EQ(tree_hash(tree.to_host().view()), hash) << "left as it was";
}

// ---- Memory refused -----------------------------------------------------------------------------

TEST(CudaError, MemoryRefused) {
  const scene::Mesh mesh = scene::soup(1000, 103);
  const Tree on_cpu = build(mesh.view());
  Machine machine;
  const Triangles triangles(machine, mesh);
  simulated::Tree tree = build(machine.executor(), mesh.view());
  const std::function<void()> calls[] = {
      [&] { (void)build(machine.executor(), mesh.view()); },
      [&] { (void)build(machine.executor(), triangles.view()); },
      [&] { rebuild(machine.executor(), tree, triangles.view()); },
      [&] { (void)analyse(machine.executor(), mesh.view(), {.references = References::all}); },
      [&] { (void)build(machine.executor(), mesh.view(), {.builder = Builder::wu2011}); },
      [&] { (void)simulated::to_device(machine.executor(), on_cpu, mesh.view()); }};
  for (const auto& call : calls) {
    machine.stream.synchronize();
    const std::size_t live = machine.memory.live_blocks();
    machine.memory.refuse_at = 0;
    machine.memory.forget();
    call();
    const std::size_t allocations = machine.memory.asked().size();
    ASSERT_GE(allocations, 1u);
    for (std::size_t refused = 1; refused <= allocations; ++refused) {
      machine.memory.forget();
      machine.memory.refuse_at = refused;
      const Caught error = caught(call);
      EXPECT_TRUE(error.thrown);
      EXPECT_EQ(error.code, ErrorCode::out_of_memory);
      EXPECT_EQ(error.offender, machine.memory.asked().back());
      EXPECT_EQ(machine.memory.asked().size(), refused) << "nothing after the refusal";
      machine.stream.synchronize();
      EXPECT_EQ(machine.memory.live_blocks(), live);
    }
    machine.memory.refuse_at = 0;
  }
  EXPECT_EQ(tree_hash(tree.to_host().view()), tree_hash(on_cpu.view()));
  EXPECT_FALSE(machine.memory.misused());
}

// A resource may throw what it likes, or return null.
TEST(CudaError, ResourcesThatFailInTheirOwnWay) {
  struct Stubborn final : cuda::MemoryResource {
    int how = 0;
    void* allocate(std::size_t, cuda::Stream) override {
      if (how == 0) throw 42;
      if (how == 1) throw std::runtime_error("no");
      return nullptr;
    }
    void deallocate(void*, std::size_t, cuda::Stream) noexcept override { how = -1; }
  } memory;
  const scene::Mesh mesh = scene::soup(10, 104);
  simulated::Executor executor;
  executor.memory = &memory;
  for (memory.how = 0; memory.how < 3; ++memory.how) {
    const Caught error = caught([&] { (void)build(executor, mesh.view()); });
    EXPECT_TRUE(error.thrown);
    EXPECT_EQ(error.code, ErrorCode::out_of_memory) << error.message;
  }
}

}  // namespace
}  // namespace zkd
