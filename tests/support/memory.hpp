// SPDX-License-Identifier: Apache-2.0
//
// The memory resource that refuses: the one that the stress run has too.
#pragma once

#include "verify/counting_resource.hpp"

namespace zkd::test {

using verify::CountingResource;

}  // namespace zkd::test
