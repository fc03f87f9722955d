// SPDX-License-Identifier: Apache-2.0
//
// What the cases of a row of the stress matrix count, and what they find wrong.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "verify/check.hpp"

namespace zkd::stress {

/// Time and memory of builds and of rays.
struct Expense {
  double build_ms = 0.0;
  double trace_ms = 0.0;
  std::uint64_t bytes = 0;  ///< of trees and workspaces

  Expense& operator+=(const Expense& more) {
    build_ms += more.build_ms;
    trace_ms += more.trace_ms;
    bytes += more.bytes;
    return *this;
  }
};

class Findings {
 public:
  std::uint64_t cases = 0;
  std::uint64_t rays = 0;       ///< different ones; each is traced through several trees
  std::uint64_t different = 0;  ///< answers of a tree that are not brute force's, bit by bit
  verify::Mistakes outside;     ///< against the oracle, outside the band
  std::uint64_t in_band = 0;

  Expense spent;       ///< by the cases that were timed
  Expense spent_even;  ///< by even scenes of the same size, with random rays

  /// What follows is about this case or part of it; said before each failure.
  void about(std::string what) { about_ = std::move(what); }

  void fail(const std::string& what) {
    if (failure_count_++ < most_failures) {
      failures_.push_back(about_.empty() ? what : about_ + ": " + what);
    }
  }
  void expect(bool condition, const std::string& what) {
    if (!condition) fail(what);
  }

  /// Something a reader should know though it is no failure. Said once.
  void note(const std::string& what) {
    for (const std::string& known : notes_) {
      if (known == what) return;
    }
    notes_.push_back(what);
  }

  /// The row says nothing here, and why.
  void skip(std::string why) { skipped_ = std::move(why); }
  [[nodiscard]] const std::string& skipped() const { return skipped_; }

  /// The first of them.
  [[nodiscard]] const std::vector<std::string>& failures() const { return failures_; }
  [[nodiscard]] std::uint64_t failure_count() const { return failure_count_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  [[nodiscard]] bool ok() const { return failure_count_ == 0; }

 private:
  static constexpr std::uint64_t most_failures = 10;

  std::string about_;
  std::vector<std::string> failures_;
  std::uint64_t failure_count_ = 0;
  std::vector<std::string> notes_;
  std::string skipped_;
};

}  // namespace zkd::stress
