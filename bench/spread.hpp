// SPDX-License-Identifier: Apache-2.0
//
// From repetitions of one measurement to its spread.
#pragma once

#include <vector>

#include "results.hpp"

namespace zkd::bench {

/// Milliseconds, one for each repetition.
using Samples = std::vector<double>;

/// Median, least, most and number. Nothing measured: zeros.
[[nodiscard]] Spread spread_of(Samples samples);

}  // namespace zkd::bench
