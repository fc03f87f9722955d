// SPDX-License-Identifier: Apache-2.0
//
// What only a real device can show of builds on it: nobody waits, memory is what was said, CUDA
// graphs replay a build, failures come back as the CPU's errors, and whatever memory and stream the
// triangles and builds are in, the tree is the same. Its logic without a device: cuda_plan_test.cpp
// and cuda_error_test.cpp.
#include <gtest/gtest.h>

#include <cuda_runtime_api.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <zkd/cuda/build.hpp>
#include <zkd/cuda/query.hpp>
#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/caught.hpp"
#include "support/frames.hpp"
#include "support/hits.hpp"
#include "support/meshes.hpp"
#include "support/platform_cuda.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using test::Array;
using test::Caught;
using test::caught;
using test::CountingMemory;
using test::print;
using test::require;
using test::same_bits;
using verify::tree_hash;
using Bytes = std::vector<std::size_t>;

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();

// One that does not wait for the default stream, nor is waited for.
class OwnStream {
 public:
  OwnStream() { require(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  ~OwnStream() { (void)cudaStreamDestroy(stream_); }
  OwnStream(const OwnStream&) = delete;
  OwnStream& operator=(const OwnStream&) = delete;

  [[nodiscard]] cuda::Stream get() const { return stream_; }
  void synchronize() const { require(cudaStreamSynchronize(stream_)); }

 private:
  cudaStream_t stream_ = nullptr;
};

// A mesh in device memory that may change.
class Triangles {
 public:
  explicit Triangles(const scene::Mesh& mesh)
      : positions_(std::span(mesh.positions)), faces_(std::span(mesh.faces)) {}

  [[nodiscard]] TriangleView view() const {
    return {std::span<const glm::vec3>(positions_), std::span<const glm::uvec3>(faces_)};
  }
  // As many positions and faces as before.
  void assign(const scene::Mesh& mesh) {
    positions_.assign(mesh.positions);
    faces_.assign(mesh.faces);
  }

 private:
  Array<glm::vec3> positions_;
  Array<glm::uvec3> faces_;
};

cuda::Executor with_workspace(cuda::Executor executor, Array<std::byte>& workspace) {
  const std::span<std::byte> bytes = workspace;
  executor.workspace = bytes.data();
  executor.workspace_bytes = bytes.size();
  return executor;
}

Tree on_cpu(const scene::Mesh& mesh, const BuildOptions& options = {}) {
  return build(cpu::Executor{.threads = 2}, mesh.view(), options);
}

std::string cpu_hash(const scene::Mesh& mesh, const BuildOptions& options = {}) {
  return tree_hash(on_cpu(mesh, options).view());
}

// ---- Memory -------------------------------------------------------------------------------------

TEST(CudaDevice, AllocatesWhatWasSaid) {
  const scene::Mesh mesh = scene::soup(20000, 1);
  const Triangles triangles(mesh);
  for (const References references : {References::once, References::all}) {
    const BuildOptions options{.references = references, .reference_capacity = 400000};
    CountingMemory memory;
    const OwnStream stream;
    const cuda::Executor executor{.stream = stream.get(), .memory = &memory};
    const MemoryRequirement need = memory_requirement(executor, 20000, options);
    EXPECT_EQ(memory.asked(), Bytes{});
    {
      const cuda::Tree tree = build(executor, triangles.view(), options);
      EXPECT_EQ(memory.asked(), (Bytes{need.tree_bytes, need.workspace_bytes}));
      EXPECT_EQ(memory.live_blocks(), 1u) << "the workspace was given back";
      EXPECT_EQ(tree.tree_bytes(), need.tree_bytes);
      EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(mesh, options));
    }
    EXPECT_EQ(memory.live_blocks(), 0u);

    memory.forget();
    Array<std::byte> workspace(need.workspace_bytes);
    const cuda::Executor given = with_workspace(executor, workspace);
    {
      cuda::Tree tree = build(given, triangles.view(), options);
      EXPECT_EQ(memory.asked(), Bytes{need.tree_bytes});
      memory.forget();
      rebuild(given, tree, triangles.view());
      closest_hit(given, tree.view(), tree.triangles(), {}, {});
      EXPECT_EQ(memory.asked(), Bytes{});
      EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(mesh, options));
    }
    stream.synchronize();
    EXPECT_EQ(memory.live_blocks(), 0u);
    EXPECT_FALSE(memory.misused());
  }
}

