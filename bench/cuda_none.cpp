// SPDX-License-Identifier: Apache-2.0
//
// Stands for CUDA in a build without zkd::cuda.
#include "cuda.hpp"

#include <zkd/error.hpp>

namespace zkd::bench {

std::string why_no_cuda() { return "this program was built without CUDA"; }

void describe_device(Machine&) {}

std::vector<std::unique_ptr<ZkdContender>> cuda_contenders(const TriangleView&,
                                                           std::span<const BuildOptions>,
                                                           Intersector) {
  throw Error(ErrorCode::backend_unavailable, 0, why_no_cuda());
}

ColdBuild time_cold_build(const TriangleView&, const BuildOptions&) {
  throw Error(ErrorCode::backend_unavailable, 0, why_no_cuda());
}

}  // namespace zkd::bench
