// SPDX-License-Identifier: Apache-2.0
//
// Skips every test of a program, one by one. (A GTEST_SKIP in the SetUp of an Environment skips all
// as well, but then GoogleTest 1.12 reports none of them as skipped.)
#pragma once

#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace zkd::test {

class SkipAll : public testing::EmptyTestEventListener {
 public:
  explicit SkipAll(std::string why) : why_(std::move(why)) {}

 private:
  // Counts for the test that is about to start, whose body is then left out.
  void OnTestStart(const testing::TestInfo&) override { GTEST_SKIP() << "skipped: " << why_; }

  std::string why_;
};

}  // namespace zkd::test