TEST(CudaDevice, MemoryRefused) {
  const scene::Mesh mesh = scene::soup(5000, 2);
  const OwnStream stream;
  for (const std::size_t refuse_at : {1u, 2u, 3u}) {
    CountingMemory memory;
    memory.refuse_at = refuse_at;  // of the tree, the copy of the triangles, the workspace
    const cuda::Executor executor{.stream = stream.get(), .memory = &memory};
    const Caught error = caught([&] { (void)build(executor, mesh.view()); });
    EXPECT_TRUE(error.thrown);
    EXPECT_EQ(error.code, ErrorCode::out_of_memory) << error.message;
    EXPECT_EQ(error.offender, memory.asked().back());
    EXPECT_EQ(memory.live_blocks(), 0u);
    memory.refuse_at = 0;
    EXPECT_EQ(tree_hash(build(executor, mesh.view()).to_host().view()), cpu_hash(mesh));
  }
}

// The largest scene of the paper's kind, as it is really allocated.
TEST(CudaDevice, PaperScenesFitIn1500Megabytes) {
  const scene::Mesh mesh = scene::soup(1100000, 3);
  CountingMemory memory;
  const OwnStream stream;
  const cuda::Executor executor{.stream = stream.get(), .memory = &memory};
  const cuda::Tree tree = build(executor, mesh.view());
  tree.check();
  std::size_t bytes = 0;
  for (const std::size_t block : memory.asked()) bytes += block;
  EXPECT_LT(bytes, 1500000000u) << "tree, copy of the triangles and workspace at once";
}

// ---- Nobody waits -------------------------------------------------------------------------------

// Keeps a stream from going on, as work of a program that comes before ours would.
class Gate {
 public:
  explicit Gate(const OwnStream& stream) : stream_(stream) {
    require(cudaLaunchHostFunc(stream.get(), wait, this));
  }
  ~Gate() {
    open();
    (void)cudaStreamSynchronize(stream_.get());
  }
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  void open() { open_ = true; }
  // Nobody opened it: whoever should have was waiting for the stream.
  [[nodiscard]] bool gave_up() const { return gave_up_; }

