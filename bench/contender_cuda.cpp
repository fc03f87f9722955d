// SPDX-License-Identifier: Apache-2.0
//
// zkd on a CUDA device under the device's clock: triangles in device memory as raw float3 and
// 32-bit indices, and from there to a tree that can be traced.
#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include <zkd/cuda/build.hpp>
#include <zkd/cuda/query.hpp>
#include <zkd/error.hpp>

#include "cuda.hpp"
#include "cuda_resources.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::bench {
namespace {

// Device memory for a build, counted. It is not timed, so plain cudaMalloc does; cudaFree waits for
// whatever still uses the block.
class CountingDeviceMemory final : public cuda::MemoryResource {
 public:
  [[nodiscard]] std::uint64_t held() const { return held_; }  ///< bytes now
  [[nodiscard]] std::uint64_t peak() const { return peak_; }  ///< most bytes at once

  void* allocate(std::size_t bytes, cuda::Stream) override {
    void* block = nullptr;
    check_cuda(cudaMalloc(&block, bytes), "cudaMalloc");
    held_ += bytes;
    peak_ = std::max(peak_, held_);
    return block;
  }
  void deallocate(void* block, std::size_t bytes, cuda::Stream) noexcept override {
    held_ -= bytes;
    (void)cudaFree(block);
  }

 private:
  std::uint64_t held_ = 0;
  std::uint64_t peak_ = 0;
};

// The triangles of a scene in device memory, and the stream that everything is enqueued on.
class DeviceMesh {
 public:
  explicit DeviceMesh(const TriangleView& host) : host_(host) {
    positions_.reserve(3 * host.position_count);
    indices_.reserve(3 * host.triangle_count);
    copy_from(host.positions, host.indices);
    stream_.wait();
  }

  [[nodiscard]] const CudaStream& stream() const { return stream_; }
  [[nodiscard]] const TriangleView& host() const { return host_; }

  [[nodiscard]] TriangleView device() const {
    TriangleView view = host_;
    view.positions = positions_.data();
    view.indices = indices_.data();
    return view;
  }

  [[nodiscard]] std::size_t position_bytes() const { return positions_.bytes(); }
  [[nodiscard]] std::size_t index_bytes() const { return indices_.bytes(); }

  // Enqueues both copies.
  void copy_from(const float* positions, const std::uint32_t* indices) const {
    check_cuda(cudaMemcpyAsync(positions_.data(), positions, positions_.bytes(),
                               cudaMemcpyHostToDevice, stream_.get()),
               "cudaMemcpyAsync");
    check_cuda(cudaMemcpyAsync(indices_.data(), indices, indices_.bytes(), cudaMemcpyHostToDevice,
                               stream_.get()),
               "cudaMemcpyAsync");
  }

 private:
  CudaStream stream_;
  TriangleView host_;
  CudaArray<float> positions_;
  CudaArray<std::uint32_t> indices_;
};

class CudaContender final : public ZkdContender {
 public:
  CudaContender(std::shared_ptr<const DeviceMesh> mesh, const BuildOptions& options,
                Intersector intersector)
      : mesh_(std::move(mesh)),
        options_(options),
        intersector_(intersector),
        clock_(mesh_->stream()) {}

  // Finds the capacity of `all`, builds for the first time, and looks at what was built.
  void describe(Result& result) override {
    Gpu gpu;
    if (options_.references == References::all && options_.reference_capacity == 0) {
      const Stopwatch watch;
      options_ = analyse(executor(), triangles(), options_);
      gpu.analyse_ms = watch.ms();
    }
    if (is_planned()) {
      const MemoryRequirement asked =
          memory_requirement(executor(), triangles().triangle_count, options_);
      result.allocated.asked_beforehand = asked.tree_bytes + asked.workspace_bytes;
      workspace_.reserve(asked.workspace_bytes);
    }
    measure_memory(result.allocated);

    tree_ = zkd::build(executor_with_workspace(), triangles(), options_);
    tree_.check();

    const std::string hash = verify::tree_hash(tree().view());
    gpu.hash_equal = hash == result.tree_hash;
    result.tree_hash = hash;
    const Statistics of_cpu = std::exchange(result.statistics, tree_.statistics());
    result.statistics.depth =
        of_cpu.depth;  // the CPU alone measures quality; same bytes, same value
    result.statistics.largest_leaf = of_cpu.largest_leaf;
    result.statistics.sah_cost = of_cpu.sah_cost;
    result.options = tree_.options();
    result.options.code_bits = result.statistics.code_bits;
    result.gpu = gpu;
  }

  // rebuild() with the caller's workspace, from an idle stream. One goes ahead unseen: between
  // repetitions the device does nothing for a while, and clocks and caches need a moment. A builder
  // that makes room as it goes builds anew, from the default pool, and waits on the way.
  double build() override {
    host_tree_ = Tree();
    rebuild_into(executor_with_workspace());
    const double ms = clock_.time([&] { rebuild_into(executor_with_workspace()); });
    tree_.check();
    return ms;
  }

