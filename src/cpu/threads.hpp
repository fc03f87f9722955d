// SPDX-License-Identifier: Apache-2.0
//
// How a pass over n elements is divided among OpenMP threads.
#pragma once

#include <omp.h>
#include <algorithm>
#include <cstdint>
#include <string>

#include <zkd/cpu/executor.hpp>
#include <zkd/error.hpp>

#include "core/check_input.hpp"
#include "cpu/float_environment.hpp"
#include "cpu/instruction_set.hpp"

namespace zkd::cpu {

/// Elements that are worth waking a thread for.
inline constexpr std::uint64_t grain = 2048;

/// Elements [begin, end) of a pass.
struct Range {
  std::uint32_t begin;
  std::uint32_t end;
};

/// Throws Error invalid_option.
inline void check_executor(const Executor& executor) {
  if (executor.threads < 0)
    throw Error(ErrorCode::invalid_option, static_cast<std::uint64_t>(executor.threads),
                "threads is " + std::to_string(executor.threads) + "; it must not be negative");
  core::check_enumerator(static_cast<std::int64_t>(executor.instructions),
                         static_cast<std::int64_t>(InstructionSet::avx2), "instructions");
}

class Threads {
 public:
  explicit Threads(const Executor& executor)
      : available_(std::max(1, executor.threads > 0 ? executor.threads : omp_get_max_threads())),
        avx2_(use_avx2(executor.instructions)) {}

  [[nodiscard]] int available() const { return available_; }
  [[nodiscard]] bool avx2() const { return avx2_; }

  /// Threads to use for n elements.
  [[nodiscard]] int team(std::uint64_t n) const {
    const std::uint64_t useful = (n + grain - 1) / grain;
    return static_cast<int>(
        std::clamp<std::uint64_t>(useful, 1, static_cast<std::uint64_t>(available_)));
  }

  /// The part of `thread` of `team` when n elements are divided evenly and in order.
  [[nodiscard]] static Range part(std::uint32_t n, int thread, int team) {
    const auto cut = [&](int t) {
      return static_cast<std::uint32_t>(std::uint64_t{n} * static_cast<std::uint64_t>(t) /
                                        static_cast<std::uint64_t>(team));
    };
    return {cut(thread), cut(thread + 1)};
  }

  /// body(range, thread) once per thread, ranges in order.
  template <class Body>
  void divide(std::uint32_t n, int team, Body body) const {
    if (team == 1) {
      const FloatEnvironment environment;
      call(avx2_, body, Range{0, n}, 0);
      return;
    }
#pragma omp parallel num_threads(team)
    {
      const FloatEnvironment environment;
      // OpenMP may give fewer threads than asked for: each takes the parts of those that are
      // missing.
      for (int thread = omp_get_thread_num(); thread < team; thread += omp_get_num_threads())
        call(avx2_, body, part(n, thread, team), thread);
    }
  }

  /// body(range) for small ranges that threads take as they become free.
  template <class Body>
  void share(std::uint32_t n, std::uint32_t smallest, Body body) const {
    const std::uint64_t wanted = std::max<std::uint64_t>(smallest, 1);
    const int team = static_cast<int>(
        std::clamp<std::uint64_t>(n / wanted, 1, static_cast<std::uint64_t>(available_)));
    if (team == 1) {
      const FloatEnvironment environment;
      call(avx2_, body, Range{0, n});
      return;
    }
    const std::uint64_t size = std::max(wanted, n / (static_cast<std::uint64_t>(team) * 16) + 1);
    const auto pieces = static_cast<std::int64_t>((n + size - 1) / size);
#pragma omp parallel num_threads(team)
    {
      const FloatEnvironment environment;
#pragma omp for schedule(dynamic, 1)
      for (std::int64_t piece = 0; piece < pieces; ++piece) {
        const std::uint64_t begin = static_cast<std::uint64_t>(piece) * size;
        const std::uint64_t end = std::min<std::uint64_t>(begin + size, n);
        call(avx2_, body,
             Range{static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end)});
      }
    }
  }

 private:
  int available_;
  bool avx2_;
};

}  // namespace zkd::cpu
