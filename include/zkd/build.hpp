// SPDX-License-Identifier: Apache-2.0
//
// From triangles to a tree that rays can walk.
#pragma once

#include <cstddef>
#include <cstdint>

#include <zkd/config.hpp>
#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/tree.hpp>

namespace zkd {

/// Builds a kd-tree over `triangles`: by default that of Li, Wang, Deng (Fully Parallel Kd-Tree
/// Construction for Real-Time Ray Tracing, I3D 2014); see BuildOptions::builder.
///
/// options.backend says where: `automatic` takes CUDA if the program links zkd::cuda and a device
/// answers, else the CPU, and Tree::options().backend says which it was. Either way triangles are
/// in host memory and the tree is too; zkd/cuda/build.hpp leaves it on the device.
///
/// Blocks until the tree is finished. For given triangles and options the tree has the same bytes
/// on every backend, instruction set and thread count; for permuted triangles it is the same tree
/// with ids mapped, up to the order of ids within a leaf. No triangles, or none valid, is a valid
/// empty tree.
///
/// Work for n triangles: with `once` O(n * leaf_size), plus O(log n) a leaf (the sort has a fixed
/// number of digits); with `all` O((n + references) * depth). Builder::sah (Wald, Havran: On
/// building fast kd-Trees for Ray Tracing, and on doing that in O(N log N), RT 2006): O(n log n) as
/// long as few triangles lie across each plane, else O((n + references) * depth). Its memory is not
/// bounded beforehand; it takes at most 2^30 - 1 valid triangles (too_many_triangles). wu2011: as
/// much, and a sort of the events that clipping makes on each level; 2^31 / 6 references a level.
///
/// Throws Error: index_out_of_range, non_finite_vertex, too_many_triangles, too_many_references,
/// invalid_view, invalid_option, unsupported_option, backend_unavailable, out_of_memory; and on
/// CUDA reference_capacity (if the option is not 0) and device_failure. When it throws, everything
/// allocated has been returned.
[[nodiscard]] ZKD_API Tree build(const TriangleView& triangles, const BuildOptions& options = {});

/// The same, on these threads and out of this memory. `options.backend` is not looked at.
[[nodiscard]] ZKD_API Tree build(const cpu::Executor& executor, const TriangleView& triangles,
                                 const BuildOptions& options = {});

/// Memory that a build takes at most, in bytes.
struct MemoryRequirement {
  std::size_t tree_bytes = 0;       ///< the finished tree
  std::size_t workspace_bytes = 0;  ///< besides, until build returns
};

/// What build() allocates at most from its memory resource for `triangle_count` triangles, whatever
/// the scene: a resource that holds tree_bytes + workspace_bytes is never exhausted. Scenes without
/// crowded trunks take less. For References::all the number of references is not known beforehand:
/// pass a bound (or a guess) in `reference_count`. For other builders than
/// morton nothing is known beforehand.
/// O(1).
///
/// Throws Error invalid_option, unsupported_option (other builders too), too_many_triangles.
[[nodiscard]] ZKD_API MemoryRequirement memory_requirement(const cpu::Executor& executor,
                                                           std::uint64_t triangle_count,
                                                           const BuildOptions& options = {},
                                                           std::uint64_t reference_count = 0);

}  // namespace zkd
