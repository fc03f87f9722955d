// SPDX-License-Identifier: Apache-2.0
//
// What this run stands on: processor, compiler, commit.
#pragma once

#include "results.hpp"

namespace zkd::bench {

/// What can be found out; the rest stays unknown. `threads` is what the run uses.
[[nodiscard]] Machine describe_machine(int threads);

}  // namespace zkd::bench
