// SPDX-License-Identifier: Apache-2.0
//
// Cold builds: zkd-bench started once more, so that nothing is warm.
#pragma once

#include <filesystem>
#include <optional>

#include <zkd/options.hpp>

#include "cuda.hpp"

namespace zkd::bench {

/// Starts this program again with --cold on the same mesh file and options, and reads what it
/// prints. Nothing, and a line on stderr that says why, if that fails.
[[nodiscard]] std::optional<ColdBuild> cold_build_elsewhere(const std::filesystem::path& mesh,
                                                            const BuildOptions& options);

}  // namespace zkd::bench
