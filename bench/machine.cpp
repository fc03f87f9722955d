// SPDX-License-Identifier: Apache-2.0
//
// What this run stands on, from /proc/cpuinfo, the compiler's macros and CMake.
#include "machine.hpp"

#include <fstream>

namespace zkd::bench {
namespace {

std::optional<std::string> cpu_name() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  std::string line;
  while (std::getline(cpuinfo, line)) {
    if (!line.starts_with("model name") && !line.starts_with("Model")) continue;
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    const std::size_t begin = line.find_first_not_of(" \t", colon + 1);
    if (begin == std::string::npos) continue;
    return line.substr(begin, line.find_last_not_of(" \t") + 1 - begin);
  }
  return std::nullopt;
}

std::optional<std::string> compiler_name() {
#if defined(__clang__)
  return "clang " __clang_version__;
#elif defined(__GNUC__)
  return "g++ " __VERSION__;
#else
  return std::nullopt;
#endif
}

}  // namespace

Machine describe_machine(int threads) {
  Machine machine;
  machine.cpu = cpu_name();
  machine.threads = threads;
  machine.compiler = compiler_name();
#if defined(ZKD_BENCH_COMMIT)
  machine.commit = ZKD_BENCH_COMMIT;
#endif
  return machine;
}

}  // namespace zkd::bench
