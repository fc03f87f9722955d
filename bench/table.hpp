// SPDX-License-Identifier: Apache-2.0
//
// Results for people, in at most 100 columns.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "options.hpp"
#include "results.hpp"
#include "scene/catalog.hpp"

namespace zkd::bench {

/// What runs and where. `backend` is the one chosen; `why_not_cuda` says why auto chose the CPU.
void print_header(std::ostream& out, const Options& options, const Machine& machine,
                  Backend backend, const std::string& why_not_cuda);

/// The paper's table and what belongs to it: spread, stages, skips, peers, check.
void print_results(std::ostream& out, const Options& options, const std::vector<Result>& results);

/// --list.
void print_scenes(std::ostream& out, const std::vector<scene::SceneInfo>& found,
                  const std::vector<std::string>& known);

}  // namespace zkd::bench
