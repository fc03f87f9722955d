// SPDX-License-Identifier: Apache-2.0
//
// The verbs for a single stage on a device: what a build shares between its steps, each stage makes
// for itself, and its host may wait.
#pragma once

#include "cuda/backend.hpp"
#include "cuda/memory.hpp"

namespace zkd::cuda {

template <class Device>
struct StageParts {
  Device device;
  BlocksOnDemand memory;

  template <class DeviceExecutor>
  explicit StageParts(const DeviceExecutor& executor)
      : device(executor), memory(device.memory(), device.stream()) {}
};

template <class Device>
class StageBackend : private StageParts<Device>, public Backend<Device, BlocksOnDemand> {
 public:
  template <class DeviceExecutor>
  explicit StageBackend(const DeviceExecutor& executor)
      : StageParts<Device>(executor),
        Backend<Device, BlocksOnDemand>(StageParts<Device>::device, StageParts<Device>::memory,
                                        Capacity{}) {}
};

}  // namespace zkd::cuda