 private:
  static void CUDART_CB wait(void* self) {
    auto& gate = *static_cast<Gate*>(self);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (!gate.open_) {
      if (std::chrono::steady_clock::now() > end) {
        gate.gave_up_ = true;
        return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  const OwnStream& stream_;
  std::atomic<bool> open_{false};
  std::atomic<bool> gave_up_{false};
};

TEST(CudaDevice, BuildsAndRaysAreEnqueuedWithoutWaiting) {
  const scene::Mesh mesh = scene::sphere(5);
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 2000, 4);
  const Triangles triangles(mesh);
  const Array<Ray> uploaded = test::upload(rays);
  const Tree host = on_cpu(mesh);
  const std::vector<Hit> want = test::closest(host.view(), mesh.view(), rays);
  const OwnStream stream;
  CountingMemory memory;
  cuda::Executor executor{.stream = stream.get(), .memory = &memory};
  const MemoryRequirement need = memory_requirement(executor, mesh.faces.size());
  executor.workspace = memory.allocate(need.workspace_bytes, stream.get());
  executor.workspace_bytes = need.workspace_bytes;
  {
    Array<Hit> hits(rays.size());
    cuda::Tree tree;
    // Twice: the first build also loads kernels, which may wait.
    for (const bool gated : {false, true}) {
      memory.forget();
      std::optional<Gate> gate;
      if (gated) gate.emplace(stream);
      tree = build(executor, triangles.view());
      rebuild(executor, tree, triangles.view());
      closest_hit(executor, tree.view(), tree.triangles(), uploaded, hits);
      if (gated) {
        EXPECT_FALSE(gate->gave_up()) << "the host waited for the device";
        EXPECT_EQ(cudaStreamQuery(stream.get()), cudaErrorNotReady);
        (void)cudaGetLastError();  // which was no failure
        gate->open();
      }
      EXPECT_EQ(memory.asked(), Bytes{need.tree_bytes});
      stream.synchronize();
      const std::vector<Hit> got = hits.download();
      for (std::size_t i = 0; i < rays.size(); ++i)
        ASSERT_TRUE(same_bits(got[i], want[i])) << print(rays[i]);
    }
    EXPECT_EQ(tree_hash(tree.to_host().view()), tree_hash(host.view()));
  }
  memory.deallocate(executor.workspace, executor.workspace_bytes, stream.get());
  EXPECT_EQ(memory.live_blocks(), 0u);
  EXPECT_FALSE(memory.misused());
}

// ---- Graphs -------------------------------------------------------------------------------------

class Graph {
 public:
  template <class Work>
  Graph(const OwnStream& stream, const Work& work) {
    require(cudaStreamBeginCapture(stream.get(), cudaStreamCaptureModeThreadLocal));
    work();
    require(cudaStreamEndCapture(stream.get(), &graph_));
    require(cudaGraphInstantiate(&executable_, graph_, 0));
  }
  ~Graph() {
    (void)cudaGraphExecDestroy(executable_);
    (void)cudaGraphDestroy(graph_);
  }
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;

  void launch(const OwnStream& stream) const {
    require(cudaGraphLaunch(executable_, stream.get()));
  }

  [[nodiscard]] std::vector<cudaGraphNodeType> nodes() const {
    std::size_t count = 0;
    require(cudaGraphGetNodes(graph_, nullptr, &count));
    std::vector<cudaGraphNode_t> all(count);
    require(cudaGraphGetNodes(graph_, all.data(), &count));
    std::vector<cudaGraphNodeType> types(count);
    for (std::size_t i = 0; i < count; ++i) require(cudaGraphNodeGetType(all[i], &types[i]));
    return types;
  }

 private:
  cudaGraph_t graph_ = nullptr;
  cudaGraphExec_t executable_ = nullptr;
};

// A build and rays, captured once and replayed over each frame.
void expect_replays(const BuildOptions& options) {
  const std::vector<test::NamedMesh> scenes = test::frames();
  const std::vector<Ray> rays = scene::rays_at_features(scenes[0].mesh, 500, 82);
  const Array<Ray> uploaded = test::upload(rays);
  Array<Hit> hits(rays.size());
  Triangles triangles(scenes[0].mesh);
  CountingMemory memory;
  const OwnStream stream;
  cuda::Executor executor{.stream = stream.get(), .memory = &memory};
  Array<std::byte> workspace(memory_requirement(executor, 2000, options).workspace_bytes);
  executor = with_workspace(executor, workspace);
  // Launched once before the capture, so that kernels are loaded.
  cuda::Tree tree = build(executor, triangles.view(), options);
  closest_hit(executor, tree.view(), tree.triangles(), uploaded, hits);
  stream.synchronize();
  memory.forget();
  const Graph graph(stream, [&] {
    rebuild(executor, tree, triangles.view());
    closest_hit(executor, tree.view(), tree.triangles(), uploaded, hits);
  });
  EXPECT_EQ(memory.asked(), Bytes{});
  EXPECT_FALSE(graph.nodes().empty());
  for (const cudaGraphNodeType type : graph.nodes())
    EXPECT_TRUE(type == cudaGraphNodeTypeKernel || type == cudaGraphNodeTypeMemset ||
                type == cudaGraphNodeTypeMemcpy)
        << "a replay involves the host, or allocates: type " << type;

  for (int round = 0; round < 2; ++round) {
    for (const test::NamedMesh& frame : scenes) {
      SCOPED_TRACE(frame.name + ", " + to_string(options.references));
      triangles.assign(frame.mesh);
      graph.launch(stream);
      stream.synchronize();
      std::string want;
      std::string failure;
      std::vector<Hit> want_hits(rays.size());
      try {
        const Tree host = on_cpu(frame.mesh, options);
        if (options.references == References::all &&
            host.view().reference_count() > options.reference_capacity) {
          failure = "needs " + std::to_string(host.view().reference_count());
        } else {
          want = tree_hash(host.view());
          want_hits = test::closest(host.view(), frame.mesh.view(), rays);
        }
      } catch (const Error& error) {
        failure = error.what();
      }
      const Caught got = caught([&] {
        tree.check();
        EXPECT_EQ(tree_hash(tree.to_host().view()), want);
      });
      EXPECT_EQ(got.thrown, failure != "") << got.message << failure;
      EXPECT_NE(got.message.find(failure), std::string::npos) << got.message;
      const std::vector<Hit> got_hits = hits.download();
      for (std::size_t i = 0; i < rays.size(); ++i)
        ASSERT_TRUE(same_bits(got_hits[i], want_hits[i])) << print(rays[i]);
    }
  }
}

TEST(CudaDevice, AGraphReplaysABuild) {
  for (const auto invalid : {InvalidTriangles::error, InvalidTriangles::skip})
    for (const bool recode : {true, false})
      expect_replays({.recode_crowded = recode, .invalid_triangles = invalid});
  expect_replays({.code_bits = 64});
  expect_replays({.references = References::all, .reference_capacity = 15000});
}

TEST(CudaDevice, AGraphReadsHostMemoryAtEachReplay) {
  const scene::Mesh first = scene::soup(500, 83);
  const scene::Mesh second = scene::soup(500, 84);
  scene::Mesh mesh = first;
  const OwnStream stream;
  cuda::Executor executor{.stream = stream.get()};
  Array<std::byte> workspace(memory_requirement(executor, 500).workspace_bytes);
  executor = with_workspace(executor, workspace);
  cuda::Tree tree = build(executor, mesh.view());
  stream.synchronize();
  const Graph graph(stream, [&] { rebuild(executor, tree, mesh.view()); });
  for (const scene::Mesh* now : {&second, &first}) {
    std::copy(now->positions.begin(), now->positions.end(), mesh.positions.begin());
    graph.launch(stream);
    EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(*now));
  }
}

TEST(CudaDevice, AGraphMayRunOnAnotherStream) {
  const scene::Mesh first = scene::soup(2000, 85);
  scene::Mesh second = scene::soup(2000, 86);
  Triangles triangles(first);
  const OwnStream built_on;
  const OwnStream replayed_on;
  cuda::Executor executor{.stream = built_on.get()};
  Array<std::byte> workspace(memory_requirement(executor, 2000).workspace_bytes);
  executor = with_workspace(executor, workspace);
  cuda::Tree tree = build(executor, triangles.view());
  built_on.synchronize();
  const Graph graph(built_on, [&] { rebuild(executor, tree, triangles.view()); });
  triangles.assign(second);
  graph.launch(replayed_on);
  EXPECT_NO_THROW(tree.check(replayed_on.get()));
  EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(second));
  second.positions[3].x = nan_value;
  triangles.assign(second);
  graph.launch(replayed_on);
  EXPECT_EQ(caught([&] { tree.check(replayed_on.get()); }).code, ErrorCode::non_finite_vertex);
}

