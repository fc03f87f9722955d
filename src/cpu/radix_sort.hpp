// SPDX-License-Identifier: Apache-2.0
//
// Stage 4 on the CPU: a stable least-significant-digit radix sort of keys with values. Each thread
// counts and scatters its own part of the input; places come from a scan over digits and threads,
// so the result does not depend on the number of threads.
#pragma once

#include <cstdint>
#include <cstring>
#include <utility>

#include "core/arena.hpp"
#include "core/verbs.hpp"
#include "cpu/memory.hpp"
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

inline std::uint32_t digits_of(std::uint32_t bits) { return (bits + digit_bits - 1) / digit_bits; }

/// Sorts `count` pairs by the low `bits` bits of the keys. Returns the buffers with the result in
/// `keys` and `values`; adds the number of passes left out because a digit was the same in all
/// keys.
template <class Key>
core::SortBuffers<Key> radix_sort(const Threads& threads, SortScratch scratch,
                                  core::SortBuffers<Key> buffers, std::uint32_t count,
                                  std::uint32_t bits, std::uint32_t& passes_left_out) {
  const std::uint32_t digits = digits_of(bits);
  const int team = threads.team(count);
  const auto digit = [](Key key, std::uint32_t which) {
    return static_cast<std::uint32_t>(key >> (which * digit_bits)) & (digit_values - 1);
  };
  Histogram* const counts = scratch.counts;
  const auto count_of = [counts, digits](int thread, std::uint32_t which) -> Histogram& {
    return counts[static_cast<std::size_t>(thread) * digits + which];
  };

  // All digits are counted in one pass over the input: that tells which of them vary, and the first
  // one that does needs no counting of its own.
  threads.divide(count, team, [=](Range range, int thread) {
    std::memset(count_of(thread, 0), 0, sizeof(Histogram) * digits);
    for (std::uint32_t i = range.begin; i < range.end; ++i)
      for (std::uint32_t d = 0; d < digits; ++d) ++count_of(thread, d)[digit(buffers.keys[i], d)];
  });
  bool moved = false;
  for (std::uint32_t d = 0; d < digits; ++d) {
    if (count > 0) {
      const std::uint32_t first = digit(buffers.keys[0], d);
      std::uint32_t same = 0;
      for (int thread = 0; thread < team; ++thread) same += count_of(thread, d)[first];
      // Counts of the whole input are right after any number of passes, so the parts' sum is too,
      // but only before the threads count this digit again.
      if (same == count) {
        ++passes_left_out;
        continue;
      }
    }
    if (moved)
      threads.divide(count, team, [=](Range range, int thread) {
        Histogram& mine = count_of(thread, d);
        std::memset(mine, 0, sizeof(Histogram));
        for (std::uint32_t i = range.begin; i < range.end; ++i) ++mine[digit(buffers.keys[i], d)];
      });
    std::uint32_t place = 0;
    for (std::uint32_t value = 0; value < digit_values; ++value)
      for (int thread = 0; thread < team; ++thread)
        place += std::exchange(count_of(thread, d)[value], place);
    threads.divide(count, team, [=](Range range, int thread) {
      Histogram& places = count_of(thread, d);
      for (std::uint32_t i = range.begin; i < range.end; ++i) {
        const std::uint32_t to = places[digit(buffers.keys[i], d)]++;
        buffers.other_keys[to] = buffers.keys[i];
        buffers.other_values[to] = buffers.values[i];
      }
    });
    std::swap(buffers.keys, buffers.other_keys);
    std::swap(buffers.values, buffers.other_values);
    moved = true;
  }
  return buffers;
}

}  // namespace zkd::cpu
