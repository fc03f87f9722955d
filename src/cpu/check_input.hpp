// SPDX-License-Identifier: Apache-2.0
//
// What is checked before and right after validation, for builds and for single stages.
#pragma once

#include <cstdint>

#include <zkd/cpu/executor.hpp>
#include <zkd/error.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>

#include "core/validate.hpp"

namespace zkd::cpu {

/// Throws Error invalid_option.
void check_executor(const Executor& executor);

/// Throws Error invalid_view or too_many_triangles.
void check_view(const TriangleView& triangles);

/// Throws Error too_many_triangles.
void check_count(std::uint64_t triangle_count);

/// Throws Error invalid_option or unsupported_option.
void check_options(const BuildOptions& options);

/// Throws Error index_out_of_range, or non_finite_vertex unless they are to be skipped.
void check_report(const TriangleView& triangles, const core::ValidationReport& report,
                  InvalidTriangles invalid);

}  // namespace zkd::cpu
