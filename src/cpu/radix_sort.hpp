// SPDX-License-Identifier: Apache-2.0
//
// Stage 4 on the CPU: a stable least-significant-digit radix sort of keys with values. Each thread
// counts and scatters its own part of the input; places come from a scan over digits and threads,
// so the result does not depend on the number of threads.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <utility>

#include "core/arena.hpp"
#include "core/verbs.hpp"
#include "cpu/threads.hpp"

namespace zkd::cpu {

/// 2^8 streams of writes stay within the first-level cache and its TLB.
inline constexpr std::uint32_t digit_bits = 8;
inline constexpr std::uint32_t digit_values = 1u << digit_bits;

using Histogram = std::uint32_t[digit_values];

struct SortScratch {
  Histogram* counts;  ///< one per thread and digit

  void lay_out(core::Arena& arena, int threads, std::uint32_t digits) {
    counts = arena.take<Histogram>(static_cast<std::size_t>(threads) * digits);
  }
};

/// Passes that sorts left out because a digit was the same in all keys.
struct PassesLeftOut {
  std::uint32_t count = 0;
  double saved_ms = 0.0;        ///< at the mean time of the passes of the same sort
  bool all_have_a_time = true;  ///< not where a sort left out every pass
};

inline std::uint32_t digits_of(std::uint32_t bits) { return (bits + digit_bits - 1) / digit_bits; }

/// One digit of a key of `bits` bits; the last may be shorter.
struct Digit {
  std::uint32_t shift;
  std::uint32_t mask;

  Digit(std::uint32_t which, std::uint32_t bits)
      : shift(which * digit_bits), mask((1u << std::min(digit_bits, bits - shift)) - 1) {}

  template <class Key>
  std::uint32_t operator()(Key key) const {
    return static_cast<std::uint32_t>(key >> shift) & mask;
  }
};

/// One sort: the input's parts, one per thread, and how often each digit occurs in them.
template <class Key>
class RadixSort {
 public:
  RadixSort(const Threads& threads, SortScratch scratch, core::SortBuffers<Key> buffers,
            std::uint32_t count, std::uint32_t bits)
      : threads_(threads),
        counts_(scratch.counts),
        buffers_(buffers),
        count_(count),
        bits_(bits),
        digits_(digits_of(bits)),
        team_(threads.team(count)) {}

  /// Returns the buffers with the result in `keys` and `values`; adds the passes left out.
  core::SortBuffers<Key> run(PassesLeftOut& left_out) {
    if (count_ == 0) return buffers_;
    count_all_digits();
    const auto start = std::chrono::steady_clock::now();
    std::uint32_t passes = 0;
    for (std::uint32_t d = 0; d < digits_; ++d) {
      if (is_constant(d)) continue;
      if (passes > 0) count_digit(d);  // how often is known, but no longer in which part
      make_places(d);
      scatter(d);
      ++passes;
    }
    if (passes < digits_) {
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - start;
      left_out.count += digits_ - passes;
      if (passes > 0)
        left_out.saved_ms += took.count() / passes * (digits_ - passes);
      else
        left_out.all_have_a_time = false;
    }
    return buffers_;
  }

 private:
  [[nodiscard]] Histogram& counts(int thread, std::uint32_t digit) const {
    return counts_[static_cast<std::size_t>(thread) * digits_ + digit];
  }

  /// In one pass over the input, a stretch of it at a time so that it is read from cache.
  void count_all_digits() const {
    threads_.divide(count_, team_, [this](Range range, int thread) {
      std::memset(counts(thread, 0), 0, sizeof(Histogram) * digits_);
      constexpr std::uint32_t stretch = 2048;
      for (std::uint32_t begin = range.begin; begin < range.end;) {
        const std::uint32_t end = begin + std::min(stretch, range.end - begin);
        for (std::uint32_t d = 0; d < digits_; ++d) add(counts(thread, d), d, {begin, end});
        begin = end;
      }
    });
  }

  void count_digit(std::uint32_t d) const {
    threads_.divide(count_, team_, [this, d](Range range, int thread) {
      std::memset(counts(thread, d), 0, sizeof(Histogram));
      add(counts(thread, d), d, range);
    });
  }

  void add(Histogram& histogram, std::uint32_t d, Range range) const {
    const Digit digit(d, bits_);
    const Key* const keys = buffers_.keys;
    for (std::uint32_t i = range.begin; i < range.end; ++i) ++histogram[digit(keys[i])];
  }

  /// Moving does not change how often a digit occurs, so the first count serves all passes.
  [[nodiscard]] bool is_constant(std::uint32_t d) const {
    const std::uint32_t value = Digit(d, bits_)(buffers_.keys[0]);
    std::uint32_t same = 0;
    for (int thread = 0; thread < team_; ++thread) same += counts(thread, d)[value];
    return same == count_;
  }

  /// Turns counts into places: digits in order, and within one digit the threads in order.
  void make_places(std::uint32_t d) const {
    std::uint32_t place = 0;
    for (std::uint32_t value = 0; value < digit_values; ++value)
      for (int thread = 0; thread < team_; ++thread)
        place += std::exchange(counts(thread, d)[value], place);
  }

  void scatter(std::uint32_t d) {
    threads_.divide(count_, team_,
                    [b = buffers_, digit = Digit(d, bits_), this, d](Range range, int thread) {
                      Histogram& places = counts(thread, d);
                      for (std::uint32_t i = range.begin; i < range.end; ++i) {
                        const std::uint32_t to = places[digit(b.keys[i])]++;
                        b.other_keys[to] = b.keys[i];
                        b.other_values[to] = b.values[i];
                      }
                    });
    std::swap(buffers_.keys, buffers_.other_keys);
    std::swap(buffers_.values, buffers_.other_values);
  }

  const Threads& threads_;
  Histogram* counts_;
  core::SortBuffers<Key> buffers_;
  std::uint32_t count_;
  std::uint32_t bits_;
  std::uint32_t digits_;
  int team_;
};

}  // namespace zkd::cpu
