// SPDX-License-Identifier: Apache-2.0
//
// What must hold for every build: the properties of the tree, one hash in every way to build it,
// one clear error where memory is refused.
#pragma once

#include <cstdint>
#include <string>

#include <zkd/options.hpp>
#include <zkd/tree.hpp>

#include "scene/mesh.hpp"

namespace zkd::fuzz {

/// Fails unless `tree`, built with `options` from `mesh`, has all properties: those of
/// verify::check_tree, the lattice's, and what the statistics count.
void check_properties(const Tree& tree, const scene::Mesh& mesh);

/// Fails unless every number of threads, every instruction set, another build, the stages one by
/// one, permuted faces (by `seed`) and additional invalid triangles give the tree that `tree` is.
/// options.invalid_triangles must be `skip`.
void check_same(const Tree& tree, const scene::Mesh& mesh, const BuildOptions& options,
                std::uint64_t seed);

/// Fails unless a build whose allocation number `refused` (from 1) is refused, if there is one, is
/// one error and gives everything back, and unless Morton builds keep to memory_requirement.
void check_memory(const scene::Mesh& mesh, const BuildOptions& options, std::uint32_t refused);

}  // namespace zkd::fuzz
