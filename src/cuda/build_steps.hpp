// SPDX-License-Identifier: Apache-2.0
//
// A build on a device, from the triangles to the owner of the tree: plan, memory, passes. Host code
// over a Device (cuda/backend.hpp), which besides enqueuing passes says
//
//   stream(), number(), memory()   where, and whose memory
//   is_host_memory(pointer)        whether the device cannot be sent there
//   copy_to_device(to, from, bytes)    enqueues
//   copy_to_host(to, from, bytes)      waits
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include <zkd/build.hpp>
#include <zkd/cuda/tree.hpp>
#include <zkd/error.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>

#include "core/check_input.hpp"
#include "core/outcome.hpp"
#include "core/pipeline.hpp"
#include "core/wu2011/builder.hpp"
#include "cuda/backend.hpp"
#include "cuda/memory.hpp"

namespace zkd::cuda {

/// The members of a Tree, for those who make one.
struct TreeAccess {
  Tree& tree;

  TreeView& view() { return tree.view_; }
  TriangleView& triangles() { return tree.triangles_; }
  BuildOptions& options() { return tree.options_; }
  std::uint64_t& triangle_capacity() { return tree.triangle_capacity_; }
  std::size_t& workspace_bytes() { return tree.workspace_bytes_; }
  bool& incomplete() { return tree.incomplete_; }
  core::BuildState*& record() { return tree.record_; }

  /// The tree owns these from now on.
  template <class Device>
  void own(const Device& device, DeviceBlock& block, DeviceBlock& triangles) {
    tree.memory_ = &device.memory();
    tree.stream_ = device.stream();
    tree.device_ = device.number();
    tree.block_.bytes = block.bytes();
    tree.block_.data = block.release();
    tree.triangle_block_.bytes = triangles.bytes();
    tree.triangle_block_.data = triangles.release();
  }
  [[nodiscard]] Stream stream() const { return tree.stream_; }
  [[nodiscard]] void* block() const { return tree.block_.data; }
  [[nodiscard]] void* triangle_block() const { return tree.triangle_block_.data; }
};

inline Capacity capacity_for(std::uint64_t triangles, const BuildOptions& options) {
  const std::uint64_t most = core::most_elements(options, static_cast<std::uint32_t>(triangles));
  if (options.references != References::all) return {most, most};
  const std::uint64_t references = options.reference_capacity;
  return {references, core::most_reference_trunks(references, most)};
}

/// What the passes left in the tree's block.
struct BuiltTree {
  TreeView view;
  core::BuildState* record;  ///< a copy of what the build found, which outlives the workspace
  std::uint32_t passes;
};

template <class Code, class Device, class Memory>
BuiltTree run_passes(Device& device, Memory& memory, const TriangleView& triangles,
                     const BuildOptions& options, Capacity capacity) {
  Backend<Device, Memory> backend(device, memory, capacity);
  Array<core::BuildState> record;
  memory.take_for_tree(record, std::size_t{1});
  core::MortonPipeline<Code, Backend<Device, Memory>> pipeline(backend, triangles, options);
  pipeline.run();
  backend.for_each(core::one, core::CopyTo<core::BuildState>{pipeline.state(), record.data});
  backend.stage(Stage::count);
  return {{backend.header(), backend.nodes(), backend.leaf_offsets(), backend.references()},
          record.data,
          backend.passes()};
}

template <class Device>
BuiltTree run_passes(Device& device, PlannedMemory& memory, const TriangleView& triangles,
                     const BuildOptions& options, Capacity capacity) {
  return core::needs_wide_codes(options, triangles.triangle_count)
             ? run_passes<std::uint64_t>(device, memory, triangles, options, capacity)
             : run_passes<std::uint32_t>(device, memory, triangles, options, capacity);
}

/// The same passes, counted.
template <class Device>
Plan plan_build(Device& device, const TriangleView& triangles, const BuildOptions& options,
                Capacity capacity) {
  PlannedMemory memory;
  return memory.plan(run_passes(device, memory, triangles, options, capacity).passes);
}

/// Room for the triangles of a view that lie in host memory.
struct TriangleCopy {
  char* positions = nullptr;
  std::uint32_t* indices = nullptr;

  void lay_out(core::Arena& arena, std::size_t position_bytes, std::size_t index_count) {
    positions = arena.take<char>(position_bytes);
    indices = arena.take<std::uint32_t>(index_count);
  }
};

template <class Device>
class TriangleUpload {
 public:
  TriangleUpload(Device& device, const TriangleView& triangles)
      : device_(device), triangles_(triangles) {
    if (triangles.positions != nullptr && triangles.position_count > 0 &&
        device.is_host_memory(triangles.positions))
      // Nothing is read behind the last position, which need not be followed by a whole stride.
      position_bytes_ =
          (triangles.position_count - 1) * triangles.position_stride + 3 * sizeof(float);
    if (triangles.indices != nullptr && triangles.triangle_count > 0 &&
        device.is_host_memory(triangles.indices))
      index_count_ = 3 * triangles.triangle_count;
  }

