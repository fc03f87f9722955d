// SPDX-License-Identifier: Apache-2.0
//
// Trees and what is known of them, between device and host. Over a Device: see
// cuda/build_steps.hpp.
#pragma once

#include <cstddef>
#include <memory_resource>

#include <zkd/cuda/tree.hpp>
#include <zkd/tree.hpp>

#include "core/host_block.hpp"
#include "core/outcome.hpp"
#include "core/quality.hpp"
#include "core/status.hpp"
#include "cuda/build_steps.hpp"

namespace zkd::cuda {

/// Waits for the build and looks at what it left; throws what went wrong.
template <class Device>
core::BuildState checked_state(Device& device, const Tree& tree, const core::BuildState* record) {
  core::BuildState state{};
  if (record == nullptr) return state;
  device.copy_to_host(&state, record, sizeof state);
  core::raise(state.counts.status, tree.triangles());
  return state;
}

inline Statistics statistics_of(const Tree& tree, const core::BuildState& state,
                                std::size_t workspace_bytes) {
  Statistics statistics = core::describe(state, tree.options(), tree.triangles().triangle_count, 0);
  statistics.tree_bytes = tree.tree_bytes();
  statistics.workspace_bytes = workspace_bytes;
  return statistics;
}

/// See Tree::to_host.
template <class Device>
zkd::Tree copy_to_host(Device& device, const Tree& tree, const core::BuildState* record,
                       std::size_t workspace_bytes, std::pmr::memory_resource* memory) {
  if (record == nullptr) return {};
  if (memory == nullptr) memory = std::pmr::get_default_resource();
  const core::BuildState state = checked_state(device, tree, record);
  const std::size_t leaves = state.counts.trunks;
  const std::size_t reference_bytes = std::size_t{state.counts.references} * sizeof(std::uint32_t);

  core::TreeArrays arrays{};
  core::HostBlock tree_block(memory, core::bytes_of(arrays, leaves));
  core::HostBlock reference_block(memory, reference_bytes);
  core::Arena arena(tree_block.data());
  arrays.lay_out(arena, leaves);
  const TreeView& from = tree.view();
  device.copy_to_host(arrays.header, from.header, sizeof(TreeHeader));
  if (leaves > 1) device.copy_to_host(arrays.nodes, from.nodes, (leaves - 1) * sizeof(Node));
  device.copy_to_host(arrays.leaf_offsets, from.leaf_offsets, (leaves + 1) * sizeof(std::uint32_t));
  if (reference_bytes != 0)
    device.copy_to_host(reference_block.data(), from.references, reference_bytes);

  const TreeView view{arrays.header, arrays.nodes, arrays.leaf_offsets,
                      static_cast<const std::uint32_t*>(reference_block.data())};
  Statistics statistics = statistics_of(tree, state, workspace_bytes);
  if (tree.options().measure_quality) core::measure_quality(view, statistics);
  return TreeAssembler::assemble(view, state,
                                 core::used_options(state, tree.options(), zkd::Backend::cuda),
                                 statistics, tree_block, reference_block);
}

/// The part of a build's state that its tree keeps.
inline core::BuildState state_of(const zkd::Tree& tree) {
  const Statistics& statistics = tree.statistics();
  core::BuildState state{};
  state.report.bounds = tree.view().bounds();
  state.report.zero_area = static_cast<std::uint32_t>(statistics.skipped_zero_area);
  state.report.non_finite = static_cast<std::uint32_t>(statistics.skipped_non_finite);
  state.report.valid = static_cast<std::uint32_t>(
      statistics.triangles - statistics.skipped_zero_area - statistics.skipped_non_finite);
  core::BuildCounts& counts = state.counts;
  counts.given = static_cast<std::uint32_t>(statistics.triangles);
  counts.listed = state.report.valid;
  counts.left_out = counts.given - counts.listed;
  const bool may_be_split = tree.options().references != References::once;
  counts.splits = may_be_split && !statistics.skip(Skip::splitting).taken ? 1 : 0;
  counts.crowded_trunks = static_cast<std::uint32_t>(statistics.crowded_trunks);
  counts.crowded_triangles = static_cast<std::uint32_t>(statistics.crowded_triangles);
  counts.crowded_leaves = static_cast<std::uint32_t>(statistics.crowded_leaves);
  counts.crowded_references = static_cast<std::uint32_t>(statistics.crowded_references);
  counts.trunks = tree.view().leaf_count();
  counts.nodes = tree.view().node_count();
  counts.references = tree.view().reference_count();
  counts.references_needed = counts.references;
  state.lattice = tree.lattice();
  state.root = tree.view().root();
  return state;
}

/// See zkd::cuda::to_device.
template <class Device>
Tree copy_to_device(Device& device, const zkd::Tree& from, const TriangleView& triangles) {
  const TreeView& view = from.view();
  const std::size_t leaves = view.leaf_count();
  const std::size_t references = view.reference_count();
  TriangleUpload<Device> upload(device, triangles);

  Array<core::BuildState> record;
  core::TreeArrays arrays{};
  Array<std::uint32_t> listed;
  const auto lay_out = [&](core::Arena arena) {
    record.lay_out(arena, 1);
    arrays.lay_out(arena, leaves);
    listed.lay_out(arena, references);
    return arena.used();
  };
  DeviceBlock tree_block(device.memory(), device.stream(), lay_out(core::Arena{}));
  DeviceBlock triangle_block(device.memory(), device.stream(), upload.bytes());
  lay_out(core::Arena(tree_block.data()));

  const core::BuildState state = state_of(from);
  const TreeHeader header{view.bounds(), view.scale(), view.root(), view.leaf_count(),
                          view.reference_count()};
  // By value: a copy might read them when this function has returned.
  device.for_each(core::one, Store<core::BuildState>{state, record.data});
  device.for_each(core::one, Store<TreeHeader>{header, arrays.header});
  if (leaves > 1) device.copy_to_device(arrays.nodes, view.nodes, (leaves - 1) * sizeof(Node));
  if (leaves > 0)
    device.copy_to_device(arrays.leaf_offsets, view.leaf_offsets,
                          (leaves + 1) * sizeof(std::uint32_t));
  else
    device.for_each(core::one, core::Fill{arrays.leaf_offsets, 0});
  if (references > 0)
    device.copy_to_device(listed.data, view.references, references * sizeof(std::uint32_t));

  Tree tree;
  TreeAccess access{tree};
  access.view() = {arrays.header, arrays.nodes, arrays.leaf_offsets, listed.data};
  access.record() = record.data;
  access.triangles() = upload.enqueue(triangle_block.data());
  access.options() = from.options();
  access.options().backend = zkd::Backend::cuda;
  access.own(device, tree_block, triangle_block);
  return tree;
}

}  // namespace zkd::cuda
