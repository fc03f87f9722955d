// SPDX-License-Identifier: Apache-2.0
//
// Whole builds on the simulated device, compiled once for all programs.
#include "support/simulated_device.hpp"

namespace zkd {

simulated::Tree build(const simulated::Executor& executor, const TriangleView& triangles,
                      const BuildOptions& options) {
  simulated::Device device(executor);
  return {cuda::build_on(device, executor, triangles, options), executor};
}

void rebuild(const simulated::Executor& executor, cuda::Tree& tree, const TriangleView& triangles) {
  simulated::Device device(executor);
  cuda::rebuild_on(device, executor, tree, triangles);
}

BuildOptions analyse(const simulated::Executor& executor, const TriangleView& triangles,
                     const BuildOptions& options) {
  simulated::Device device(executor);
  return cuda::analyse_on(device, executor, triangles, options);
}

MemoryRequirement memory_requirement(const simulated::Executor& executor,
                                     std::uint64_t triangle_count, const BuildOptions& options) {
  simulated::Device device(executor);
  return cuda::requirement(device, triangle_count, options);
}

}  // namespace zkd
