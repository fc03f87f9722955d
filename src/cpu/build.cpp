// SPDX-License-Identifier: Apache-2.0
//
// build() on the CPU: checks, the pipeline over the OpenMP backend, and the finished Tree.
#include <zkd/build.hpp>

#include <chrono>
#include <string>
#include <utility>

#include "core/check_input.hpp"
#include "core/pipeline.hpp"
#include "cpu/backend.hpp"
#include "cpu/quality.hpp"

namespace zkd {

/// Puts a Tree together from what a backend made.
struct TreeAssembler {
  static Tree assemble(cpu::Backend& backend, const core::BuildState& state,
                       const BuildOptions& options) {
    Tree tree;
    tree.view_ = {backend.header(), backend.nodes(), backend.leaf_offsets(), backend.references()};
    tree.lattice_ = state.lattice;
    tree.options_ = options;
    tree.memory_ = backend.memory();
    tree.statistics_.tree_bytes = backend.tree_block().bytes() + backend.reference_block().bytes();
    tree.node_block_.bytes = backend.tree_block().bytes();
    tree.node_block_.data = backend.tree_block().release();
    tree.reference_block_.bytes = backend.reference_block().bytes();
    tree.reference_block_.data = backend.reference_block().release();
    return tree;
  }
  static Statistics& statistics(Tree& tree) { return tree.statistics_; }
};

namespace {

/// Whether codes are kept in 64 bits. More room than bits changes nothing in the tree, so the count
/// given may decide it, invalid triangles included.
bool needs_wide_codes(const BuildOptions& options, std::uint64_t triangle_count) {
  return core::choose_code_bits(options.code_bits, static_cast<std::uint32_t>(triangle_count)) > 32;
}

void report_skips(const core::BuildState& state, const BuildOptions& options,
                  std::uint32_t passes_left_out, Statistics& statistics) {
  const auto report = [&statistics](Skip what, std::uint32_t amount) {
    statistics.skips[static_cast<std::size_t>(what)] = {amount != 0, amount};
  };
  std::uint32_t flat = 0;
  for (int a = 0; a < 3; ++a)
    flat += state.report.bounds.lo[a] == state.report.bounds.hi[a] ? 1 : 0;
  report(Skip::radix_passes, passes_left_out);
  report(Skip::flat_axes, flat);
  report(Skip::wide_codes,
         options.code_bits == 0 && state.report.valid < core::wide_code_threshold ? 32 : 0);
  report(Skip::recoding, options.recode_crowded && state.counts.crowded_trunks == 0 ? 1 : 0);
  report(Skip::compaction, state.counts.left_out == 0 ? 1 : 0);
}

template <class Code>
Tree build_with(cpu::Backend& backend, const TriangleView& triangles, const BuildOptions& options) {
  core::MortonPipeline<Code, cpu::Backend> pipeline(backend, triangles, options);
  pipeline.run();
  backend.finish();
  const core::BuildState& state = *pipeline.state();

  BuildOptions used = options;
  used.backend = Backend::cpu;
  used.code_bits = core::choose_code_bits(options.code_bits, state.report.valid);
  Tree tree = TreeAssembler::assemble(backend, state, used);
  Statistics& statistics = TreeAssembler::statistics(tree);
  statistics.triangles = triangles.triangle_count;
  statistics.skipped_zero_area = state.report.zero_area;
  statistics.skipped_non_finite = state.report.non_finite;
  statistics.code_bits = state.lattice.code_bits;
  statistics.crowded_trunks = state.counts.crowded_trunks;
  statistics.crowded_triangles = state.counts.crowded_triangles;
  statistics.nodes = tree.view().node_count();
  statistics.leaves = tree.view().leaf_count();
  statistics.references = tree.view().reference_count();
  statistics.workspace_bytes = backend.workspace_bytes();
  statistics.stage_ms = backend.stage_ms();
  report_skips(state, options, backend.passes_left_out(), statistics);
  if (options.measure_quality) cpu::measure_quality(tree.view(), statistics);
  return tree;
}

}  // namespace

Tree build(const cpu::Executor& executor, const TriangleView& triangles,
           const BuildOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  core::check_options(options);
  core::check_view(triangles);
  cpu::check_executor(executor);
  cpu::Backend backend(executor);
  Tree tree = needs_wide_codes(options, triangles.triangle_count)
                  ? build_with<std::uint64_t>(backend, triangles, options)
                  : build_with<std::uint32_t>(backend, triangles, options);
  Statistics& statistics = TreeAssembler::statistics(tree);
  statistics.total_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return tree;
}

Tree build(const TriangleView& triangles, const BuildOptions& options) {
  if (options.backend == Backend::cuda)
    throw Error(ErrorCode::backend_unavailable, 0,
                "backend cuda was asked for, but this program does not link zkd::cuda");
  return build(cpu::Executor{}, triangles, options);
}

MemoryRequirement memory_requirement(const cpu::Executor& executor, std::uint64_t triangle_count,
                                     const BuildOptions& options, std::uint64_t reference_count) {
  cpu::check_executor(executor);
  core::check_options(options);
  core::check_count(triangle_count);
  return cpu::Backend::requirement(
      executor, triangle_count, options, needs_wide_codes(options, triangle_count),
      options.references == References::once ? triangle_count : reference_count);
}

}  // namespace zkd
