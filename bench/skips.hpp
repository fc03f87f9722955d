// SPDX-License-Identifier: Apache-2.0
//
// What a build left out because the scene did not need it, in words.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <zkd/statistics.hpp>

namespace zkd::bench {

struct SkippedWork {
  std::string what;  ///< the library's name for it
  bool taken = false;
  std::string amount;  ///< `2 passes`; empty where it says nothing
  std::string why;     ///< or why not
  std::optional<double> saved_ms;
};

/// What the build looked at, taken or not, in the library's order.
[[nodiscard]] std::vector<SkippedWork> skips_considered(const Statistics& statistics);

/// Only what was taken.
[[nodiscard]] std::vector<SkippedWork> skipped_work(const Statistics& statistics);

}  // namespace zkd::bench
