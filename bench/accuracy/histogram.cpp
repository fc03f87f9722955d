// SPDX-License-Identifier: Apache-2.0
//
// Bins that end at (1 + i / 32) * 2^e, their upper end included.
#include "histogram.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace zkd::bench::accuracy {

void Histogram::add(double error) {
  if (std::isnan(error)) error = std::numeric_limits<double>::infinity();
  ++counts_[bin_of(error)];
  ++count_;
  max_ = std::max(max_, error);
}

Histogram& Histogram::operator+=(const Histogram& other) {
  for (std::size_t i = 0; i < bins; ++i) counts_[i] += other.counts_[i];
  count_ += other.count_;
  max_ = std::max(max_, other.max_);
  return *this;
}

std::size_t Histogram::bin_of(double error) {
  if (!(error > 0.0)) return 0;
  if (error >= std::ldexp(1.0, highest_exponent)) return bins - 1;
  int exponent = 0;
  const double mantissa = std::frexp(error, &exponent);  // [0.5, 1)
  const int step = static_cast<int>(std::ceil((mantissa - 0.5) * 2.0 * bins_per_octave));
  const int bin = 1 + (exponent - 1 - lowest_exponent) * bins_per_octave + step;
  return static_cast<std::size_t>(std::clamp(bin, 1, static_cast<int>(bins) - 1));
}

double Histogram::upper_end(std::size_t bin) const {
  if (bin == 0) return 0.0;
  if (bin == bins - 1) return max_;
  const int at = static_cast<int>(bin) - 1;
  const double mantissa = 1.0 + static_cast<double>(at % bins_per_octave) / bins_per_octave;
  return std::min(max_, std::ldexp(mantissa, lowest_exponent + at / bins_per_octave));
}

double Histogram::quantile(double share) const {
  const auto rank = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_))));
  std::uint64_t passed = 0;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    passed += counts_[bin];
    if (passed >= rank) return upper_end(bin);
  }
  return 0.0;
}

Quantiles Histogram::quantiles() const {
  return {count_, quantile(0.5), quantile(0.99), quantile(0.999), max_};
}

}  // namespace zkd::bench::accuracy