// ---- Failures -----------------------------------------------------------------------------------

// Everything that asks the tree throws `want`; rays miss; and the tree can be built again.
void expect_failure(const scene::Mesh& mesh, const BuildOptions& options, const Caught& want) {
  const OwnStream stream;
  const cuda::Executor executor{.stream = stream.get()};
  const Triangles on_device(mesh);
  const scene::Mesh good = scene::soup(static_cast<std::uint32_t>(mesh.faces.size()) / 2, 87);
  const Triangles good_on_device(good);
  const std::vector<Ray> rays = scene::random_rays({}, 200, 88);
  const Array<Ray> uploaded = test::upload(rays);
  for (const TriangleView& triangles : {on_device.view(), mesh.view()}) {
    cuda::Tree tree;
    const auto expect = [&](const Caught& got) {
      EXPECT_TRUE(got.thrown);
      EXPECT_EQ(got.code, want.code);
      EXPECT_EQ(got.offender, want.offender);
      EXPECT_EQ(got.message, want.message);
    };
    EXPECT_FALSE(caught([&] { tree = build(executor, triangles, options); }).thrown)
        << "the host does not wait for it";
    Array<Hit> hits(rays.size(), Hit{1.0F, 0.0F, 0.0F, 0});
    closest_hit(executor, tree.view(), tree.triangles(), uploaded, hits);
    expect(caught([&] { tree.check(); }));
    expect(caught([&] { tree.check(); }));
    expect(caught([&] { (void)tree.to_host(); }));
    expect(caught([&] { (void)tree.statistics(); }));
    expect(caught([&] { (void)tree.lattice(); }));
    for (const Hit& hit : hits.download()) EXPECT_TRUE(same_bits(hit, Hit{}));

    rebuild(executor, tree, good_on_device.view());
    EXPECT_EQ(tree_hash(tree.to_host().view()), cpu_hash(good, options));
  }
  EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess) << "nothing was read where nothing is";
}

