// SPDX-License-Identifier: Apache-2.0
//
// Order statistics of a few samples.
#include "spread.hpp"

#include <algorithm>

namespace zkd::bench {

Spread spread_of(Samples samples) {
  if (samples.empty()) return {};
  std::sort(samples.begin(), samples.end());
  const std::size_t middle = samples.size() / 2;
  const double median =
      samples.size() % 2 == 1 ? samples[middle] : 0.5 * (samples[middle - 1] + samples[middle]);
  return {median, samples.front(), samples.back(), samples.size()};
}

}  // namespace zkd::bench
