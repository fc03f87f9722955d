// SPDX-License-Identifier: Apache-2.0
//
// What a build left out because the scene did not need it, in words.
#pragma once

#include <string>
#include <vector>

#include <zkd/statistics.hpp>

namespace zkd::bench {

struct SkippedWork {
  std::string what;    ///< the library's name for it
  std::string amount;  ///< `2 passes`
  std::string why;
};

/// Only what was taken, in the library's order.
[[nodiscard]] std::vector<SkippedWork> skipped_work(const Statistics& statistics);

}  // namespace zkd::bench