Caught cpu_error(const scene::Mesh& mesh, const BuildOptions& options) {
  const Caught error = caught([&] { (void)on_cpu(mesh, options); });
  EXPECT_TRUE(error.thrown);
  return error;
}

TEST(CudaDevice, IndexOutOfRange) {
  for (const References references : {References::once, References::all}) {
    for (const std::uint32_t bad : {9000u, 9001u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
      scene::Mesh mesh = scene::soup(3000, 89);
      mesh.faces[2999].x = bad;
      mesh.faces[1234].z = bad;
      mesh.positions[30].x = nan_value;
      const BuildOptions options{.references = references, .reference_capacity = 60000};
      const Caught want = cpu_error(mesh, options);
      EXPECT_EQ(want.code, ErrorCode::index_out_of_range);
      EXPECT_EQ(want.offender, 1234u);
      expect_failure(mesh, options, want);
    }
  }
}

TEST(CudaDevice, NonFiniteVertex) {
  for (const References references : {References::once, References::all}) {
    for (const float bad : {nan_value, std::numeric_limits<float>::infinity()}) {
      scene::Mesh mesh = scene::soup(3000, 90);
      mesh.positions[3 * 777 + 1].z = bad;
      mesh.positions[8999].x = bad;
      const BuildOptions options{.references = references, .reference_capacity = 60000};
      const Caught want = cpu_error(mesh, options);
      EXPECT_EQ(want.code, ErrorCode::non_finite_vertex);
      EXPECT_EQ(want.offender, 777u);
      expect_failure(mesh, options, want);
    }
  }
}

TEST(CudaDevice, ReferenceCapacity) {
  const scene::Mesh mesh = scene::needles(1000, 91);
  const Triangles triangles(mesh);
  BuildOptions options{.references = References::all, .reference_capacity = 0};
  const Tree host = on_cpu(mesh, options);
  const std::uint64_t needed = host.view().reference_count();
  ASSERT_GT(needed, 2000u);
  EXPECT_EQ(analyse(cuda::Executor{}, triangles.view(), options).reference_capacity, needed);
  for (const std::uint64_t capacity : {needed - 1, needed / 2, std::uint64_t{1}}) {
    options.reference_capacity = capacity;
    const cuda::Tree tree = build(cuda::Executor{}, triangles.view(), options);
    const Caught error = caught([&] { tree.check(); });
    ASSERT_TRUE(error.thrown);
    EXPECT_EQ(error.code, ErrorCode::reference_capacity);
    EXPECT_EQ(error.offender, needed);
    EXPECT_NE(error.message.find(std::to_string(capacity)), std::string::npos) << error.message;
  }
  options.reference_capacity = needed;
  const cuda::Tree tree = build(cuda::Executor{}, triangles.view(), options);
  EXPECT_EQ(tree_hash(tree.to_host().view()), tree_hash(host.view()));
}

// ---- What a tree knows --------------------------------------------------------------------------

TEST(CudaDevice, StatisticsAndLatticeWithoutACopyOfTheTree) {
  const scene::Mesh mesh = scene::small_in_large(5000, 1e6F, 92);
  const Tree host = on_cpu(mesh);
  cuda::StageTimer timer;
  const cuda::Tree tree = build(cuda::Executor{.timer = &timer}, mesh.view());
  const Statistics got = tree.statistics();
  const Statistics& want = host.statistics();
  EXPECT_EQ(got.triangles, want.triangles);
  EXPECT_EQ(got.code_bits, want.code_bits);
  EXPECT_GT(got.crowded_trunks, 0u);
  EXPECT_EQ(got.crowded_trunks, want.crowded_trunks);
  EXPECT_EQ(got.crowded_triangles, want.crowded_triangles);
  EXPECT_EQ(got.nodes, want.nodes);
  EXPECT_EQ(got.leaves, want.leaves);
  EXPECT_EQ(got.references, want.references);
  EXPECT_EQ(got.workspace_bytes,
            memory_requirement(cuda::Executor{}, mesh.faces.size()).workspace_bytes);
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(tree.lattice().exponent[a], host.lattice().exponent[a]);
    EXPECT_EQ(tree.lattice().origin[a], host.lattice().origin[a]);
    EXPECT_EQ(tree.lattice().bits[a], host.lattice().bits[a]);
  }
  double total = 0.0;
  for (const double ms : timer.stage_ms()) {
    EXPECT_GE(ms, 0.0);
    total += ms;
  }
  EXPECT_GT(total, 0.0);
  EXPECT_LT(total, 10000.0);
}

