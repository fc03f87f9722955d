// SPDX-License-Identifier: Apache-2.0
//
// build() on the CPU: checks, the pipeline over the OpenMP backend, and the finished Tree.
#include <zkd/build.hpp>

#include <chrono>
#include <string>
#include <utility>

#include "core/check_input.hpp"
#include "core/cuda_entry.hpp"
#include "core/outcome.hpp"
#include "core/pipeline.hpp"
#include "core/quality.hpp"
#include "core/wu2011/builder.hpp"
#include "cpu/backend.hpp"
#include "cpu/sah/build.hpp"

namespace zkd {
namespace {

template <class Pipeline>
Tree build_with(cpu::Backend& backend, const TriangleView& triangles, const BuildOptions& options) {
  Pipeline pipeline(backend, triangles, options);
  pipeline.run();
  backend.finish();
  const core::BuildState& state = *pipeline.state();
  Statistics statistics =
      core::describe(state, options, triangles.triangle_count, backend.passes_left_out());
  SkipReport& passes = statistics.skips[static_cast<std::size_t>(Skip::radix_passes)];
  passes.considered = true;
  passes.saved_ms = backend.passes_saved_ms();
  statistics.workspace_bytes = backend.workspace_bytes();
  statistics.stage_ms = backend.stage_ms();
  statistics.stage_bytes = backend.stage_bytes();
  const TreeView view{backend.header(), backend.nodes(), backend.leaf_offsets(),
                      backend.references()};
  if (options.measure_quality) core::measure_quality(view, statistics);
  return TreeAssembler::assemble(view, state, core::used_options(state, options, Backend::cpu),
                                 statistics, backend.tree_block(), backend.reference_block());
}

/// Over the verbs.
Tree build_by_passes(const cpu::Executor& executor, const TriangleView& triangles,
                     const BuildOptions& options) {
  cpu::Backend backend(executor);
  if (options.builder == Builder::wu2011)
    return build_with<core::wu2011::Builder<cpu::Backend>>(backend, triangles, options);
  return core::needs_wide_codes(options, triangles.triangle_count)
             ? build_with<core::MortonPipeline<std::uint64_t, cpu::Backend>>(backend, triangles,
                                                                             options)
             : build_with<core::MortonPipeline<std::uint32_t, cpu::Backend>>(backend, triangles,
                                                                             options);
}

}  // namespace

Tree build(const cpu::Executor& executor, const TriangleView& triangles,
           const BuildOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  core::check_cpu_options(options);
  core::check_view(triangles);
  cpu::check_executor(executor);
  const BuildOptions used = core::settled(options);
  Tree tree = used.builder == Builder::sah ? cpu::sah::build(executor, triangles, used)
                                           : build_by_passes(executor, triangles, used);
  Statistics& statistics = TreeAssembler::statistics(tree);
  statistics.total_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return tree;
}

Tree build(const TriangleView& triangles, const BuildOptions& options) {
  const bool only_on_cpu =
      core::builder_for(options) == Builder::sah && options.backend != Backend::cuda;
  if (only_on_cpu)
    core::check_cpu_options(options);
  else
    core::check_options(options);
  if (options.backend != Backend::cpu && !only_on_cpu) {
    std::string why = "this program does not link zkd::cuda";
    if (zkd_cuda_entry != nullptr && zkd_cuda_entry()->available(&why))
      return zkd_cuda_entry()->build(triangles, options);
    if (options.backend == Backend::cuda)
      throw Error(ErrorCode::backend_unavailable, 0, "backend cuda was asked for, but " + why);
  }
  return build(cpu::Executor{}, triangles, options);
}

MemoryRequirement memory_requirement(const cpu::Executor& executor, std::uint64_t triangle_count,
                                     const BuildOptions& options, std::uint64_t reference_count) {
  cpu::check_executor(executor);
  core::check_cpu_options(options);
  core::check_predictable(options);
  core::check_count(triangle_count);
  return cpu::Backend::requirement(
      executor, triangle_count, core::settled(options),
      core::needs_wide_codes(options, triangle_count),
      options.references == References::all
          ? reference_count
          : core::most_elements(options, static_cast<std::uint32_t>(triangle_count)));
}

}  // namespace zkd
