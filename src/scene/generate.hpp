// SPDX-License-Identifier: Apache-2.0
//
// Meshes and rays made from a number: the hard cases that tests and the stress run name.
//
// Everything here gives the same bits on every machine: integer random numbers, no libm but the
// square root, no contraction (this library is compiled so). n is the number of triangles unless
// said otherwise, and may be 0 where no minimum is given; a count that is out of range throws
// std::invalid_argument.
#pragma once

#include <cstdint>
#include <vector>

#include <zkd/geometry.hpp>

#include "scene/mesh.hpp"

namespace zkd::scene {

// ---- Meshes -------------------------------------------------------------------------------------

/// Small random triangles in the unit cube, edges of about n^-1/3, no vertex shared.
[[nodiscard]] Mesh soup(std::uint32_t n, std::uint64_t seed);

/// Walls between the cells of a cube of n * n * n cells of side 2^-3: every wall lies exactly on a
/// plane a lattice would use. 6 (n + 1) n^2 triangles, n <= 700.
[[nodiscard]] Mesh grid(std::uint32_t n);

/// A closed icosphere of radius 1 round 0: 20 * 4^subdivisions triangles, vertices shared,
/// outward counter-clockwise. subdivisions <= 12.
[[nodiscard]] Mesh sphere(std::uint32_t subdivisions);

/// Triangles in the unit cube whose length is `aspect` times their width, in any direction.
[[nodiscard]] Mesh slivers(std::uint32_t n, float aspect, std::uint64_t seed);

/// The same triangle n times (the same three vertices).
[[nodiscard]] Mesh identical(std::uint32_t n);

/// Different triangles of sizes 2^-10 to 1 whose boxes all have their centre at 0 exactly.
[[nodiscard]] Mesh same_centre(std::uint32_t n, std::uint64_t seed);

/// Random triangles in the plane axis = 0.5 (axis 0, 1, 2) of the unit cube.
[[nodiscard]] Mesh flat(std::uint32_t n, int axis, std::uint64_t seed);

/// Long thin triangles along the diagonals of the unit cube: each box is nearly the whole scene.
[[nodiscard]] Mesh needles(std::uint32_t n, std::uint64_t seed);

/// The teapot in a stadium: 12 large triangles, a cube of side `ratio`, and n small ones in a unit
/// cube somewhere inside.
[[nodiscard]] Mesh small_in_large(std::uint32_t n, float ratio, std::uint64_t seed);

/// A closed cone: n triangles round one vertex. 3 <= n.
[[nodiscard]] Mesh fan(std::uint32_t n);

/// levels + 1 tiny triangles whose Morton codes are 0, 1, 10, 100, ... on a lattice of the unit
/// cube: each shares a longer prefix with 0 than the last, so the tree is as deep as `levels`
/// allows. Codes of 63 bits tell the first 63 levels apart; the rest crowd at 0. levels <= 300.
[[nodiscard]] Mesh staircase(std::uint32_t levels);

/// Coordinates of random bits (NaN, infinity, denormals among them), indices in range.
[[nodiscard]] Mesh random_bits(std::uint32_t n, std::uint64_t seed);

/// `mesh` moved by `by`, each coordinate rounded once.
[[nodiscard]] Mesh offset(Mesh mesh, glm::vec3 by);

/// `mesh` times 2^exponent: exact unless a coordinate leaves the range of float.
[[nodiscard]] Mesh scaled(Mesh mesh, int exponent);

/// The faces of `mesh` in random order: face i is face permutation[i] of `mesh`.
[[nodiscard]] Mesh shuffled(Mesh mesh, std::uint64_t seed,
                            std::vector<std::uint32_t>* permutation = nullptr);

/// Both meshes in one, the faces of `first` first.
[[nodiscard]] Mesh joined(Mesh first, const Mesh& second);

// ---- Rays ---------------------------------------------------------------------------------------

/// Rays from random points in twice the box to random points in it; directions not normalised.
/// An empty box is taken as the unit cube.
[[nodiscard]] std::vector<Ray> random_rays(const Box& box, std::uint32_t n, std::uint64_t seed);

/// Rays from random points in twice the box of `mesh`, aimed in turn at a vertex, a point of an
/// edge, a point inside a triangle, and a vertex moved by 1 to 8 ulp on each axis. The mesh must
/// have faces.
[[nodiscard]] std::vector<Ray> rays_at_features(const Mesh& mesh, std::uint32_t n,
                                                std::uint64_t seed);

/// Axis-parallel rays, along and against each axis, that go through a vertex exactly or pass it
/// by 1 ulp; the other two components of the direction are +0 or -0 at random. The mesh must have
/// faces.
[[nodiscard]] std::vector<Ray> axis_rays(const Mesh& mesh, std::uint32_t n, std::uint64_t seed);

}  // namespace zkd::scene