// ---- Where things lie and run -------------------------------------------------------------------

TEST(CudaDevice, TrianglesInEveryKindOfMemory) {
  const scene::Mesh mesh = scene::sphere(4);
  const std::size_t bytes = std::span(mesh.positions).size_bytes();
  const std::string want = cpu_hash(mesh);
  const Triangles on_device(mesh);
  void* pinned = nullptr;
  void* managed = nullptr;
  require(cudaMallocHost(&pinned, bytes));
  require(cudaMallocManaged(&managed, bytes));
  std::memcpy(pinned, mesh.positions.data(), bytes);
  std::memcpy(managed, mesh.positions.data(), bytes);
  for (const void* positions :
       {static_cast<const void*>(mesh.positions.data()),
        static_cast<const void*>(on_device.view().positions), static_cast<const void*>(pinned),
        static_cast<const void*>(managed)}) {
    for (const std::uint32_t* indices : {mesh.view().indices, on_device.view().indices}) {
      TriangleView view = mesh.view();
      view.positions = static_cast<const float*>(positions);
      view.indices = indices;
      EXPECT_EQ(tree_hash(build(cuda::Executor{}, view).to_host().view()), want);
    }
  }
  require(cudaFreeHost(pinned));
  require(cudaFree(managed));
}

TEST(CudaDevice, BuildsOnSeveralStreamsAndThreadsAtOnce) {
  const scene::Mesh mesh = scene::soup(30000, 93);
  const Triangles triangles(mesh);
  const BuildOptions options{.references = References::all, .reference_capacity = 400000};
  const std::string once = cpu_hash(mesh);
  const std::string all = cpu_hash(mesh, options);
  std::vector<std::string> failures(4);
  std::vector<std::thread> builders;
  for (std::size_t t = 0; t < failures.size(); ++t) {
    builders.emplace_back([&, t] {
      try {
        const OwnStream stream;
        const cuda::Executor executor{.stream = stream.get()};
        for (int again = 0; again < 10; ++again) {
          const cuda::Tree first = build(executor, triangles.view());
          const cuda::Tree second = build(executor, triangles.view(), options);
          if (tree_hash(first.to_host().view()) != once) failures[t] = "another tree, once";
          if (tree_hash(second.to_host().view()) != all) failures[t] = "another tree, all";
        }
      } catch (const std::exception& error) {
        failures[t] = error.what();
      }
    });
  }
  for (std::thread& builder : builders) builder.join();
  for (const std::string& failure : failures) EXPECT_EQ(failure, "");
}

