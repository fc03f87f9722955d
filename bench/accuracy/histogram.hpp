// SPDX-License-Identifier: Apache-2.0
//
// Quantiles of any number of errors in little memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace zkd::bench::accuracy {

/// Errors of one quantity.
struct Quantiles {
  std::uint64_t n = 0;
  double median = 0.0;
  double p99 = 0.0;
  double p999 = 0.0;
  double max = 0.0;
};

/// Counts of numbers, 32 bins an octave from 2^-24 to 2^60 (and one each for 0 and for more).
/// A quantile is the upper end of its bin, so it is never too low, and too high by 3.2 % at most;
/// below 2^-24 it is 2^-24. The largest is exact.
class Histogram {
 public:
  /// A number of at least 0; NaN counts as infinite.
  void add(double error);
  Histogram& operator+=(const Histogram& other);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double max() const { return max_; }
  /// `share` in (0, 1]. 0 where nothing was added.
  [[nodiscard]] double quantile(double share) const;
  [[nodiscard]] Quantiles quantiles() const;

 private:
  static constexpr int lowest_exponent = -24;
  static constexpr int highest_exponent = 60;
  static constexpr int bins_per_octave = 32;
  static constexpr std::size_t bins =
      2 + static_cast<std::size_t>((highest_exponent - lowest_exponent) * bins_per_octave);

  static std::size_t bin_of(double error);
  [[nodiscard]] double upper_end(std::size_t bin) const;

  std::array<std::uint64_t, bins> counts_{};
  std::uint64_t count_ = 0;
  double max_ = 0.0;
};

}  // namespace zkd::bench::accuracy
