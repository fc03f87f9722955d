// SPDX-License-Identifier: Apache-2.0
//
// --stats: what the trees look like and how they came to be, for people and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <vector>

#include <zkd/tree_statistics.hpp>

#include "results.hpp"

namespace zkd::bench {

/// Counts, expected costs and histograms of each tree, and what its build took and left out, in at
/// most 100 columns.
void print_tree_stats(std::ostream& out, const std::vector<Result>& results);

/// The same with all digits; depths and sizes without leaves left out.
[[nodiscard]] nlohmann::ordered_json tree_stats_json(const TreeStatistics& statistics);

}  // namespace zkd::bench