TEST(CudaDevice, BuildsThatNameNoExecutorComeHere) {
  const scene::Mesh mesh = scene::soup(1000, 94);
  for (const Backend backend : {Backend::cuda, Backend::automatic}) {
    for (const References references : {References::once, References::all}) {
      const Tree tree = build(mesh.view(), {.backend = backend, .references = references});
      EXPECT_EQ(tree.options().backend, Backend::cuda);
      EXPECT_GT(tree.statistics().total_ms, 0.0);
      EXPECT_EQ(tree_hash(tree.view()), cpu_hash(mesh, {.references = references}));
    }
  }
  EXPECT_EQ(build(mesh.view(), {.backend = Backend::cpu}).options().backend, Backend::cpu);
}

// ---- Rays ---------------------------------------------------------------------------------------

TEST(CudaDevice, ExactIsOfTheHostOnly) {
  const test::Caught error = test::caught([] {
    closest_hit(cuda::Executor{}, TreeView{}, TriangleView{}, std::span<const Ray>(),
                std::span<Hit>(), {}, Intersector::exact);
  });
  EXPECT_TRUE(error.thrown);
  EXPECT_EQ(error.code, ErrorCode::unsupported_option);
}

TEST(CudaDevice, ShorterSpansEndTheWork) {
  const scene::Mesh mesh = scene::sphere(2);
  const cuda::Tree tree = build(cuda::Executor{}, mesh.view());
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 100, 95);
  const Tree host = tree.to_host();
  const std::vector<Hit> want = test::closest(host.view(), mesh.view(), rays);
  const Array<Ray> uploaded = test::upload(rays);
  const Hit untouched{-1, -2, -3, 12345};
  for (const std::size_t length : {0u, 1u, 37u, 100u}) {
    Array<Hit> hits(100, untouched);
    Array<Hit> loop(100, untouched);
    Array<Hit> with_costs(100, untouched);
    Array<std::uint8_t> occluded(100, 9);
    Array<TraversalCost> costs(std::max<std::size_t>(length, 1));
    const cuda::Executor executor;
    closest_hit(executor, tree.view(), tree.triangles(), uploaded,
                std::span<Hit>(hits).first(length));
    closest_hit_brute_force(executor, tree.view(), tree.triangles(), uploaded,
                            std::span<Hit>(loop).first(length));
    any_hit(executor, tree.view(), tree.triangles(), uploaded,
            std::span<std::uint8_t>(occluded).first(length));
    closest_hit(executor, tree.view(), tree.triangles(), uploaded, with_costs, costs);
    for (std::size_t i = 0; i < 100; ++i) {
      const bool written = i < length;
      EXPECT_TRUE(same_bits(hits.download()[i], written ? want[i] : untouched));
      EXPECT_TRUE(same_bits(loop.download()[i], written ? want[i] : untouched));
      EXPECT_EQ(occluded.download()[i], written ? (test::is_hit(want[i]) ? 1 : 0) : 9);
      EXPECT_TRUE(same_bits(with_costs.download()[i],
                            i < std::max<std::size_t>(length, 1) ? want[i] : untouched));
    }
  }
}

}  // namespace
}  // namespace zkd
