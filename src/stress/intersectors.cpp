// SPDX-License-Identifier: Apache-2.0
#include "stress/intersectors.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <zkd/query.hpp>

#include "verify/hits.hpp"
#include "verify/oracle.hpp"

namespace zkd::stress {
namespace {

using verify::is_hit;
using verify::print;
using verify::same_bits;

// Closest hits, which any hits are compared with.
std::vector<Hit> trace(const Case& which, const Tree& tree, std::span<const Ray> rays,
                       const cpu::Executor& executor, Intersector intersector, Findings& findings) {
  std::vector<Hit> hits(rays.size());
  std::vector<std::uint8_t> occluded(rays.size());
  closest_hit(executor, tree.view(), which.mesh.view(), rays, hits, {}, intersector);
  any_hit(executor, tree.view(), which.mesh.view(), rays, occluded, {}, intersector);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    findings.expect((occluded[i] != 0) == is_hit(hits[i]),
                    "any hit and closest hit disagree: ray " + print(rays[i]));
  }
  return hits;
}

// Whether t is the nearest float to a number of which `exact` is the nearest double. Half way
// between two floats that double does not tell which of them it is.
bool is_nearest_float(float t, double exact) {
  const auto twice_rounded = static_cast<double>(static_cast<float>(exact));
  const auto answered = static_cast<double>(t);
  return answered == twice_rounded || 0.5 * answered + 0.5 * twice_rounded == exact;
}

}  // namespace

void check_rounding_intersectors(const Case& which, const Tree& tree, std::span<const Ray> rays,
                                 std::span<const Hit> hits, const cpu::Executor& executor,
                                 Findings& findings) {
  for (const Intersector intersector :
       {Intersector::fast, Intersector::single_precision, Intersector::double_precision}) {
    findings.about(which.name + ", " + to_string(intersector));
    const std::vector<Hit> got = trace(which, tree, rays, executor, intersector, findings);
    std::vector<Hit> want(rays.size());
    closest_hit_brute_force(executor, tree.view(), which.mesh.view(), rays, want, intersector);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!same_bits(got[i], want[i])) {
        ++findings.different;
        findings.fail("not brute force's: " + print(got[i]) + " instead of " + print(want[i]) +
                      ", ray " + print(rays[i]));
      }
      findings.expect(
          intersector != Intersector::double_precision || same_bits(got[i], hits[i]),
          print(got[i]) + " instead of watertight's " + print(hits[i]) + ", ray " + print(rays[i]));
    }
  }
  findings.about(which.name);
}

void check_exact_intersector(const Case& which, const Tree& tree, const verify::Oracle& oracle,
                             std::span<const Ray> rays, const cpu::Executor& executor,
                             Findings& findings) {
  findings.about(which.name + ", " + to_string(Intersector::exact));
  const std::vector<Hit> got = trace(which, tree, rays, executor, Intersector::exact, findings);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const verify::ExactHit want = oracle.closest_hit(rays[i]);
    // A t that no float holds is none.
    const bool hit = want.hit && std::isfinite(static_cast<float>(want.t));
    const bool same =
        hit ? got[i].triangle == want.ties.front() && is_nearest_float(got[i].t, want.t)
            : !is_hit(got[i]);
    findings.expect(same, print(got[i]) + " instead of " +
                              (hit ? "triangle " + std::to_string(want.ties.front()) +
                                         " at t = " + std::to_string(want.t)
                                   : std::string("a miss")) +
                              ", ray " + print(rays[i]));
  }
  findings.about(which.name);
}

}  // namespace zkd::stress
