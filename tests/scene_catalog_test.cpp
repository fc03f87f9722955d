// SPDX-License-Identifier: Apache-2.0
//
// Scenes by name, path and manifest.
#include "scene/catalog.hpp"

#include <cstdlib>

#include "scene_files.hpp"

namespace zkd::test {
namespace {

constexpr const char* obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";

class CatalogTest : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    setenv("ZKD_SCENES", folder_.c_str(), 1);
  }
  void TearDown() override {
    unsetenv("ZKD_SCENES");
    SceneFiles::TearDown();
  }

  static std::string error_of(const std::string& name) {
    try {
      return "found " + scene::find_scene(name).path.string();
    } catch (const scene::LoadError& error) {
      return error.what();
    }
  }
};

TEST_F(CatalogTest, KnownNames) {
  EXPECT_EQ(
      scene::known_scenes(),
      (std::vector<std::string>{"bunny", "fairy", "conference", "sibenik", "dragon", "buddha",
                                "sponza", "armadillo", "teapot", "dragon_res2", "happy_res3"}));
}

TEST_F(CatalogTest, TheEnvironmentComesFirst) {
  const auto file = write("bunny.obj", obj);
  const scene::SceneInfo info = scene::find_scene("bunny");
  EXPECT_EQ(info.name, "bunny");
  EXPECT_EQ(info.path, file);
  EXPECT_FALSE(info.stand_in);
  EXPECT_EQ(info.paper_scene, "Bunny");
  EXPECT_EQ(info.paper_triangles, 69451U);
  EXPECT_EQ(info.paper_ms, 4.3);
  EXPECT_FALSE(info.camera.has_value());
  EXPECT_EQ(scene::load_mesh(info.path).faces.size(), 1U);
}

TEST_F(CatalogTest, SeveralFoldersInTheEnvironment) {
  std::filesystem::create_directories(folder_ / "second");
  const auto file = write("second/teapot.obj", obj);
  setenv("ZKD_SCENES", (folder_.string() + "::" + (folder_ / "second").string()).c_str(), 1);
  EXPECT_EQ(scene::find_scene("teapot").path, file);
}

TEST_F(CatalogTest, StandInsSayThatTheyAre) {
  write("fairy_standin.obj", obj);
  write("happy_loop.obj", obj);
  for (const char* name : {"fairy", "buddha", "fairy_standin"}) {
    const scene::SceneInfo info = scene::find_scene(name);
    EXPECT_TRUE(info.stand_in) << name;
    EXPECT_GT(info.paper_ms, 0.0) << name;
  }
  EXPECT_EQ(scene::find_scene("happy_loop").name, "buddha");
  // The real thing is taken where it is there.
  write("fairy.obj", obj);
  EXPECT_FALSE(scene::find_scene("fairy").stand_in);
}

TEST_F(CatalogTest, ManifestBesideTheMesh) {
  write("bunny.obj", obj);
  write("mine.obj", obj);
  write("MANIFEST.json", R"({"scenes":[
    {"file":"sub/bunny.obj","fidelity":"stand-in: a triangle",
     "camera":{"eye":[1,2,3],"look_at":[0,0.5,0],"up":[0,0,1],"vfov_deg":34}},
    {"file":"mine.obj","fidelity":"exact","camera":null}]})");
  const scene::SceneInfo bunny = scene::find_scene("bunny");
  EXPECT_TRUE(bunny.stand_in);
  EXPECT_EQ(bunny.note, "stand-in: a triangle");
  ASSERT_TRUE(bunny.camera.has_value());
  EXPECT_EQ(bunny.camera->eye, glm::vec3(1, 2, 3));
  EXPECT_EQ(bunny.camera->look_at, glm::vec3(0, 0.5F, 0));
  EXPECT_EQ(bunny.camera->up, glm::vec3(0, 0, 1));
  EXPECT_EQ(bunny.camera->vfov_deg, 34.0F);
  const scene::SceneInfo mine = scene::find_scene((folder_ / "mine.obj").string());
  EXPECT_EQ(mine.name, "mine");
  EXPECT_FALSE(mine.stand_in);
  EXPECT_EQ(mine.note, "");
  EXPECT_EQ(mine.paper_scene, "");
  EXPECT_FALSE(mine.camera.has_value());
}

