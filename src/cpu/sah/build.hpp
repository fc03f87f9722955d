// SPDX-License-Identifier: Apache-2.0
//
// Builder::sah, start to end.
#pragma once

#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/tree.hpp>

namespace zkd::cpu::sah {

/// zkd::build() for Builder::sah; options, view and executor have been checked. Its statistics lack
/// total_ms.
Tree build(const Executor& executor, const TriangleView& triangles, const BuildOptions& options);

}  // namespace zkd::cpu::sah
