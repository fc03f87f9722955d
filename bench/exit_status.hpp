// SPDX-License-Identifier: Apache-2.0
//
// How our programs end: an exit status and, for a failure, one line.
#pragma once

#include <algorithm>
#include <exception>
#include <iostream>
#include <new>
#include <string>

#include <zkd/error.hpp>

namespace zkd::bench {

enum ExitStatus { done = 0, check_failed = 1, bad_input = 2, device_failure = 3 };

/// Runs run(), which returns an exit status; what it throws becomes a line and a status, and so
/// does standard output that could not be written.
template <class Run>
int exit_status_of(const char* program, Run run) {
  const auto fail = [program](ExitStatus status, std::string message) -> int {
    std::replace(message.begin(), message.end(), '\n', ' ');
    std::cerr << program << ": error: " << message << std::endl;
    return status;
  };
  try {
    const int status = run();
    std::cout.flush();
    return std::cout ? status : fail(bad_input, "cannot write to standard output");
  } catch (const Error& error) {
    const bool of_machine = error.code() == ErrorCode::out_of_memory ||
                            error.code() == ErrorCode::backend_unavailable ||
                            error.code() == ErrorCode::device_failure;
    return fail(of_machine ? device_failure : bad_input, error.what());
  } catch (const std::bad_alloc&) {
    return fail(device_failure, "out of memory");
  } catch (const std::exception& error) {
    return fail(bad_input, error.what());
  }
}

}  // namespace zkd::bench
