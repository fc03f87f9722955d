// SPDX-License-Identifier: Apache-2.0
//
// Stage 4 by itself: the sort, a verb of the backend.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

template <class Code, class Executor>
std::uint32_t sort_alone(const Executor& executor, std::span<Code> codes,
                         std::span<std::uint32_t> values, std::uint32_t bits) {
  check_length(values.size(), codes.size(), "values");
  if (bits > 8 * sizeof(Code))
    throw Error(ErrorCode::invalid_option, bits,
                std::to_string(bits) + " bits to sort by, but a code has " +
                    std::to_string(8 * sizeof(Code)));
  const Count count = exactly(codes.size());
  ExactBackendOf<Executor> backend(executor);
  const SortBuffers<Code> given{codes.data(), values.data(),
                                backend.template take_array<Code>(codes.size()),
                                backend.template take_array<std::uint32_t>(codes.size())};
  const SortBuffers<Code> sorted = backend.radix_sort(given, count, bits);
  if (sorted.keys != codes.data()) {
    backend.for_each(count, CopyTo<Code>{sorted.keys, codes.data()});
    backend.for_each(count, CopyTo<std::uint32_t>{sorted.values, values.data()});
  }
  backend.wait();
  return backend.passes_left_out();
}

}  // namespace zkd::core

namespace zkd::stages {

template <class Executor>
std::uint32_t radix_sort(const Executor& executor, std::span<std::uint32_t> codes,
                         std::span<std::uint32_t> values, std::uint32_t bits) {
  return core::sort_alone(executor, codes, values, bits);
}

template <class Executor>
std::uint32_t radix_sort(const Executor& executor, std::span<std::uint64_t> codes,
                         std::span<std::uint32_t> values, std::uint32_t bits) {
  return core::sort_alone(executor, codes, values, bits);
}

}  // namespace zkd::stages
