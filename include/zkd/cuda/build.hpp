// SPDX-License-Identifier: Apache-2.0
//
// Builds on a CUDA device. See zkd/build.hpp for what a build is: this is the same algorithm, from
// the same source, to the same bytes.
#pragma once

#include <cstdint>
#include <string>

#include <zkd/build.hpp>
#include <zkd/cuda/executor.hpp>
#include <zkd/cuda/tree.hpp>

namespace zkd {

/// Enqueues a build on `executor.stream` and returns: no synchronisation with the host, no copy
/// from the device. The tree has the same bytes as the CPU's for the same triangles and options.
///
/// `triangles` are in device memory, managed memory or host memory, indices and positions each for
/// itself; what lies in host memory (pinned or not) is copied to the device first, in the order of
/// the stream, and the copy belongs to the tree. All must stay unchanged until the device has done
/// the build. `options.backend` is not looked at.
///
/// Memory: the tree, for the most leaves that so many triangles can have, and a workspace unless
/// the executor brings one; nothing else is allocated. See memory_requirement(). The number of
/// kernels depends on counts and options only.
///
/// What the driver does by itself: it loads kernels when they are first launched, for which the
/// first build of a process may wait, and it keeps the stacks of all threads that fit on the
/// device, some 3 KB a thread once `all` has been built (0.8 GB on the largest devices), else 1 KB.
/// A build before the first frame, or before a capture, gets both over with.
///
/// Throws Error at once: what can be known beforehand (too_many_triangles, invalid_view,
/// invalid_option, unsupported_option), backend_unavailable, device_failure, out_of_memory; `all`
/// without a reference_capacity is invalid_option: see analyse(). What only the device can know is
/// thrown when the tree is asked: cuda::Tree::check().
///
/// Builder::wu2011 is otherwise: it waits for the device on every level, takes memory as it goes,
/// and throws all errors at once (BuildOptions::builder).
[[nodiscard]] ZKD_API cuda::Tree build(const cuda::Executor& executor,
                                       const TriangleView& triangles,
                                       const BuildOptions& options = {});

/// Builds `tree` again over other triangles, in the memory it has and with the options it has: for
/// geometry that moves. Same rules as build(). There may be no more triangles than the tree was
/// first built for, and host memory only where it was host memory then (likewise no more
/// positions): else invalid_view. Only for trees of Builder::morton (unsupported_option).
///
/// With an executor that brings a workspace nothing is allocated and nothing synchronised, so that
/// a CUDA graph can capture the call; each replay builds from what is in the arrays then. A capture
/// reads host memory at each replay.
///
/// If it throws device_failure half-way, the tree is in no state until it is rebuilt, and
/// cuda::Tree::check() says so; a capture that was open is still the caller's to end.
ZKD_API void rebuild(const cuda::Executor& executor, cuda::Tree& tree,
                     const TriangleView& triangles);

/// What only the scene decides, as fixed options to build with, again and again: reference_capacity
/// for `all`, exactly what these triangles need. Builds all but the references, waits, and gives
/// its memory back. Triangles that move may need more: leave a margin, and a wider one where the
/// scene may become uneven enough, or no longer, for `all` to make its cells from fragments
/// (Skip::splitting says which it was). For Builder::wu2011 there is nothing to find: it returns at
/// once.
///
/// Throws Error as build() and cuda::Tree::check().
[[nodiscard]] ZKD_API BuildOptions analyse(const cuda::Executor& executor,
                                           const TriangleView& triangles,
                                           const BuildOptions& options = {});

/// Bytes that build() allocates on this device for `triangle_count` triangles in device memory:
/// exactly these, whatever the scene. O(1), launches nothing. rebuild() needs workspace_bytes.
///
/// Throws Error as build(); unsupported_option for other builders than morton.
[[nodiscard]] ZKD_API MemoryRequirement memory_requirement(const cuda::Executor& executor,
                                                           std::uint64_t triangle_count,
                                                           const BuildOptions& options = {});

namespace cuda {

/// Whether a CUDA device answers that this library was compiled for. Where not, and `why` is given,
/// *why says so: no device, a driver that is too old, ... Makes no context. Never throws.
[[nodiscard]] ZKD_API bool available(std::string* why = nullptr) noexcept;

/// Copies a tree to the device, in the order of the stream; `tree` must stay until that is done.
/// `triangles` are what it was built from, in host or device memory: as for build().
///
/// Throws Error backend_unavailable, device_failure, out_of_memory.
[[nodiscard]] ZKD_API Tree to_device(const Executor& executor, const zkd::Tree& tree,
                                     const TriangleView& triangles);

}  // namespace cuda
}  // namespace zkd