TEST_F(CatalogTest, BrokenManifest) {
  write("bunny.obj", obj);
  write("MANIFEST.json", "{\"scenes\":[");
  EXPECT_EQ(error_of("bunny"), (folder_ / "MANIFEST.json").string() + ": byte 12: malformed JSON");
  write("MANIFEST.json", R"({"scenes":[{"file":"bunny.obj","camera":{"eye":[1,2]}}]})");
  EXPECT_EQ(error_of("bunny"),
            (folder_ / "MANIFEST.json").string() + ": a camera's vector has not 3 numbers");
}

TEST_F(CatalogTest, Errors) {
  EXPECT_EQ(error_of("bunnny"),
            "unknown scene 'bunnny'; a mesh file or one of: bunny fairy conference sibenik dragon "
            "buddha sponza armadillo teapot dragon_res2 happy_res3");
  EXPECT_EQ(error_of("none.obj"), "none.obj: no such file");
  EXPECT_EQ(error_of("no/such"), "no/such: no such file");
}

TEST_F(CatalogTest, PackedFiles) {
  if (std::system("command -v zstd >/dev/null") != 0) GTEST_SKIP() << "zstd is not installed";
  const auto plain = write("teapot.ply",
                           "ply\nformat ascii 1.0\nelement vertex 3\n"
                           "property float x\nproperty float y\nproperty float z\n"
                           "element face 1\nproperty list uchar int vertex_indices\n"
                           "end_header\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n");
  ASSERT_EQ(std::system(("zstd -q --rm '" + plain.string() + "'").c_str()), 0);
  const scene::SceneInfo info = scene::find_scene("teapot");
  EXPECT_EQ(info.path.filename(), "teapot.ply");
  EXPECT_NE(info.path.parent_path(), folder_) << "unpacked beside the packed file";
  EXPECT_EQ(scene::load_mesh(info.path).faces.size(), 1U);
  const auto time = std::filesystem::last_write_time(info.path);
  EXPECT_EQ(scene::find_scene((folder_ / "teapot.ply.zst").string()).path, info.path);
  EXPECT_EQ(std::filesystem::last_write_time(info.path), time) << "unpacked twice";
  std::filesystem::remove_all(info.path.parent_path());

  const auto broken = write("bunny.ply.zst", "not packed at all");
  const std::string error = error_of("bunny");
  EXPECT_EQ(error.find(broken.string() + ": cannot be unpacked: zstd: "), 0U) << error;
  EXPECT_NE(error.find("unsupported format"), std::string::npos) << error;
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  std::vector<std::string> problems;
  for (const scene::SceneInfo& found : scene::list_scenes(&problems)) {
    EXPECT_NE(found.name, "bunny");
  }
  ASSERT_FALSE(problems.empty());
  EXPECT_EQ(problems[0], error);
}

TEST(SharedCatalog, PaperScenes) {
  if (!std::filesystem::exists(shared_scenes() / "MANIFEST.json")) {
    GTEST_SKIP() << shared_scenes() << " is not here";
  }
  if (std::system("command -v zstd >/dev/null") != 0) GTEST_SKIP() << "zstd is not installed";
  std::vector<std::string> names;
  for (const scene::SceneInfo& info : scene::paper_scenes()) {
    names.push_back(info.name);
    EXPECT_TRUE(info.camera.has_value()) << info.name;
    EXPECT_EQ(info.stand_in, info.name == "fairy" || info.name == "buddha") << info.name;
    EXPECT_TRUE(std::filesystem::exists(info.path)) << info.path;
  }
  EXPECT_EQ(names, (std::vector<std::string>{"bunny", "fairy", "conference", "sibenik", "dragon",
                                             "buddha"}));
  EXPECT_EQ(scene::load_mesh(scene::find_scene("bunny").path).faces.size(), 69451U);
}

}  // namespace
}  // namespace zkd::test
