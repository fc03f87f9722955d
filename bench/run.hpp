// SPDX-License-Identifier: Apache-2.0
//
// One scene measured: all settings and peers, interleaved, on the same rays.
#pragma once

#include <vector>

#include <zkd/cpu/executor.hpp>

#include "options.hpp"
#include "results.hpp"
#include "scene/catalog.hpp"

namespace zkd::bench {

/// Loads the scene and measures every setting of `options`, one result each, in order.
///
/// Each repetition builds and traces each setting and each peer once, in turn (A B C A B C ...),
/// after one warm-up of each. Memory, tree quality, traversal cost and the check are measured in
/// builds of their own, outside of the times. Writes images if asked to.
///
/// `backend` (cpu or cuda) is where zkd builds and traces. On CUDA the CPU builds and traces too,
/// outside of the times, to be compared with. Pictures are drawn by the CPU, through the same tree.
///
/// Throws scene::LoadError, UsageError, Error, and std::runtime_error for images that cannot be
/// written.
[[nodiscard]] std::vector<Result> run_scene(const scene::SceneInfo& info, const Options& options,
                                            Backend backend, const cpu::Executor& executor);

}  // namespace zkd::bench
