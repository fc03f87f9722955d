// SPDX-License-Identifier: Apache-2.0
//
// What single stages check about the spans they are given.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include <zkd/error.hpp>

#include "core/check_input.hpp"
#include "core/validate.hpp"
#include "core/verbs.hpp"
#include "cpu/backend.hpp"

namespace zkd::stages {

using core::Count;

inline void check_length(std::size_t length, std::size_t expected, const char* what) {
  if (length != expected)
    throw Error(ErrorCode::invalid_view, length,
                std::string(what) + " has " + std::to_string(length) + " elements, not " +
                    std::to_string(expected));
}

/// The lowest index at which something is wrong.
struct FirstOffender {
  std::uint32_t index = core::none_found;
  void combine(const FirstOffender& other) { index = std::min(index, other.index); }
};

template <class IsWrong>
struct FindOffender {
  IsWrong is_wrong;
  void operator()(std::uint32_t i, FirstOffender& first) const {
    if (is_wrong(i)) first.index = std::min(first.index, i);
  }
};

/// Throws Error invalid_view, naming the first i for which is_wrong(i).
template <class IsWrong>
void check_each(cpu::Backend& backend, Count count, const char* what, IsWrong is_wrong) {
  FirstOffender first;
  backend.reduce(count, &first, FindOffender<IsWrong>{is_wrong});
  if (first.index != core::none_found)
    throw Error(ErrorCode::invalid_view, first.index,
                std::string(what) + " is out of range at " + std::to_string(first.index));
}

inline Count exactly(std::size_t n) {
  core::check_count(n);
  return {nullptr, static_cast<std::uint32_t>(n)};
}

}  // namespace zkd::stages