  Samples stage_ms() override {
    if (!timer_) timer_.emplace();
    cuda::Executor timed = executor_with_workspace();
    timed.timer = &*timer_;
    rebuild_into(timed);
    const auto stages = timer_->stage_ms();
    return {stages.begin(), stages.end()};
  }

  Timing trace(std::size_t, RayKind kind, std::span<const Ray> rays) override {
    Timing timing;
    if (kind == RayKind::shadow) {
      std::vector<std::uint8_t> occluded(rays.size());
      timing.ms = any_hit(rays, occluded, {});
      timing.hits = count_hits(occluded);
    } else {
      std::vector<Hit> hits(rays.size());
      timing.ms = closest_hit(rays, hits, {});
      timing.hits = count_hits(hits);
    }
    return timing;
  }

  // Rays to the device, answers back; the milliseconds are those between.
  double closest_hit(std::span<const Ray> rays, std::span<Hit> hits,
                     std::span<TraversalCost> costs) override {
    if (rays.empty()) return 0.0;
    hits_.reserve(rays.size());
    const std::span<const Ray> on_device = upload(rays);
    const std::span<TraversalCost> counted = room_for(costs);
    const double ms = clock_.time([&] {
      zkd::closest_hit(executor(), tree_.view(), tree_.triangles(), on_device,
                       hits_.first(rays.size()), counted, intersector_);
    });
    download(hits, hits_.data());
    download(costs, costs_.data());
    return ms;
  }

  double any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                 std::span<TraversalCost> costs) override {
    if (rays.empty()) return 0.0;
    occluded_.reserve(rays.size());
    const std::span<const Ray> on_device = upload(rays);
    const std::span<TraversalCost> counted = room_for(costs);
    const double ms = clock_.time([&] {
      zkd::any_hit(executor(), tree_.view(), tree_.triangles(), on_device,
                   occluded_.first(rays.size()), counted, intersector_);
    });
    download(occluded, occluded_.data());
    download(costs, costs_.data());
    return ms;
  }

  const Tree& tree() override {
    if (host_tree_.view().empty()) host_tree_ = tree_.to_host();
    return host_tree_;
  }

  void clear() override { host_tree_ = Tree(); }

  void measure_more(Result& result, unsigned repeat) override {
    Gpu& gpu = *result.gpu;
    if (is_planned()) measure_graph(gpu, result.tree_hash, repeat);
    measure_calls(gpu, repeat);
    measure_copies(gpu, repeat);
  }

 private:
  [[nodiscard]] cuda::Executor executor() const {
    cuda::Executor executor;
    executor.stream = mesh_->stream().get();
    return executor;
  }
  [[nodiscard]] cuda::Executor executor_with_workspace() const {
    cuda::Executor with = executor();
    with.workspace = workspace_.data();
    with.workspace_bytes = workspace_.bytes();
    return with;
  }
  [[nodiscard]] TriangleView triangles() const { return mesh_->device(); }

  // Whether all memory is known beforehand, so that a tree can be built again in its own.
  [[nodiscard]] bool is_planned() const { return options_.builder == Builder::morton; }

  void rebuild_into(const cuda::Executor& with) {
    if (is_planned())
      rebuild(with, tree_, triangles());
    else
      tree_ = zkd::build(with, triangles(), options_);
  }

  void measure_memory(AllocatedBytes& bytes) const {
    CountingDeviceMemory memory;
    cuda::Executor counted = executor();
    counted.memory = &memory;
    const cuda::Tree tree = zkd::build(counted, triangles(), options_);
    tree.check();
    bytes.tree = memory.held();
    bytes.workspace = memory.peak() - memory.held();
  }

  // Overwrites what the tree holds, so that a replay that writes nothing is seen.
  void overwrite_tree() {
    const TreeView& on_device = tree_.view();
    const TreeView& on_host = tree().view();
    const auto overwrite = [&](const void* array, std::size_t bytes) {
      if (bytes == 0) return;
      check_cuda(cudaMemsetAsync(const_cast<void*>(array), 0xA5, bytes, mesh_->stream().get()),
                 "cudaMemsetAsync");
    };
    overwrite(on_device.nodes, on_host.node_count() * sizeof(Node));
    overwrite(on_device.leaf_offsets, (on_host.leaf_count() + 1) * sizeof(std::uint32_t));
    overwrite(on_device.references, on_host.reference_count() * sizeof(std::uint32_t));
  }

  void measure_graph(Gpu& gpu, const std::string& hash, unsigned repeat) {
    const CudaStream& stream = mesh_->stream();
    const CudaGraph graph(stream, [&] { rebuild_into(executor_with_workspace()); });
    gpu.graph_nodes = graph.nodes();

    if (!tree().view().empty()) overwrite_tree();
    graph.launch(stream);
    tree_.check();
    host_tree_ = Tree();
    gpu.hash_equal = gpu.hash_equal && verify::tree_hash(tree().view()) == hash;
    host_tree_ = Tree();

    constexpr unsigned least = 20;  // a replay is short: more of them cost nothing
    const unsigned count = std::max(repeat, least);
    Samples samples;
    for (unsigned i = 0; i < count; ++i) {
      samples.push_back(clock_.time([&] { graph.launch(stream); }));
    }
    gpu.graph_replay_ms = spread_of(std::move(samples));
    gpu.graph_replay_chained_ms = clock_.time([&] {
      for (unsigned i = 0; i < count; ++i) graph.launch(stream);
    }) / count;
    tree_.check();
  }