  [[nodiscard]] std::size_t bytes() const {
    return core::bytes_of(TriangleCopy{}, position_bytes_, index_count_);
  }

  /// The view as the device may read it, with what had to be copied in `block`.
  TriangleView enqueue(void* block) {
    TriangleView view = triangles_;
    core::Arena arena(block);
    TriangleCopy copy;
    copy.lay_out(arena, position_bytes_, index_count_);
    if (position_bytes_ != 0) {
      device_.copy_to_device(copy.positions, triangles_.positions, position_bytes_);
      view.positions = reinterpret_cast<const float*>(copy.positions);
    }
    if (index_count_ != 0) {
      device_.copy_to_device(copy.indices, triangles_.indices,
                             index_count_ * sizeof(std::uint32_t));
      view.indices = copy.indices;
    }
    return view;
  }

 private:
  Device& device_;
  const TriangleView& triangles_;
  std::size_t position_bytes_ = 0;
  std::size_t index_count_ = 0;
};

/// The workspace that the executor brings, or one for the call.
template <class Device>
class Workspace {
 public:
  Workspace(Device& device, const Executor& executor, std::size_t bytes) {
    data_ = executor.workspace;
    if (data_ == nullptr) {
      own_ = DeviceBlock(device.memory(), device.stream(), bytes);
      data_ = own_.data();
    } else if (executor.workspace_bytes < bytes) {
      throw Error(ErrorCode::out_of_memory, bytes,
                  "the workspace has " + std::to_string(executor.workspace_bytes) +
                      " bytes, and this build needs " + std::to_string(bytes));
    } else if (reinterpret_cast<std::uintptr_t>(data_) % block_alignment != 0) {
      throw Error(ErrorCode::invalid_option, 0,
                  "the workspace is not aligned to " + std::to_string(block_alignment) + " bytes");
    }
  }
  [[nodiscard]] void* data() const { return data_; }

