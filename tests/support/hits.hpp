// SPDX-License-Identifier: Apache-2.0
//
// Hits of whole spans, compared bit by bit.
#pragma once

#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/query.hpp>

#include "verify/hits.hpp"

namespace zkd {

/// How GoogleTest shows a policy, in failures and in the names of cases.
inline void PrintTo(References references, std::ostream* out) { *out << to_string(references); }

}  // namespace zkd

namespace zkd::test {

using verify::is_hit;
using verify::print;
using verify::same_bits;

inline Hit or_miss(const std::optional<Hit>& hit) { return hit.value_or(Hit{}); }

inline std::vector<Hit> closest(const TreeView& tree, const TriangleView& triangles,
                                std::span<const Ray> rays, const cpu::Executor& executor = {},
                                Intersector intersector = Intersector::watertight) {
  std::vector<Hit> hits(rays.size());
  closest_hit(executor, tree, triangles, rays, hits, {}, intersector);
  return hits;
}

inline std::vector<Hit> brute_force(const TreeView& tree, const TriangleView& triangles,
                                    std::span<const Ray> rays, const cpu::Executor& executor = {},
                                    Intersector intersector = Intersector::watertight) {
  std::vector<Hit> hits(rays.size());
  closest_hit_brute_force(executor, tree, triangles, rays, hits, intersector);
  return hits;
}

}  // namespace zkd::test
