// SPDX-License-Identifier: Apache-2.0
//
// Stands for the exact oracle where CMake did not find GMP.
#include "check.hpp"

namespace zkd::bench {

std::unique_ptr<Checker> make_checker(const scene::Mesh&, const scene::Camera&, const Options&,
                                      int) {
  throw UsageError("--check: this zkd-bench was built without GMP, which the exact oracle needs");
}

}  // namespace zkd::bench
