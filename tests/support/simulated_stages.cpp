// SPDX-License-Identifier: Apache-2.0
//
// Single stages on the simulated device, compiled once for all programs.
#include "core/stages/instantiate.hpp"
#include "cuda/stage_backend.hpp"
#include "support/simulated_device.hpp"

template <>
struct zkd::core::BackendOf<zkd::simulated::Executor> {
  using type = cuda::StageBackend<simulated::Device>;
};

ZKD_INSTANTIATE_STAGES(simulated::Executor)
