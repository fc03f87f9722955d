// SPDX-License-Identifier: Apache-2.0
//
// What must hold for every ray through every tree.
#pragma once

#include <span>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>

#include "scene/mesh.hpp"

namespace zkd::fuzz {

/// Fails unless, for each ray and every intersector: every form of a query gives what brute force
/// gives, bit for bit; any hit is closest hit; the interval may be split anywhere; a triangle that
/// does not count changes nothing, and neither does one that is not the answer; a ray that is
/// spawned at the hit does not hit the same triangle again. And unless `double_precision` is
/// `watertight`, `exact` is the exact oracle, and the oracle has nothing to say against any of them
/// outside its error band. Of many rays through many triangles only the first are shot.
void check_queries(const scene::Mesh& mesh, const BuildOptions& options, std::span<const Ray> rays);

/// Fails unless rays on the lattice (bytes.hpp) whose longest component is a power of two, from not
/// far away, hit exactly what the oracle says by `watertight`, and of several triangles there the
/// first: every number on the way is exact.
void check_exactly(const scene::Mesh& mesh, const BuildOptions& options, std::span<const Ray> rays);

}  // namespace zkd::fuzz