 private:
  void* data_;
  DeviceBlock own_;
};

inline void check_reference_capacity(const BuildOptions& options) {
  if (options.builder == Builder::morton && options.references == References::all &&
      options.reference_capacity == 0)
    throw Error(ErrorCode::invalid_option, 0,
                "References::all on CUDA needs BuildOptions::reference_capacity; analyse() finds "
                "it");
}

template <class Device>
MemoryRequirement requirement(Device& device, std::uint64_t triangle_count,
                              const BuildOptions& options) {
  core::check_options(options);
  core::check_predictable(options);
  core::check_count(triangle_count);
  check_reference_capacity(options);
  TriangleView triangles;
  triangles.triangle_count = triangle_count;
  const Plan plan =
      plan_build(device, triangles, core::settled(options), capacity_for(triangle_count, options));
  return {plan.tree_bytes, plan.workspace_bytes};
}

/// build() for Builder::wu2011, level by level: waits for the device, and throws what goes wrong.
template <class Device>
Tree build_by_levels(Device& device, const TriangleView& triangles, const BuildOptions& asked) {
  core::check_options(asked);
  const BuildOptions options = core::settled(asked);
  core::check_view(triangles);
  TriangleUpload<Device> upload(device, triangles);
  DeviceBlock triangle_block(device.memory(), device.stream(), upload.bytes());
  const TriangleView on_device = upload.enqueue(triangle_block.data());

  MemoryAsYouGo memory(device.memory(), device.stream());
  using LevelBackend = Backend<Device, MemoryAsYouGo>;
  LevelBackend backend(device, memory, Capacity{});
  core::wu2011::Builder<LevelBackend> builder(backend, on_device, options);
  builder.run();
  backend.for_each(core::one, core::CopyTo<core::BuildState>{builder.state(), backend.record()});
  backend.stage(Stage::count);

  Tree tree;
  TreeAccess access{tree};
  access.view() = {backend.header(), backend.nodes(), backend.leaf_offsets(), backend.references()};
  access.record() = backend.record();
  access.triangles() = on_device;
  access.options() = options;
  access.options().backend = zkd::Backend::cuda;
  access.options().references = References::all;
  access.triangle_capacity() = triangles.triangle_count;
  access.workspace_bytes() = memory.most_held();
  access.own(device, memory.tree_block(), triangle_block);
  return tree;
}

/// build() without the check that `all` has room for references: analyse() asks for none.
template <class Device>
Tree build_with(Device& device, const Executor& executor, const TriangleView& triangles,
                const BuildOptions& asked) {
  core::check_options(asked);
  const BuildOptions options = core::settled(asked);
  core::check_view(triangles);
  const Capacity capacity = capacity_for(triangles.triangle_count, options);
  const Plan plan = plan_build(device, triangles, options, capacity);
  TriangleUpload<Device> upload(device, triangles);

  DeviceBlock tree_block(device.memory(), device.stream(), plan.tree_bytes);
  DeviceBlock triangle_block(device.memory(), device.stream(), upload.bytes());
  const Workspace<Device> workspace(device, executor, plan.workspace_bytes);
  const TriangleView on_device = upload.enqueue(triangle_block.data());
  PlannedMemory memory(tree_block.data(), workspace.data(), plan);
  const BuiltTree built = run_passes(device, memory, on_device, options, capacity);

  Tree tree;
  TreeAccess access{tree};
  access.view() = built.view;
  access.record() = built.record;
  access.triangles() = on_device;
  access.options() = options;
  access.options().backend = zkd::Backend::cuda;
  access.triangle_capacity() = triangles.triangle_count;
  access.workspace_bytes() = plan.workspace_bytes;
  access.own(device, tree_block, triangle_block);
  return tree;
}

/// See zkd::build.
template <class Device>
Tree build_on(Device& device, const Executor& executor, const TriangleView& triangles,
              const BuildOptions& options) {
  if (options.builder == Builder::wu2011) return build_by_levels(device, triangles, options);
  check_reference_capacity(options);
  return build_with(device, executor, triangles, options);
}

/// See zkd::rebuild.
template <class Device>
void rebuild_on(Device& device, const Executor& executor, Tree& tree,
                const TriangleView& triangles) {
  core::check_view(triangles);
  TreeAccess access{tree};
  if (access.workspace_bytes() == 0)
    throw Error(ErrorCode::invalid_view, triangles.triangle_count,
                "only a tree that was built on the device can be built again");
  if (access.options().builder != Builder::morton)
    throw Error(ErrorCode::unsupported_option, 0,
                std::string("a tree of builder ") + to_string(access.options().builder) +
                    " cannot be built again in its own memory");
  const Capacity capacity = capacity_for(access.triangle_capacity(), tree.options());
  if (triangles.triangle_count > access.triangle_capacity())
    throw Error(ErrorCode::invalid_view, triangles.triangle_count,
                std::to_string(triangles.triangle_count) +
                    " triangles; the tree to be rebuilt has room for " +
                    std::to_string(access.triangle_capacity()));
  TriangleUpload<Device> upload(device, triangles);
  if (upload.bytes() > tree.triangle_bytes())
    throw Error(ErrorCode::invalid_view, upload.bytes(),
                "triangles in host memory need " + std::to_string(upload.bytes()) +
                    " bytes; the tree to be rebuilt has room for " +
                    std::to_string(tree.triangle_bytes()));
  const Plan plan = plan_build(device, triangles, access.options(), capacity);
  const Workspace<Device> workspace(device, executor, plan.workspace_bytes);
  const TriangleView on_device = upload.enqueue(access.triangle_block());
  PlannedMemory memory(access.block(), workspace.data(), plan);
  access.incomplete() = true;
  run_passes(device, memory, on_device, access.options(), capacity);
  access.incomplete() = false;
  access.triangles() = on_device;
}

/// See zkd::analyse.
template <class Device>
BuildOptions analyse_on(Device& device, const Executor& executor, const TriangleView& triangles,
                        const BuildOptions& asked) {
  core::check_options(asked);
  const BuildOptions options = core::settled(asked);
  BuildOptions found = options;
  if (options.builder == Builder::wu2011) {  // makes room as it goes
    core::check_view(triangles);
    found.backend = zkd::Backend::cuda;
    found.references = References::all;
    return found;
  }
  found.reference_capacity = 0;  // so that the build ends when it has counted
  core::BuildState state{};
  // With `all` once more where crowded leaves are split: how many references that takes is known
  // when there is room for those before.
  for (int round = 0; round < 2; ++round) {
    Tree tree = build_with(device, executor, triangles, found);
    device.copy_to_host(&state, TreeAccess{tree}.record(), sizeof state);
    if (state.counts.status.code != ErrorCode::reference_capacity) break;
    found.reference_capacity = state.counts.references_needed;
  }
  if (state.counts.status.code != ErrorCode::reference_capacity)
    core::raise(state.counts.status, triangles);
  found = core::used_options(state, options, zkd::Backend::cuda);
  if (options.references == References::all)
    found.reference_capacity = std::max<std::uint64_t>(state.counts.references_needed, 1);
  return found;
}

}  // namespace zkd::cuda
