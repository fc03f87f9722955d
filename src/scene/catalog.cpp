// SPDX-License-Identifier: Apache-2.0
//
// The table of known scenes, the places they are looked for, and their manifests.
#include "scene/catalog.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "scene/load.hpp"
#include "scene/unpack.hpp"

namespace zkd::scene {

Camera camera_for(const SceneInfo& scene, const Mesh& mesh) {
  if (scene.camera) return *scene.camera;
  const Camera camera = fit_camera(bounds(mesh));
  for (int a = 0; a < 3; ++a)
    if (!std::isfinite(camera.eye[a]))
      throw LoadError(scene.path.string() +
                      ": no camera can see all of it: that would be farther away than a float is");
  return camera;
}

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct PaperRow {
  const char* scene = "";
  std::uint64_t triangles = 0;
  double ms = 0.0;
};

struct Known {
  std::string name;
  std::vector<std::string> stems;      // files that are the scene, without extension
  std::vector<std::string> stand_ins;  // files that stand for it
  PaperRow paper;
};

/// The paper's six first, in its order.
const std::vector<Known>& table() {
  static const std::vector<Known> known{
      {"bunny", {"bunny"}, {}, {"Bunny", 69451, 4.3}},
      {"fairy", {"fairy"}, {"fairy_standin"}, {"Fairy", 174117, 5.6}},
      {"conference", {"conference"}, {}, {"Conference", 282759, 5.9}},
      {"sibenik", {"sibenik"}, {}, {"Sibenik", 75284, 4.7}},
      {"dragon", {"dragon"}, {}, {"Dragon", 871414, 8.7}},
      {"buddha", {"buddha"}, {"happy_loop"}, {"Buddha", 1087716, 9.3}},
      {"sponza", {"sponza"}, {}, {}},
      {"armadillo", {"armadillo"}, {}, {}},
      {"teapot", {"teapot"}, {}, {}},
      {"dragon_res2", {"dragon_res2"}, {}, {}},
      {"happy_res3", {"happy_res3"}, {}, {}},
  };
  return known;
}

constexpr std::array<std::string_view, 6> extensions{".ply",  ".ply.zst", ".obj",
                                                     ".gltf", ".glb",     ".stl"};
constexpr const char* glmark2_bunny = "/usr/share/glmark2/models/bunny.obj";

bool contains(const std::vector<std::string>& list, const std::string& word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

/// A file's name without `.ply`, `.ply.zst` and the like.
std::string stem_of(const fs::path& file) {
  return (file.extension() == ".zst" ? file.stem() : file).stem().string();
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

fs::path shared_folder() {
  return (fs::path(ZKD_SOURCE_DIR) / ".." / "shared" / "scenes").lexically_normal();
}

std::vector<fs::path> folders() {
  std::vector<fs::path> result;
  if (const char* variable = std::getenv("ZKD_SCENES")) {
    std::string_view rest = variable;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(':'), rest.size());
      if (end > 0) result.emplace_back(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  result.push_back(fs::path(ZKD_SOURCE_DIR) / "scenes" / "data");
  result.push_back(shared_folder());
  return result;
}

// ---- Manifests ----------------------------------------------------------------------------------

/// The entry of a file in the MANIFEST.json beside it; null without one.
json manifest_entry(const fs::path& file) {
  const fs::path manifest = file.parent_path() / "MANIFEST.json";
  std::ifstream stream(manifest);
  if (!stream) return nullptr;
  const auto bare = [](fs::path name) {
    name = name.filename();
    return name.extension() == ".zst" ? name.stem() : name;
  };
  try {
    const json root = json::parse(stream);
    for (const json& entry : root.at("scenes")) {
      if (bare(entry.at("file").get<std::string>()) == bare(file)) return entry;
    }
  } catch (const json::parse_error& error) {
    throw LoadError(manifest.string() + ": byte " + std::to_string(error.byte) +
                    ": malformed JSON");
  } catch (const json::exception& error) {
    throw LoadError(manifest.string() + ": " + error.what());
  }
  return nullptr;
}

glm::vec3 vector_of(const json& numbers, const fs::path& manifest) {
  if (numbers.size() != 3) {
    throw LoadError(manifest.string() + ": a camera's vector has not 3 numbers");
  }
  return {numbers[0].get<float>(), numbers[1].get<float>(), numbers[2].get<float>()};
}

void read_manifest(SceneInfo& info, const fs::path& file) {
  const json entry = manifest_entry(file);
  if (entry.is_null()) return;
  const fs::path manifest = file.parent_path() / "MANIFEST.json";
  try {
    const std::string fidelity = entry.value("fidelity", "");
    info.stand_in = info.stand_in || fidelity.find("stand-in") != std::string::npos;
    if (!fidelity.empty() && fidelity != "exact") info.note = fidelity;
    if (entry.contains("camera") && !entry["camera"].is_null()) {
      const json& camera = entry["camera"];
      info.camera =
          Camera{vector_of(camera.at("eye"), manifest), vector_of(camera.at("look_at"), manifest),
                 vector_of(camera.at("up"), manifest), camera.at("vfov_deg").get<float>()};
    }
  } catch (const json::exception& error) {
    throw LoadError(manifest.string() + ": " + error.what());
  }
}

// ---- Finding ------------------------------------------------------------------------------------

/// What a file on disk is: `file` may be packed, and has to exist.
SceneInfo describe(const std::string& name, const fs::path& file, const Known* known) {
  SceneInfo info;
  info.name = name;
  if (known != nullptr) {
    info.stand_in = contains(known->stand_ins, stem_of(file));
    info.paper_scene = known->paper.scene;
    info.paper_triangles = known->paper.triangles;
    info.paper_ms = known->paper.ms;
  }
  read_manifest(info, file);
  const bool has_script =
      is_file(file.parent_path() / "unpack.sh") && is_file(file.parent_path() / "UNPACKED.sizes");
  info.path = file.extension() != ".zst" ? file
              : has_script               ? unpacked_by_script(file)
                                         : unpacked_file(file);
  return info;
}

/// The first file of a known scene in the order that catalog.hpp gives; empty without one.
fs::path locate(const Known& known) {
  std::vector<std::string> stems = known.stems;
  stems.insert(stems.end(), known.stand_ins.begin(), known.stand_ins.end());
  for (const fs::path& folder : folders()) {
    for (const std::string& stem : stems) {
      for (const std::string_view extension : extensions) {
        fs::path file = folder / (stem + std::string(extension));
        if (is_file(file)) return file;
      }
    }
  }
  return {};
}

bool looks_like_path(const std::string& text) {
  if (text.find('/') != std::string::npos) return true;
  const auto ends = [&text](std::string_view extension) { return text.ends_with(extension); };
  return std::any_of(extensions.begin(), extensions.end(), ends) || is_file(text);
}

SceneInfo find_known(const Known& known) {
  const fs::path file = locate(known);
  if (!file.empty()) return describe(known.name, file, &known);
  if (known.name == "bunny" && is_file(glmark2_bunny)) {
    SceneInfo info = describe(known.name, glmark2_bunny, &known);
    info.note = "the Stanford Bunny of Debian's glmark2-data, 69,666 triangles";
    return info;
  }
  std::string looked;
  for (const fs::path& folder : folders()) looked += " " + folder.string();
  throw LoadError("scene '" + known.name + "' is not here; looked in" + looked +
                  "; scenes/fetch downloads what is public");
}

std::vector<SceneInfo> find_all(std::vector<std::string>* problems, bool paper_only) {
  std::vector<SceneInfo> result;
  for (const Known& known : table()) {
    if (paper_only && known.paper.triangles == 0) continue;
    try {
      result.push_back(find_known(known));
    } catch (const LoadError& error) {
      if (problems != nullptr) problems->emplace_back(error.what());
    }
  }
  return result;
}

}  // namespace

const std::vector<std::string>& known_scenes() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const Known& known : table()) result.push_back(known.name);
    return result;
  }();
  return names;
}

SceneInfo find_scene(const std::string& name_or_path) {
  for (const Known& known : table()) {
    if (known.name == name_or_path || contains(known.stand_ins, name_or_path)) {
      return find_known(known);
    }
  }
  if (looks_like_path(name_or_path)) {
    const fs::path file = name_or_path;
    std::error_code error;
    if (!fs::exists(file, error)) throw LoadError(name_or_path + ": no such file");
    return describe(stem_of(file), file, nullptr);
  }
  std::string names;
  for (const std::string& name : known_scenes()) names += " " + name;
  throw LoadError("unknown scene '" + name_or_path + "'; a mesh file or one of:" + names);
}

std::vector<SceneInfo> list_scenes(std::vector<std::string>* problems) {
  return find_all(problems, false);
}

std::vector<SceneInfo> paper_scenes(std::vector<std::string>* problems) {
  return find_all(problems, true);
}

}  // namespace zkd::scene
