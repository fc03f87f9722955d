// SPDX-License-Identifier: Apache-2.0
//
// What the intersectors beside the default one are held to.
#pragma once

#include <span>

#include "stress/case.hpp"

namespace zkd::verify {
class Oracle;
}

namespace zkd::stress {

/// Every intersector that rounds: closest hit through the tree is that of a loop over all triangles
/// bit by bit, and any hit agrees; `double_precision` gives `hits`, the answers of `watertight`.
void check_rounding_intersectors(const Case& which, const Tree& tree, std::span<const Ray> rays,
                                 std::span<const Hit> hits, const cpu::Executor& executor,
                                 Findings& findings);

/// `exact` gives the oracle's answers: the lowest id of the tie set, t rounded once.
void check_exact_intersector(const Case& which, const Tree& tree, const verify::Oracle& oracle,
                             std::span<const Ray> rays, const cpu::Executor& executor,
                             Findings& findings);

}  // namespace zkd::stress
