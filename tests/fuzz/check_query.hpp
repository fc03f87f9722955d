// SPDX-License-Identifier: Apache-2.0
//
// What must hold for every ray through every tree.
#pragma once

#include <span>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>

#include "scene/mesh.hpp"

namespace zkd::fuzz {

/// Fails unless, for each ray and both kinds of references: every form of a query gives what brute
/// force gives, bit for bit; any hit is closest hit; the interval may be split anywhere; a triangle
/// that does not count changes nothing, and one that is not the answer changes nothing; and the
/// exact oracle has nothing to say against the answer outside the error band.
void check_queries(const scene::Mesh& mesh, const BuildOptions& options, std::span<const Ray> rays);

/// Fails unless rays on the lattice (bytes.hpp) whose longest component is a power of two, from not
/// far away, hit exactly what the oracle says, and of several triangles there the first: every
/// number on the way is exact.
void check_exactly(const scene::Mesh& mesh, const BuildOptions& options, std::span<const Ray> rays);

}  // namespace zkd::fuzz
