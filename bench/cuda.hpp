// SPDX-License-Identifier: Apache-2.0
//
// What the programs here ask of CUDA. No header of CUDA is needed to include this one;
// cuda_none.cpp stands in where zkd::cuda is not built.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "contender_zkd.hpp"
#include "results.hpp"

namespace zkd::bench {

/// Why nothing can be built on a CUDA device here, in words; empty if it can.
[[nodiscard]] std::string why_no_cuda();

/// What --backend comes to here, and why not CUDA if that was asked for.
struct Where {
  Backend backend = Backend::cpu;  ///< cpu or cuda
  std::string why_not_cuda;
};

/// Throws Error backend_unavailable for `cuda` where it cannot be had.
[[nodiscard]] Where resolve(Backend wanted);

/// Adds the current device and its driver, as far as they can be found out.
void describe_device(Machine& machine);

/// zkd on the current CUDA device, one for each of `settings`, all over one copy of `triangles` in
/// device memory. For `all` without a capacity one is found, by analyse(). `triangles` must outlive
/// them; describe() must come before everything else.
///
/// Everything of them throws Error backend_unavailable, device_failure or out_of_memory where CUDA
/// refuses.
[[nodiscard]] std::vector<std::unique_ptr<ZkdContender>> cuda_contenders(
    const TriangleView& triangles, std::span<const BuildOptions> settings, Intersector intersector);

/// What the first build of a process takes.
struct ColdBuild {
  double context_ms = 0.0;  ///< making the context, before
  double build_ms = 0.0;    ///< from the call until the device has finished
};

/// To be called in a process that has not touched the device yet. Copies the triangles over between
/// the two.
[[nodiscard]] ColdBuild time_cold_build(const TriangleView& triangles, const BuildOptions& options);

}  // namespace zkd::bench
