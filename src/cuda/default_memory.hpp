// SPDX-License-Identifier: Apache-2.0
//
// Where device memory comes from if the caller says nothing.
#pragma once

#include <zkd/cuda/executor.hpp>

namespace zkd::cuda {

/// The current device's default pool; plain allocations on devices without pools.
MemoryResource& default_memory();

}  // namespace zkd::cuda
