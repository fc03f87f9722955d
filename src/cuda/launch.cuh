// SPDX-License-Identifier: Apache-2.0
//
// How kernels are launched: never by <<< >>>, whose failure would have to be told from an older one
// that the program has not looked at yet.
#pragma once

#include <cuda_runtime.h>

#include <cstdint>

#include <zkd/cuda/executor.hpp>

#include "cuda/error.hpp"

namespace zkd::cuda {

/// Enqueues kernel(arguments...). `what` names it if it cannot be launched.
template <class... Parameters, class... Arguments>
void launch(const char* what, Stream stream, unsigned blocks, unsigned block_size,
            void (*kernel)(Parameters...), Arguments... arguments) {
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(blocks);
  config.blockDim = dim3(block_size);
  config.stream = stream;
  check(cudaLaunchKernelEx(&config, kernel, arguments...), what, __FILE__, __LINE__);
}

}  // namespace zkd::cuda
