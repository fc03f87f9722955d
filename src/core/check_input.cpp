// SPDX-License-Identifier: Apache-2.0
//
// The texts of errors in input: each names the offender and what would be right.
#include "core/check_input.hpp"

#include <cmath>
#include <string>

#include "core/trunks.hpp"

namespace zkd::core {
namespace {

[[noreturn]] void fail(ErrorCode code, std::uint64_t offender, const std::string& message) {
  throw Error(code, offender, message);
}

template <class Enum>
void check(Enum value, Enum last, const char* option) {
  check_enumerator(static_cast<std::int64_t>(value), static_cast<std::int64_t>(last), option);
}

void check_cost(float cost, const char* name) {
  if (!(cost >= 1.0F / 1024.0F && cost <= 1024.0F))
    fail(ErrorCode::invalid_option, 0,
         std::string(name) + " is " + std::to_string(cost) + "; it must be 1/1024 to 1024");
}

void check_ranges(const SahOptions& options) {
  check_cost(options.visit_cost, "sah.visit_cost");
  check_cost(options.test_cost, "sah.test_cost");
  check(options.areas, SahAreas::cells, "sah.areas");
  if (!(options.empty_bonus >= 0.0F && options.empty_bonus < 1.0F))
    fail(ErrorCode::invalid_option, 0,
         "sah.empty_bonus is " + std::to_string(options.empty_bonus) +
             "; it must be at least 0 and below 1");
}

void check_ranges(const BuildOptions& options) {
  check(options.builder, Builder::wu2011, "builder");
  check(options.quality, Quality::high, "quality");
  check(options.references, References::automatic, "references");
  check(options.invalid_triangles, InvalidTriangles::skip, "invalid_triangles");
  check(options.axis_order, AxisOrder::cyclic, "axis_order");
  check(options.backend, Backend::cuda, "backend");
  if (options.leaf_size > most_leaf_size)
    fail(ErrorCode::invalid_option, options.leaf_size,
         "leaf_size is " + std::to_string(options.leaf_size) +
             "; it must be 1 to 1024, or 0 for automatic");
  if (options.code_bits > 64)
    fail(ErrorCode::invalid_option, options.code_bits,
         "code_bits is " + std::to_string(options.code_bits) +
             "; it must be 1 to 64, or 0 for automatic");
  if (!std::isfinite(options.budget) || options.budget < 1.0F)
    fail(ErrorCode::invalid_option, 0,
         "budget is " + std::to_string(options.budget) + "; it must be finite and at least 1");
  if (options.reference_capacity > max_count)
    fail(ErrorCode::invalid_option, options.reference_capacity,
         "reference_capacity is " + std::to_string(options.reference_capacity) +
             "; a tree holds at most " + std::to_string(max_count));
  check_ranges(options.sah);
}

}  // namespace

void check_enumerator(std::int64_t value, std::int64_t last, const char* option) {
  if (value < 0 || value > last)
    fail(ErrorCode::invalid_option, static_cast<std::uint64_t>(value),
         std::string(option) + " has no enumerator " + std::to_string(value));
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
  check_ranges(options);
  if (builder_for(options) == Builder::sah)
    fail(ErrorCode::unsupported_option, 0,
         "builder sah (and quality high) is only there for builds on the CPU");
}

void check_predictable(const BuildOptions& options) {
  const Builder builder = builder_for(options);
  if (builder != Builder::morton)
    fail(ErrorCode::unsupported_option, 0,
         std::string("what builder ") + to_string(builder) +
             " takes is not known beforehand: memory_requirement is for others");
}

void check_cpu_options(const BuildOptions& options) { check_ranges(options); }

}  // namespace zkd::core
