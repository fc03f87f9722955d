// SPDX-License-Identifier: Apache-2.0
//
// How much memory a program can still take.
#pragma once

#include <cstdint>

namespace zkd::stress {

/// Bytes that are free or can be freed, as the system says; 0 where it does not say.
[[nodiscard]] std::uint64_t available_memory();

}  // namespace zkd::stress
