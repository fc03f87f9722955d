// SPDX-License-Identifier: Apache-2.0
//
// Searching sorted arrays, on host and device.
#pragma once

#include <cstdint>

#include <zkd/config.hpp>

namespace zkd::core {

/// Index of the first of `count` ascending numbers that is not below `value`; `count` if none is.
ZKD_HOST_DEVICE inline std::uint32_t first_not_below(const std::uint32_t* numbers,
                                                     std::uint32_t count, std::uint32_t value) {
  std::uint32_t low = 0;
  std::uint32_t high = count;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (numbers[middle] < value)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

/// Index of the last of `count` ascending numbers that is at most `value`. The first must be.
ZKD_HOST_DEVICE inline std::uint32_t last_at_or_before(const std::uint32_t* numbers,
                                                       std::uint32_t count, std::uint32_t value) {
  return first_not_below(numbers, count, value + 1) - 1;
}

/// How many of `holds(1), holds(2), ... holds(most)` are true, given that none is after the first
/// that is not: gallops, from `step` (a power of two) on, then bisects. O(log of the result).
template <class Predicate>
ZKD_HOST_DEVICE inline std::uint32_t run_length(std::uint32_t most, std::uint32_t step,
                                                const Predicate& holds) {
  std::uint32_t reached = 0;
  while (step <= most - reached && holds(reached + step)) {
    reached += step;
    step *= 2;
  }
  for (; step > 0; step /= 2)
    if (step <= most - reached && holds(reached + step)) reached += step;
  return reached;
}

}  // namespace zkd::core
