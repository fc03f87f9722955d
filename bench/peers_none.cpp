// SPDX-License-Identifier: Apache-2.0
//
// Stands for Embree where CMake did not find it.
#include "peers_embree.hpp"
#include "usage_error.hpp"

namespace zkd::bench {

std::vector<std::unique_ptr<EmbreeContender>> embree_contenders(const scene::Mesh&, int) {
  throw UsageError("--peers embree: this program was built without Embree");
}

}  // namespace zkd::bench
