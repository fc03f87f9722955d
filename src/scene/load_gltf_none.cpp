// SPDX-License-Identifier: Apache-2.0
//
// glTF in a build without Assimp: one clear error.
#include "scene/source_file.hpp"

namespace zkd::scene {

bool can_read_gltf() noexcept { return false; }

Mesh load_gltf(const SourceFile& file, Progress&) {
  file.fail(
      "glTF is read by Assimp, which this program was built without "
      "(Debian and Ubuntu: libassimp-dev)");
}

}  // namespace zkd::scene
