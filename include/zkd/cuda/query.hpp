// SPDX-License-Identifier: Apache-2.0
//
// Rays through a tree in device memory. The rules and the answers are those of zkd/query.hpp, bit
// for bit. To trace from inside a kernel see zkd/cuda/device.hpp.
#pragma once

#include <cstdint>
#include <span>

#include <zkd/config.hpp>
#include <zkd/cuda/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/query.hpp>
#include <zkd/tree.hpp>

namespace zkd {

/// closest_hit for each ray. All spans and views are device memory: `tree` is cuda::Tree::view(),
/// `triangles` cuda::Tree::triangles(). hits[i] belongs to rays[i]. Enqueued on the executor's
/// stream; returns at once. Allocates nothing; may be captured in a graph. Everything must stay,
/// and rays, tree and triangles unchanged, until the stream has come past it.
///
/// `hits` (and `costs`, unless empty) should be as long as `rays`; a shorter one ends the work at
/// its length. Spans must not overlap. A thread traces one ray, so neighbouring rays should be
/// alike. Throws Error unsupported_option (Intersector::exact, which only the host has),
/// backend_unavailable, device_failure for what is known at the call; what
/// fails on the device comes up where the stream is waited for.
ZKD_API void closest_hit(const cuda::Executor& executor, const TreeView& tree,
                         const TriangleView& triangles, std::span<const Ray> rays,
                         std::span<Hit> hits, std::span<TraversalCost> costs = {},
                         Intersector intersector = Intersector::watertight);

/// any_hit for each ray: occluded[i] is 1 if rays[i] hits anything, else 0. As above otherwise.
ZKD_API void any_hit(const cuda::Executor& executor, const TreeView& tree,
                     const TriangleView& triangles, std::span<const Ray> rays,
                     std::span<std::uint8_t> occluded, std::span<TraversalCost> costs = {},
                     Intersector intersector = Intersector::watertight);

/// The first `hits_per_ray` hits of each ray, from near to far: see closest_hits of zkd/hits.hpp,
/// whose places and lengths are the same (`counts` and `costs` may be empty). As above otherwise.
/// For all hits of a ray, however many, call device::for_each_hit in a kernel of your own.
ZKD_API void closest_hits(const cuda::Executor& executor, const TreeView& tree,
                          const TriangleView& triangles, std::span<const Ray> rays,
                          std::uint32_t hits_per_ray, std::span<Hit> hits,
                          std::span<std::uint32_t> counts = {}, std::span<TraversalCost> costs = {},
                          Intersector intersector = Intersector::watertight);

/// The answers of closest_hit by a loop over all triangles; see zkd/query.hpp. As above otherwise.
ZKD_API void closest_hit_brute_force(const cuda::Executor& executor, const TreeView& tree,
                                     const TriangleView& triangles, std::span<const Ray> rays,
                                     std::span<Hit> hits,
                                     Intersector intersector = Intersector::watertight);

}  // namespace zkd
