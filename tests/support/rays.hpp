// SPDX-License-Identifier: Apache-2.0
//
// The hard rays of the tests: those that the stress run has too.
#pragma once

#include "scene/generate.hpp"
#include "scene/hard_rays.hpp"
#include "support/random.hpp"

namespace zkd::test {

using scene::RayMaker;

}  // namespace zkd::test
