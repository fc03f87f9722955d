// SPDX-License-Identifier: Apache-2.0
//
// PNG in a build without OpenImageIO: one clear error.
#include <stdexcept>

#include "scene/image.hpp"

namespace zkd::scene {

bool can_write_png() noexcept { return false; }

void write_png(const std::filesystem::path& file, unsigned, unsigned, std::span<const glm::vec3>) {
  throw std::runtime_error(file.string() +
                           ": cannot be written: this program was built without OpenImageIO "
                           "(Debian and Ubuntu: libopenimageio-dev)");
}

}  // namespace zkd::scene
