// SPDX-License-Identifier: Apache-2.0
//
// Every call to CUDA is checked here: a failure becomes an Error that names the call.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>
#include <string>
#include <string_view>

#include <zkd/error.hpp>

namespace zkd::cuda {

/// The file's name without its folders: messages must not depend on where zkd was built.
inline std::string_view file_name(std::string_view path) {
  return path.substr(path.find_last_of('/') + 1);
}

/// Throws the Error that stands for `status`, unless it is success. CUDA's own memory of the error
/// is cleared: one that can be cleared must not come up again in somebody else's call, and one that
/// cannot (a kernel read where nothing is) is called that.
inline void check(cudaError_t status, const char* call, const char* file, int line) {
  if (status == cudaSuccess) return;
  (void)cudaGetLastError();
  const bool sticky = cudaGetLastError() != cudaSuccess;
  ErrorCode code = ErrorCode::device_failure;
  switch (status) {
    case cudaErrorNoDevice:
    case cudaErrorInsufficientDriver:
    case cudaErrorNoKernelImageForDevice:
    case cudaErrorUnsupportedPtxVersion:
    case cudaErrorInvalidDeviceFunction:
    case cudaErrorSystemNotReady:
    case cudaErrorSystemDriverMismatch:
    case cudaErrorCompatNotSupportedOnDevice:
    case cudaErrorDevicesUnavailable:
    case cudaErrorStubLibrary:
      code = ErrorCode::backend_unavailable;
      break;
    case cudaErrorMemoryAllocation:
      code = ErrorCode::out_of_memory;
      break;
    default:
      break;
  }
  const bool unavailable = code == ErrorCode::backend_unavailable;
  throw Error(code, code == ErrorCode::device_failure ? static_cast<std::uint64_t>(status) : 0,
              (unavailable ? "no CUDA device answers: " : "") + std::string(call) + ": " +
                  cudaGetErrorName(status) + " (" + cudaGetErrorString(status) + "), at " +
                  std::string(file_name(file)) + ":" + std::to_string(line) +
                  (sticky && !unavailable ? "; this process can no longer use the device" : ""));
}

}  // namespace zkd::cuda

// A macro for the place of the call: nvcc 12.0 cannot evaluate std::source_location.
#define ZKD_CUDA_CHECK(call) ::zkd::cuda::check((call), #call, __FILE__, __LINE__)

// CUB asks for the last error after its launches: one that the program has left there would pass
// for ours.
#define ZKD_CUB_CHECK(call) ((void)cudaGetLastError(), ZKD_CUDA_CHECK(call))