  // The host's side of a rebuild, and a build that allocates.
  void measure_calls(Gpu& gpu, unsigned repeat) {
    Samples submit;
    for (unsigned i = 0; i < repeat; ++i) {
      mesh_->stream().wait();
      const Stopwatch watch;
      rebuild_into(executor_with_workspace());
      submit.push_back(watch.ms());
    }
    tree_.check();
    gpu.submit_ms = spread_of(std::move(submit));

    Samples allocating;
    for (unsigned i = 0; i <= repeat; ++i) {
      cuda::Tree tree;
      const double ms = clock_.time([&] { tree = zkd::build(executor(), triangles(), options_); });
      tree.check();
      if (i > 0) allocating.push_back(ms);
    }
    gpu.build_allocating_ms = spread_of(std::move(allocating));
  }

  void measure_copies(Gpu& gpu, unsigned repeat) {
    const TriangleView& host = mesh_->host();
    CudaArray<std::byte, true> positions;
    CudaArray<std::byte, true> indices;
    positions.reserve(mesh_->position_bytes());
    indices.reserve(mesh_->index_bytes());
    std::memcpy(positions.data(), host.positions, positions.bytes());
    std::memcpy(indices.data(), host.indices, indices.bytes());
    Samples pinned;
    Samples pageable;
    Samples back;
    for (unsigned i = 0; i <= repeat; ++i) {
      const double pinned_ms = clock_.time([&] {
        mesh_->copy_from(reinterpret_cast<const float*>(positions.data()),
                         reinterpret_cast<const std::uint32_t*>(indices.data()));
      });
      mesh_->stream().wait();
      const Stopwatch pageable_watch;
      mesh_->copy_from(host.positions, host.indices);
      mesh_->stream().wait();
      const double pageable_ms = pageable_watch.ms();
      const Stopwatch back_watch;
      const Tree copy = tree_.to_host();
      const double back_ms = back_watch.ms();
      if (i == 0) continue;
      pinned.push_back(pinned_ms);
      pageable.push_back(pageable_ms);
      back.push_back(back_ms);
    }
    gpu.h2d_ms = spread_of(std::move(pinned));
    gpu.h2d_pageable_ms = spread_of(std::move(pageable));
    gpu.d2h_ms = spread_of(std::move(back));
  }

  std::span<const Ray> upload(std::span<const Ray> rays) {
    rays_.reserve(rays.size());
    check_cuda(cudaMemcpyAsync(rays_.data(), rays.data(), rays.size_bytes(), cudaMemcpyHostToDevice,
                               mesh_->stream().get()),
               "cudaMemcpyAsync");
    return rays_.first(rays.size());
  }

  std::span<TraversalCost> room_for(std::span<TraversalCost> costs) {
    costs_.reserve(costs.size());
    return costs_.first(costs.size());
  }

  template <class T>
  void download(std::span<T> to, const T* from) {
    if (to.empty()) return;
    check_cuda(cudaMemcpyAsync(to.data(), from, to.size_bytes(), cudaMemcpyDeviceToHost,
                               mesh_->stream().get()),
               "cudaMemcpyAsync");
    mesh_->stream().wait();
  }

  std::shared_ptr<const DeviceMesh> mesh_;  // before the tree, which gives back on its stream
  BuildOptions options_;
  Intersector intersector_;
  CudaClock clock_;
  CudaArray<std::byte> workspace_;
  cuda::Tree tree_;
  Tree host_tree_;
  std::optional<cuda::StageTimer> timer_;
  CudaArray<Ray> rays_;
  CudaArray<Hit> hits_;
  CudaArray<std::uint8_t> occluded_;
  CudaArray<TraversalCost> costs_;
};

}  // namespace

std::vector<std::unique_ptr<ZkdContender>> cuda_contenders(const TriangleView& triangles,
                                                           std::span<const BuildOptions> settings,
                                                           Intersector intersector) {
  const auto mesh = std::make_shared<const DeviceMesh>(triangles);
  std::vector<std::unique_ptr<ZkdContender>> contenders;
  for (const BuildOptions& options : settings) {
    contenders.push_back(std::make_unique<CudaContender>(mesh, options, intersector));
  }
  return contenders;
}

ColdBuild time_cold_build(const TriangleView& triangles, const BuildOptions& options) {
  ColdBuild cold;
  const Stopwatch context;
  check_cuda(cudaFree(nullptr), "cudaFree");
  cold.context_ms = context.ms();

  const DeviceMesh mesh(triangles);
  cuda::Executor executor;
  executor.stream = mesh.stream().get();
  const Stopwatch build;
  const cuda::Tree tree = zkd::build(executor, mesh.device(), options);
  mesh.stream().wait();
  cold.build_ms = build.ms();
  tree.check();
  return cold;
}

}  // namespace zkd::bench
