// SPDX-License-Identifier: Apache-2.0
//
// Single stages on a CUDA device: those of src/core/stages over the CUDA backend.
#include <zkd/cuda/executor.hpp>
#include <zkd/stages.hpp>

#include "core/stages/instantiate.hpp"
#include "cuda/device.cuh"
#include "cuda/stage_backend.hpp"

template <>
struct zkd::core::BackendOf<zkd::cuda::Executor> {
  using type = cuda::StageBackend<cuda::Device>;
};

ZKD_INSTANTIATE_STAGES(cuda::Executor)
