// SPDX-License-Identifier: Apache-2.0
//
// The texts of errors in input: each names the offender and what would be right.
#include "cpu/check_input.hpp"

#include <cmath>
#include <string>

namespace zkd::cpu {
namespace {

[[noreturn]] void fail(ErrorCode code, std::uint64_t offender, const std::string& message) {
  throw Error(code, offender, message);
}

template <class Enum>
void check_enumerator(Enum value, Enum last, const char* option) {
  const auto number = static_cast<std::int64_t>(value);
  if (number < 0 || number > static_cast<std::int64_t>(last))
    fail(ErrorCode::invalid_option, static_cast<std::uint64_t>(number),
         std::string(option) + " has no enumerator " + std::to_string(number));
}

[[noreturn]] void unsupported(const char* option, const char* value) {
  fail(ErrorCode::unsupported_option, 0,
       std::string(option) + " " + value + " is not in this version of zkd (" ZKD_VERSION ")");
}

}  // namespace

void check_executor(const Executor& executor) {
  if (executor.threads < 0)
    fail(ErrorCode::invalid_option, static_cast<std::uint64_t>(executor.threads),
         "threads is " + std::to_string(executor.threads) + "; it must not be negative");
  check_enumerator(executor.instructions, InstructionSet::avx2, "instructions");
}

void check_count(std::uint64_t triangle_count) {
  if (triangle_count > max_count)
    fail(ErrorCode::too_many_triangles, triangle_count,
         std::to_string(triangle_count) + " triangles; a tree takes at most " +
             std::to_string(max_count));
}

void check_view(const TriangleView& triangles) {
  check_count(triangles.triangle_count);
  const std::size_t stride = triangles.position_stride;
  if (stride < 3 * sizeof(float) || stride % sizeof(float) != 0)
    fail(ErrorCode::invalid_view, stride,
         "position_stride is " + std::to_string(stride) +
             " bytes; it must be a multiple of 4, at least 12");
  if (reinterpret_cast<std::uintptr_t>(triangles.positions) % alignof(float) != 0)
    fail(ErrorCode::invalid_view, 0, "positions are not aligned to 4 bytes");
  if (reinterpret_cast<std::uintptr_t>(triangles.indices) % alignof(std::uint32_t) != 0)
    fail(ErrorCode::invalid_view, 0, "indices are not aligned to 4 bytes");
  if (triangles.positions == nullptr && triangles.position_count != 0)
    fail(ErrorCode::invalid_view, triangles.position_count,
         "positions is null, but position_count is " + std::to_string(triangles.position_count));
  if (triangles.triangle_count == 0 || triangles.indices != nullptr) return;
  if (triangles.triangle_count > max_soup_count)
    fail(ErrorCode::too_many_triangles, triangles.triangle_count,
         std::to_string(triangles.triangle_count) + " triangles without indices; there may be " +
             std::to_string(max_soup_count) + ", whose positions 32 bits count");
  if (triangles.triangle_count * 3 != triangles.position_count)
    fail(ErrorCode::invalid_view, triangles.position_count,
         "a soup of " + std::to_string(triangles.triangle_count) + " triangles needs " +
             std::to_string(triangles.triangle_count * 3) + " positions, not " +
             std::to_string(triangles.position_count));
}

void check_options(const BuildOptions& options) {
  check_enumerator(options.builder, Builder::wu2011, "builder");
  check_enumerator(options.quality, Quality::high, "quality");
  check_enumerator(options.references, References::automatic, "references");
  check_enumerator(options.invalid_triangles, InvalidTriangles::skip, "invalid_triangles");
  check_enumerator(options.axis_order, AxisOrder::cyclic, "axis_order");
  check_enumerator(options.backend, Backend::cuda, "backend");
  if (options.leaf_size < 1 || options.leaf_size > 1024)
    fail(ErrorCode::invalid_option, options.leaf_size,
         "leaf_size is " + std::to_string(options.leaf_size) + "; it must be 1 to 1024");
  if (options.code_bits > 64)
    fail(ErrorCode::invalid_option, options.code_bits,
         "code_bits is " + std::to_string(options.code_bits) +
             "; it must be 1 to 64, or 0 for automatic");
  if (!std::isfinite(options.budget) || options.budget < 1.0F)
    fail(ErrorCode::invalid_option, 0,
         "budget is " + std::to_string(options.budget) + "; it must be finite and at least 1");
  if (options.builder != Builder::morton) unsupported("builder", to_string(options.builder));
  if (options.quality != Quality::fast) unsupported("quality", to_string(options.quality));
  if (options.references == References::budget || options.references == References::automatic)
    unsupported("references", to_string(options.references));
}

void check_report(const TriangleView& triangles, const core::ValidationReport& report,
                  InvalidTriangles invalid) {
  if (report.first_out_of_range != core::none_found) {
    const std::uint32_t first = report.first_out_of_range;
    int corner = 0;
    while (triangles.index(first, corner) < triangles.position_count) ++corner;
    fail(ErrorCode::index_out_of_range, first,
         "triangle " + std::to_string(first) + " has index " +
             std::to_string(triangles.index(first, corner)) + " at corner " +
             std::to_string(corner) + ", but there are " +
             std::to_string(triangles.position_count) + " positions");
  }
  if (report.non_finite != 0 && invalid == InvalidTriangles::error)
    fail(ErrorCode::non_finite_vertex, report.first_non_finite,
         "triangle " + std::to_string(report.first_non_finite) +
             " has a NaN or infinite coordinate (" + std::to_string(report.non_finite) +
             " such triangles; InvalidTriangles::skip leaves them out)");
}

}  // namespace zkd::cpu
