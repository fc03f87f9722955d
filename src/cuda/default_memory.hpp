// SPDX-License-Identifier: Apache-2.0
//
// Where device memory comes from if the caller says nothing.
#pragma once

#include <zkd/cuda/executor.hpp>

namespace zkd::cuda {

/// The default pool of a device; plain allocations on devices without pools.
MemoryResource& default_memory(int device);

}  // namespace zkd::cuda
