// SPDX-License-Identifier: Apache-2.0
//
// Files that a test writes, and the error it expects from reading them.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "scene/load.hpp"
#include "support/mesh_files.hpp"

namespace zkd::test {

/// A folder of its own for each test, gone after it.
class SceneFiles : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("zkd-" + std::to_string(getpid()) + "-" + info->name());
    std::filesystem::create_directories(folder_);
  }

  void TearDown() override {
    std::error_code error;
    std::filesystem::remove_all(folder_, error);
  }

  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    const std::filesystem::path file = folder_ / name;
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }

  scene::Mesh load(const std::string& name, std::string_view bytes) const {
    return scene::load_mesh(write(name, bytes));
  }

  /// That loading throws a LoadError whose message is the file's name followed by `message`.
  void expect_error(const std::string& name, std::string_view bytes,
                    const std::string& message) const {
    const std::filesystem::path file = write(name, bytes);
    try {
      const scene::Mesh mesh = scene::load_mesh(file);
      ADD_FAILURE() << "loaded " << mesh.faces.size() << " triangles, expected error " << message;
    } catch (const scene::LoadError& error) {
      const std::string text = error.what();
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      EXPECT_EQ(text.substr(0, file.string().size()), file.string());
      EXPECT_EQ(text.substr(std::min(file.string().size(), text.size())), message);
    }
  }

  std::filesystem::path folder_;
};

/// The meshes that lie beside a developer's checkout; not part of the repository.
inline std::filesystem::path shared_scenes() {
  return std::filesystem::path(ZKD_SOURCE_DIR) / ".." / "shared" / "scenes";
}

}  // namespace zkd::test
