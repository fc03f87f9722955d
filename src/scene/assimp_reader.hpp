// SPDX-License-Identifier: Apache-2.0
//
// A file read by Assimp exactly as it is. Private to the loaders.
#pragma once

#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "scene/source_file.hpp"

namespace zkd::scene {

/// Reads `file` with no post-processing at all: nothing joined, sorted, removed or triangulated.
/// The scene belongs to `importer`. Throws LoadError with Assimp's words.
[[nodiscard]] inline const aiScene& read_with_assimp(Assimp::Importer& importer,
                                                     const SourceFile& file) {
  const aiScene* const scene = importer.ReadFile(file.path().string(), 0);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    const std::string words = importer.GetErrorString();
    file.fail("Assimp: " + words.substr(0, words.find('\n')));
  }
  if ((scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE) != 0) file.fail("Assimp read only a part of it");
  return *scene;
}

}  // namespace zkd::scene
