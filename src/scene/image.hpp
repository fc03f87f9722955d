// SPDX-License-Identifier: Apache-2.0
//
// Pictures on disk.
#pragma once

#include <filesystem>
#include <glm/ext/vector_float3.hpp>
#include <span>

namespace zkd::scene {

/// Whether this program was built with OpenImageIO, without which write_png only throws.
[[nodiscard]] bool can_write_png() noexcept;

/// Writes an 8-bit sRGB PNG. `rgb` is linear light, row by row, row 0 on top; values outside
/// [0, 1] are clamped, NaN becomes 0. Folders that do not exist are made.
///
/// Throws std::invalid_argument when rgb.size() is not width * height or either is 0, and
/// std::runtime_error naming the file when it cannot be written.
void write_png(const std::filesystem::path& file, unsigned width, unsigned height,
               std::span<const glm::vec3> rgb);

/// A colour for x in [0, 1] (clamped; NaN is 0), from nearly black over violet and orange to pale
/// yellow: steadily lighter, so it orders values for colour-blind eyes and in grey print too. In
/// linear light, as write_png wants it.
[[nodiscard]] glm::vec3 heat(float x);

}  // namespace zkd::scene
