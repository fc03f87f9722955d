// SPDX-License-Identifier: Apache-2.0
//
// Fuzz targets of the loaders: a file of any bytes is a mesh whose every index and coordinate is in
// range, or a LoadError of one line that begins with the file's name. Compiled once for each
// extension, ZKD_FUZZ_EXTENSION; bytes that begin as a GLB file are one.
#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "fuzz/fail.hpp"
#include "scene/load.hpp"

namespace zkd::fuzz {
namespace {

// A folder of this process, gone with it.
class Folder {
 public:
  Folder() : path_(parent() / ("zkd-fuzz-" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] std::filesystem::path write(std::string_view name, std::string_view bytes) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream stream(file, std::ios::binary);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    require(stream.good(), "the file for the input cannot be written");
    return file;
  }

 private:
  // In memory where that can be had: a file is written for every input.
  static std::filesystem::path parent() {
    return access("/dev/shm", W_OK) == 0 ? std::filesystem::path("/dev/shm")
                                         : std::filesystem::temp_directory_path();
  }

  std::filesystem::path path_;
};

void check(const scene::Mesh& mesh) {
  require(!mesh.faces.empty(), "a mesh without triangles");
  for (const glm::vec3& p : mesh.positions) {
    require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z),
            "a coordinate that is not finite");
  }
  for (const glm::uvec3& f : mesh.faces) {
    require(
        f.x < mesh.positions.size() && f.y < mesh.positions.size() && f.z < mesh.positions.size(),
        "an index out of range");
  }
}

void check(const scene::LoadError& error, const std::string& file) {
  const std::string words = error.what();
  if (words.compare(0, file.size() + 1, file + ":") != 0) fail("an error without a file: " + words);
  for (const char c : words) {
    if (static_cast<unsigned char>(c) < ' ') fail("an error of more than one line: " + words);
  }
}

void run(std::string_view bytes) {
  static const Folder folder;
  constexpr std::string_view extension = ZKD_FUZZ_EXTENSION;
  const bool glb = extension == ".gltf" && bytes.substr(0, 4) == "glTF";
  const std::filesystem::path file =
      folder.write("input" + std::string(glb ? ".glb" : extension), bytes);
  try {
    check(scene::load_mesh(file));
  } catch (const scene::LoadError& error) {
    check(error, file.string());
  }
}

}  // namespace
}  // namespace zkd::fuzz

// Assimp loses a mesh or two when it gives up on a file; what zkd loses is not in that library.
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  zkd::fuzz::run({reinterpret_cast<const char*>(data), size});
  return 0;
}
