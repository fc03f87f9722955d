// SPDX-License-Identifier: Apache-2.0
//
// Results for scripts: JSON of a versioned schema.
#pragma once

#include <string>
#include <vector>

#include "cuda.hpp"
#include "results.hpp"

namespace zkd::bench {

/// The whole document, schema 1, indented, with a line end. What is unknown is null.
[[nodiscard]] std::string to_json(const Machine& machine, const std::vector<Result>& results);

/// `{"context_ms": ..., "cold_ms": ...}` with a line end.
[[nodiscard]] std::string to_json(const ColdBuild& cold);

}  // namespace zkd::bench
