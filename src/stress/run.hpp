// SPDX-License-Identifier: Apache-2.0
//
// Runs rows of the stress matrix and says what came of it.
#pragma once

#include <functional>
#include <string>

#include "stress/case.hpp"
#include "stress/findings.hpp"

namespace zkd::stress {

/// Runs one case. Of every tree: the properties of verify/properties.hpp; the same hash for 1, 2
/// and 3 threads and for permuted triangles; no more memory than memory_requirement said, all of it
/// given back. Of every ray through every tree: the answer of a loop over all triangles with the
/// same intersector, bit by bit; any hit exactly when there is a closest hit; the same through the
/// wide form of every tree; nothing missed, invented or mistaken outside the band, by the exact
/// oracle; the first hits in order those of a loop, for a sample. The other intersectors are held
/// to their loops likewise, and `exact` to the oracle without any band. Of large scenes the loops,
/// the oracle and permutations see a sample.
void run_case(const Case& which, const Setting& setting, Findings& findings);

/// What a row came to.
struct Report {
  int number = 0;
  std::string name;
  Findings findings;
  double ms = 0.0;
};

/// All cases of a row; `begins` is told the name of each before it is run. An exception is a failure
/// of the row.
[[nodiscard]] Report run_row(
    const Row& row, const Setting& setting,
    const std::function<void(const std::string&)>& begins = [](const std::string&) {});

/// One line: number, name, "ok", "FAILED" or "skipped (why)", counts, and times of an even scene.
[[nodiscard]] std::string to_line(const Report& report);

}  // namespace zkd::stress
