// SPDX-License-Identifier: Apache-2.0
//
// The dice of the tests: those of the generators.
#pragma once

#include "scene/random.hpp"

namespace zkd::test {

using scene::Random;
using scene::ulps;

}  // namespace zkd::test
