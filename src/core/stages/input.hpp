// SPDX-License-Identifier: Apache-2.0
//
// What single stages check about the spans they are given.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include <zkd/error.hpp>
#include <zkd/options.hpp>

#include "core/check_input.hpp"
#include "core/validate.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// Throws Error too_many_triangles.
inline Count exactly(std::size_t n) {
  check_count(n);
  return {nullptr, static_cast<std::uint32_t>(n)};
}

/// What stands between so many trunks. Throws Error too_many_triangles.
inline Count nodes_between(std::size_t trunks) { return exactly(trunks > 0 ? trunks - 1 : 0); }

inline void check_length(std::size_t length, std::size_t expected, const char* what) {
  if (length != expected)
    throw Error(ErrorCode::invalid_view, length,
                std::string(what) + " has " + std::to_string(length) + " elements, not " +
                    std::to_string(expected));
}

/// Throws Error invalid_view, naming the first i for which is_wrong(i).
template <class Backend, class IsWrong>
void check_each(Backend& backend, Count count, const char* what, IsWrong is_wrong) {
  const std::uint32_t first = backend.first_where(count, is_wrong);
  if (first != none_found)
    throw Error(ErrorCode::invalid_view, first,
                std::string(what) + " is out of range at " + std::to_string(first));
}

/// A number that should be below another, and is not.
struct IsNotBelow {
  const std::uint32_t* numbers;
  std::size_t limit;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t i) const { return numbers[i] >= limit; }
};

inline void check_leaf_size(std::uint32_t leaf_size) {
  if (leaf_size == 0)
    throw Error(ErrorCode::invalid_option, 0, "leaf_size is 0; it must be 1 to 1024");
  BuildOptions options;
  options.leaf_size = leaf_size;
  check_options(options);
}

inline void check_policy(References references) {
  BuildOptions options;
  options.references = references;
  check_options(options);
}

/// For the stage that lists them.
inline void check_references(References references) {
  check_policy(references);
  if (references != References::once && references != References::all)
    throw Error(ErrorCode::unsupported_option, 0,
                std::string("a stage by itself lists references once or all, not ") +
                    to_string(references));
}

}  // namespace zkd::core
