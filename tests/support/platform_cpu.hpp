// SPDX-License-Identifier: Apache-2.0
//
// The CPU as a platform. See support/platform.hpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <zkd/cpu/executor.hpp>

#include "support/host_array.hpp"

namespace zkd::test {

using Executor = cpu::Executor;

inline constexpr std::uint32_t thinning = 1;
inline constexpr bool sort_leaves_passes_out = true;

inline Executor executor(int threads = 0) { return {.threads = threads}; }

inline std::vector<Executor> executors(int most_threads) {
  std::vector<Executor> all;
  for (int threads = 1; threads <= most_threads; ++threads) all.push_back(executor(threads));
  return all;
}

inline std::vector<Executor> all_executors(int most_threads) {
  std::vector<Executor> all;
  for (Executor e : executors(most_threads)) {
    for (const auto set : {cpu::InstructionSet::portable, cpu::InstructionSet::avx2}) {
      e.instructions = set;
      all.push_back(e);
    }
  }
  return all;
}

inline std::string name(const Executor& executor) {
  std::string text = std::to_string(executor.threads) + " threads";
  if (executor.instructions == cpu::InstructionSet::portable) text += ", portable";
  if (executor.instructions == cpu::InstructionSet::avx2) text += ", AVX2";
  return text;
}

}  // namespace zkd::test
