// SPDX-License-Identifier: Apache-2.0
//
// Errors of the CUDA runtime as zkd::Error.
#include "cuda_resources.hpp"

#include <string>

#include <zkd/error.hpp>

namespace zkd::bench {

void check_cuda(cudaError_t status, const char* call) {
  if (status == cudaSuccess) return;
  (void)cudaGetLastError();  // or the next call would report it again
  const ErrorCode code =
      status == cudaErrorMemoryAllocation ? ErrorCode::out_of_memory : ErrorCode::device_failure;
  throw Error(code, static_cast<std::uint64_t>(status),
              std::string(call) + ": " + cudaGetErrorString(status) + " (" +
                  cudaGetErrorName(status) + ")");
}

}  // namespace zkd::bench
