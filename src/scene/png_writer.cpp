// SPDX-License-Identifier: Apache-2.0
#include "scene/png_writer.hpp"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <exception>
#include <string>

namespace {

// Nothing if it was written, or why not.
std::string write(const char* file, unsigned width, unsigned height, const std::uint8_t* rgb) {
  // By format, not by name: the file is a PNG whatever it is called.
  const auto output = OIIO::ImageOutput::create("png");
  if (!output) return OIIO::geterror() + "\n";
  OIIO::ImageSpec spec(static_cast<int>(width), static_cast<int>(height), 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  const bool written = output->open(file, spec) &&
                       output->write_image(OIIO::TypeDesc::UINT8, rgb) && output->close();
  return written ? std::string() : output->geterror() + "\n";
}

}  // namespace

bool zkd_write_png(const char* file, unsigned width, unsigned height, const std::uint8_t* rgb,
                   char* error, std::size_t error_size) noexcept {
  std::string why;
  try {
    why = write(file, width, height, rgb);
  } catch (const std::exception& thrown) {
    why = std::string(thrown.what()) + "\n";
  }
  const std::string line = why.substr(0, std::min(why.find('\n'), error_size - 1));
  std::copy(line.begin(), line.end(), error);
  error[line.size()] = '\0';
  return why.empty();
}
