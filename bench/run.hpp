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
/// Throws scene::LoadError, UsageError, Error, and std::runtime_error for images that cannot be
/// written.
[[nodiscard]] std::vector<Result> run_scene(const scene::SceneInfo& info, const Options& options,
                                            const cpu::Executor& executor);

}  // namespace zkd::bench
