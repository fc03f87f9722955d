// SPDX-License-Identifier: Apache-2.0
#include "stress/hits_in_order.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <zkd/hits.hpp>

#include "verify/hits.hpp"

namespace zkd::stress {
namespace {

using verify::print;
using verify::same_bits;

// Where a ray has more hits, the first so many are looked at: more than are kept on a device, fewer
// than on the host, whose walks the tests see begin again.
constexpr std::uint32_t places = 24;

// Triangles that all loops of a case test.
constexpr std::uint64_t most_tests = 5'000'000;

struct Lists {
  std::vector<Hit> hits;
  std::vector<std::uint32_t> counts;

  explicit Lists(std::size_t rays) : hits(rays * places), counts(rays) {}
};

void compare(const Lists& got, const Lists& want, std::span<const Ray> rays, Findings& findings) {
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto list = [&](const Lists& lists) { return lists.hits.begin() + i * places; };
    const auto pair = std::mismatch(list(got), list(got) + places, list(want), same_bits);
    if (pair.first == list(got) + places && got.counts[i] == want.counts[i]) continue;
    ++findings.different;
    const auto at = std::min<std::ptrdiff_t>(pair.first - list(got), places - 1);
    findings.fail("not brute force's, hit " + std::to_string(at) + " of " +
                  std::to_string(got.counts[i]) + " in order: " + print(list(got)[at]) +
                  " instead of " + print(list(want)[at]) + " of " + std::to_string(want.counts[i]) +
                  ", ray " + print(rays[i]));
  }
}

}  // namespace

void check_hits_in_order(const Case& which, std::span<const Tree* const> trees,
                         std::span<const Ray> rays, std::span<const Hit> hits,
                         const cpu::Executor& executor, Findings& findings) {
  const TriangleView triangles = which.mesh.view();
  for (const Intersector intersector :
       {Intersector::watertight, Intersector::fast, Intersector::single_precision,
        Intersector::double_precision, Intersector::exact}) {
    findings.about(which.name + ", " + to_string(intersector));
    // The one that most will use has the most tries; exact arithmetic is slow.
    const std::uint64_t share = intersector == Intersector::watertight ? 2
                                : intersector == Intersector::exact    ? 40
                                                                       : 8;
    const std::uint64_t a_ray = std::max<std::uint64_t>(triangles.triangle_count, 1) * places;
    const std::uint64_t most = std::max<std::uint64_t>(most_tests / share / a_ray, 1);
    // Odd: kinds of rays come in turn, and all should be met.
    const std::size_t stride = ((rays.size() + most - 1) / most) | 1u;
    std::vector<Ray> some;
    std::vector<Hit> closest;
    for (std::size_t i = 0; i < rays.size(); i += stride) {
      some.push_back(rays[i]);
      closest.push_back(hits[i]);
    }
    Lists want(some.size());
    closest_hits_brute_force(executor, trees[0]->view(), triangles, some, places, want.hits,
                             want.counts, intersector);
    for (const Tree* tree : trees) {
      Lists got(some.size());
      closest_hits(executor, tree->view(), triangles, some, places, got.hits, got.counts, {},
                   intersector);
      compare(got, want, some, findings);
    }
    if (intersector != Intersector::watertight) continue;
    for (std::size_t i = 0; i < some.size(); ++i) {
      findings.expect(same_bits(want.hits[i * places], closest[i]),
                      "the first hit, " + print(want.hits[i * places]) + ", is not the closest, " +
                          print(closest[i]) + ", ray " + print(some[i]));
    }
  }
  findings.about(which.name);
}

}  // namespace zkd::stress
