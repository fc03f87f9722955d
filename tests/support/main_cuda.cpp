// SPDX-License-Identifier: Apache-2.0
//
// Runs tests on the current CUDA device; where none answers, every test is skipped and says why.
#include <string>

#include <gtest/gtest.h>

#include <zkd/cuda/build.hpp>

#include "support/skip_all.hpp"

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  std::string why;
  if (!zkd::cuda::available(&why)) {
    // The listeners own it.
    testing::UnitTest::GetInstance()->listeners().Append(
        new zkd::test::SkipAll("no CUDA device (" + why + ")"));
  }
  return RUN_ALL_TESTS();
}
