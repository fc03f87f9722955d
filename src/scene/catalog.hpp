// SPDX-License-Identifier: Apache-2.0
//
// Scenes by name: where they are on this machine, what they stand for, where the camera is.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/camera.hpp"
#include "scene/mesh.hpp"

namespace zkd::scene {

/// One scene as found on this machine.
struct SceneInfo {
  std::string name;                   ///< as asked for: `bunny`, or a file's stem
  std::filesystem::path path;         ///< a mesh file that load_mesh reads
  bool stand_in = false;              ///< not the mesh of the paper: must be said with its numbers
  std::string note;                   ///< what it is, in words; empty if there is nothing to say
  std::string paper_scene;            ///< `Bunny`, ... as in the paper's table; empty if not in it
  std::uint64_t paper_triangles = 0;  ///< triangles in the paper's table; 0 if not in it
  double paper_ms = 0.0;              ///< the paper's build time on a GTX 580; 0 if not in it
  std::optional<Camera> camera;       ///< from the manifest; see camera_for
};

/// The scene's camera, or one that has all of `mesh` in view. Throws LoadError where that would
/// stand beyond the range of float.
[[nodiscard]] Camera camera_for(const SceneInfo& scene, const Mesh& mesh);

/// The names find_scene knows, whether or not their files are here.
[[nodiscard]] const std::vector<std::string>& known_scenes();

/// Finds a scene by name, or takes a path to a mesh file.
///
/// Looked for in order: a path as given (anything with a directory or a known extension);
/// `$ZKD_SCENES` (a folder, or several separated by ':'); scenes/data of the source tree;
/// ../shared/scenes beside the source tree; the bunny of Debian's glmark2-data. Files may be
/// packed with zstd (`.ply.zst`): they are unpacked into the build folder on first use, by the
/// program `zstd`; several processes may do so at once.
///
/// Throws LoadError for a name that is not known (naming those that are), or whose file is not
/// here (saying where was looked).
[[nodiscard]] SceneInfo find_scene(const std::string& name_or_path);

/// Every known scene that is here. One that is not is left out; `problems`, if given, gets the
/// reason, a line for each.
[[nodiscard]] std::vector<SceneInfo> list_scenes(std::vector<std::string>* problems = nullptr);

/// Those of the paper's table that are here, in its order: bunny fairy conference sibenik dragon
/// buddha.
[[nodiscard]] std::vector<SceneInfo> paper_scenes(std::vector<std::string>* problems = nullptr);

}  // namespace zkd::scene
