// SPDX-License-Identifier: Apache-2.0
//
// Errors as values, to be compared.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include <zkd/error.hpp>

namespace zkd::test {

/// What a call threw.
struct Caught {
  bool thrown = false;
  ErrorCode code{};
  std::uint64_t offender = 0;
  std::string message;
};

inline Caught caught(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_STRNE(error.what(), "");
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "one line";
    return {true, error.code(), error.offender(), error.what()};
  }
  return {};
}

inline bool names(const Caught& error, const std::string& what) {
  return error.message.find(what) != std::string::npos;
}

}  // namespace zkd::test

#define EXPECT_ERROR(error, expected, first_offender)                               \
  do {                                                                              \
    const Caught& e = (error);                                                      \
    ASSERT_TRUE(e.thrown) << "nothing was thrown";                                  \
    EXPECT_EQ(e.code, expected) << e.message;                                       \
    EXPECT_EQ(e.offender, static_cast<std::uint64_t>(first_offender)) << e.message; \
    EXPECT_TRUE(names(e, std::to_string(first_offender))) << e.message;             \
  } while (false)
