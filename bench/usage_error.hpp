// SPDX-License-Identifier: Apache-2.0
//
// What all our programs say of a bad command line.
#pragma once

#include <stdexcept>

namespace zkd::bench {

/// A command line that makes no sense. One line that names the option.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace zkd::bench
