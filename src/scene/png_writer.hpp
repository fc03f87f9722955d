// SPDX-License-Identifier: Apache-2.0
//
// What image_png.cpp loads: a library of its own, for what it needs.
#pragma once

#include <cstddef>
#include <cstdint>

extern "C" {

/// Writes height rows of width times three bytes, sRGB, as a PNG. False: not all of it; one line of
/// why is in `error`, cut to its size.
[[gnu::visibility("default")]] bool zkd_write_png(const char* file, unsigned width, unsigned height,
                                                  const std::uint8_t* rgb, char* error,
                                                  std::size_t error_size) noexcept;
}
