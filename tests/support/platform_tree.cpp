// SPDX-License-Identifier: Apache-2.0
//
// What of support/platform_tree.hpp is the same everywhere.
#include "support/platform_tree.hpp"

namespace zkd::test {

const char* name(Walk walk) {
  switch (walk) {
    case Walk::portable:
      return "portable";
    case Walk::avx2:
      return "avx2";
    case Walk::automatic:
      break;
  }
  return "automatic";
}

}  // namespace zkd::test
