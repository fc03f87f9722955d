// SPDX-License-Identifier: Apache-2.0
//
// What all hits of a ray, in order, are held to.
#pragma once

#include <span>

#include "stress/case.hpp"

namespace zkd::stress {

/// Through every tree, and with every intersector: the first hits of a sample of the rays are those
/// of a loop over all triangles, bit by bit, the first of them `hits`, the answers of closest_hit.
void check_hits_in_order(const Case& which, std::span<const Tree* const> trees,
                         std::span<const Ray> rays, std::span<const Hit> hits,
                         const cpu::Executor& executor, Findings& findings);

}  // namespace zkd::stress
