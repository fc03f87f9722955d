// SPDX-License-Identifier: Apache-2.0
//
// What every backend checks before it begins, for builds and for single stages.
#pragma once

#include <cstdint>

#include <zkd/error.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>

namespace zkd::core {

/// Throws Error invalid_view or too_many_triangles.
ZKD_API void check_view(const TriangleView& triangles);

/// Throws Error too_many_triangles.
ZKD_API void check_count(std::uint64_t triangle_count);

/// The builder that makes the tree: Quality::high hands over to Builder::sah.
[[nodiscard]] constexpr Builder builder_for(const BuildOptions& options) {
  return options.builder == Builder::morton && options.quality == Quality::high ? Builder::sah
                                                                                : options.builder;
}

/// The options with what was left to zkd filled in, as far as the scene does not matter.
[[nodiscard]] constexpr BuildOptions settled(const BuildOptions& options) {
  BuildOptions all = options;
  all.builder = builder_for(options);
  if (all.leaf_size == 0) all.leaf_size = options.references == References::all ? 12 : 4;
  return all;
}

/// For the builders that run over the verbs, on any backend. Throws Error invalid_option or
/// unsupported_option.
ZKD_API void check_options(const BuildOptions& options);

/// For every builder that the CPU has. Throws likewise.
void check_cpu_options(const BuildOptions& options);

/// For those whose memory is known beforehand. Throws Error unsupported_option.
ZKD_API void check_predictable(const BuildOptions& options);

/// Throws Error invalid_option where `value` is no enumerator of an enumeration that ends in
/// `last`.
ZKD_API void check_enumerator(std::int64_t value, std::int64_t last, const char* option);

}  // namespace zkd::core
