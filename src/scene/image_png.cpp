// SPDX-License-Identifier: Apache-2.0
//
// PNG through OpenImageIO, which is loaded when the first picture is written: with all that it is
// linked to, that takes longer than many a run of a tool.
#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "scene/image.hpp"
#include "scene/png_writer.hpp"

namespace zkd::scene {
namespace {

using Writer = decltype(&zkd_write_png);

/// Stays loaded; null if it could not be.
Writer png_writer() {
  static const Writer writer = [] {
    void* const library = dlopen(ZKD_PNG_WRITER, RTLD_NOW | RTLD_LOCAL);
    void* const found = library != nullptr ? dlsym(library, "zkd_write_png") : nullptr;
    return reinterpret_cast<Writer>(found);
  }();
  return writer;
}

/// [0, 1], NaN as 0.
float clamped(float x) { return x > 0.0F ? std::min(x, 1.0F) : 0.0F; }

std::uint8_t to_srgb(float linear) {
  const float x = clamped(linear);
  const float encoded = x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1.0F / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(encoded * 255.0F + 0.5F);
}

}  // namespace

bool can_write_png() noexcept { return true; }

void write_png(const std::filesystem::path& file, unsigned width, unsigned height,
               std::span<const glm::vec3> rgb) {
  if (width == 0 || height == 0 || rgb.size() != std::size_t{width} * height) {
    throw std::invalid_argument(file.string() + ": " + std::to_string(rgb.size()) +
                                " pixels for an image of " + std::to_string(width) + " x " +
                                std::to_string(height));
  }
  if (file.has_parent_path()) {
    std::error_code error;
    std::filesystem::create_directories(file.parent_path(), error);
    if (error) throw std::runtime_error(file.string() + ": " + error.message());
  }

  std::vector<std::uint8_t> pixels;
  pixels.reserve(3 * rgb.size());
  for (const glm::vec3& colour : rgb) {
    for (int channel = 0; channel < 3; ++channel) pixels.push_back(to_srgb(colour[channel]));
  }

  char error[256] = "";
  const Writer write = png_writer();
  if (write == nullptr)
    throw std::runtime_error(file.string() + ": cannot be written: " ZKD_PNG_WRITER
                                             " could not be loaded");
  if (!write(file.c_str(), width, height, pixels.data(), error, sizeof error))
    throw std::runtime_error(file.string() + ": cannot be written: " + error);
}

}  // namespace zkd::scene
