// SPDX-License-Identifier: Apache-2.0
//
// How a fuzz target says that something is wrong: it says what, and aborts.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

namespace zkd::fuzz {

[[noreturn]] inline void fail(const std::string& what) {
  std::fprintf(stderr, "zkd-fuzz: %s\n", what.c_str());
  std::abort();
}

inline void require(bool holds, const char* what) {
  if (!holds) fail(what);
}

}  // namespace zkd::fuzz
