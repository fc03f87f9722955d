// SPDX-License-Identifier: Apache-2.0
#include "stress/available_memory.hpp"

#include <fstream>
#include <limits>
#include <string>

namespace zkd::stress {

std::uint64_t available_memory() {
  std::ifstream file("/proc/meminfo");
  std::string name;
  std::uint64_t kilobytes = 0;
  while (file >> name >> kilobytes) {
    if (name == "MemAvailable:") return kilobytes * 1024;
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return 0;
}

}  // namespace zkd::stress
