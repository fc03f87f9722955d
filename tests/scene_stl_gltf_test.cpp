// SPDX-License-Identifier: Apache-2.0
//
// STL and glTF files, good and broken.
#include <limits>

#include "scene_files.hpp"

namespace zkd::test {
namespace {

using glm::uvec3;
using glm::vec3;
using StlTest = SceneFiles;

class GltfTest : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    if (!scene::can_read_gltf()) GTEST_SKIP() << "built without Assimp, which reads glTF";
  }
};
using GltfWithoutAssimpTest = SceneFiles;

// ---- STL ----------------------------------------------------------------------------------------

const std::vector<vec3> two{{0, 0, 0}, {1, 0, 0},       {1, 1, 0},
                            {0, 0, 0}, {1, 1, 0.0625F}, {0, 1, -3.1F}};

const std::string text_stl = "solid made by a test\n" + stl_facet("0 0 0", "1 0 0", "1 1 0") +
                             stl_facet("0 0 0", "1 1 0.0625", "0 1 -3.1") + "endsolid made\n";

TEST_F(StlTest, TextAndBinary) {
  for (const scene::Mesh& mesh :
       {load("a.stl", text_stl), load("b.stl", binary_stl(two)),
        load("c.STL", binary_stl(two, "solid that is binary all the same"))}) {
    EXPECT_EQ(mesh.positions, two);
    EXPECT_EQ(mesh.faces, (std::vector<uvec3>{{0, 1, 2}, {3, 4, 5}}));
  }
}

TEST_F(StlTest, SeveralSolids) {
  const scene::Mesh mesh = load(
      "a.stl", text_stl + "solid\n" + stl_facet("1.23456789 2 3", "4 5 6", "7 8 9") + "endsolid\n");
  ASSERT_EQ(mesh.faces.size(), 3U);
  EXPECT_EQ(mesh.positions[6], vec3(1.23456789F, 2.0F, 3.0F));
}

TEST_F(StlTest, BrokenBinary) {
  const std::string good = binary_stl(two);
  expect_error("a.stl", "short", ": byte 5: the file ends inside the header of a binary STL");
  expect_error("a.stl", good.substr(0, 183), ": byte 183: the file ends inside triangle 1 of 2");
  expect_error("a.stl", good.substr(0, 134), ": byte 134: the file ends inside triangle 1 of 2");
  expect_error("a.stl", good + "abc", ": byte 184: 3 bytes more than 2 triangles need");
  expect_error("a.stl", binary_stl({}), ": contains no triangle");
  std::vector<vec3> bad = two;
  bad[4].y = std::numeric_limits<float>::infinity();
  expect_error("a.stl", binary_stl(bad),
               ": byte 162: a coordinate of triangle 1 is not a finite number");
  std::string huge = good;
  huge.replace(80, 4, little_endian(0xFFFFFFFFu));
  expect_error("a.stl", huge, ": byte 184: the file ends inside triangle 2 of 4294967295");
}

TEST_F(StlTest, BrokenText) {
  const auto with = [&](const std::string& what, const std::string& by,
                        const std::string& message) {
    std::string text = text_stl;
    text.replace(text.find(what), what.size(), by);
    expect_error("a.stl", text, message);
  };
  with("vertex 1 0 0\n", "", ":6: expected 'vertex', found 'endloop'");
  with("vertex 1 0 0", "vertex 1 zz 0", ":5: coordinate 'zz' is not a number");
  with("vertex 1 0 0", "vertex 1 nan 0",
       ":5: coordinate 'nan' is not a finite number in single precision");
  with("vertex 1 0 0", "vertex 1 0", ":6: coordinate 'vertex' is not a number");
  with("endloop", "vertex 0 0 0", ":7: expected 'endloop', found 'vertex'");
  with("endfacet\n", "", ":8: expected 'endfacet', found 'facet'");
  with("endsolid made\n", "", ":16: the file ends inside a solid, after 2 whole triangles");
  with("outer", "inner", ":3: expected 'outer', found 'inner'");
  expect_error("a.stl", text_stl + "more\n", ":17: expected 'solid', found 'more'");
  expect_error("a.stl", "solid nothing\nendsolid nothing\n", ": contains no triangle");
}

TEST_F(StlTest, EveryTruncationIsAnError) {
  const std::string binary = binary_stl(two);
  for (std::size_t length = 0; length < binary.size(); ++length) {
    EXPECT_THROW(load("a.stl", binary.substr(0, length)), scene::LoadError) << length;
  }
  const std::size_t end = text_stl.find("endsolid") + 8;
  for (std::size_t length = 0; length < end; ++length) {
    EXPECT_THROW(load("a.stl", text_stl.substr(0, length)), scene::LoadError) << length;
  }
}

// ---- glTF ---------------------------------------------------------------------------------------

void expect_two_squares(const scene::Mesh& mesh) {
  EXPECT_EQ(mesh.faces, (std::vector<uvec3>{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}}));
  EXPECT_EQ(mesh.positions, (std::vector<vec3>{{10, 0, 0},
                                               {11, 0, 0},
                                               {11, 1, 0},
                                               {10, 1, 0.25F},
                                               {0, 0, 6},
                                               {0, 2, 6},
                                               {-2, 2, 6},
                                               {-2, 0, 6.5F}}));
}

TEST_F(GltfTest, BufferInTheFileBesideItAndInText) {
  expect_two_squares(load("a.glb", glb_file(square_json(""), square_buffer())));
  write("square.bin", square_buffer());
  expect_two_squares(load("b.gltf", square_json(R"("uri":"square.bin",)")));
  expect_two_squares(load("c.gltf", square_json(R"("uri":"data:application/octet-stream;base64,)" +
                                                base64(square_buffer()) + "\",")));
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

TEST_F(GltfTest, StripsFansPointsAndLines) {
  const auto triangles = [&](const std::string& mode) {
    return load("a.glb", glb_file(replaced(square_json(""), R"("indices":1)", R"("mode":)" + mode),
                                  square_buffer()))
        .faces.size();
  };
  EXPECT_EQ(triangles("5"), 4U);
  EXPECT_EQ(triangles("6"), 4U);
  // Points beside triangles are passed over.
  const scene::Mesh mesh =
      load("b.glb", glb_file(replaced(square_json(""), R"("primitives":[)",
                                      R"("primitives":[{"attributes":{"POSITION":0},"mode":0},)"),
                             square_buffer()));
  EXPECT_EQ(mesh.faces.size(), 4U);
}

TEST_F(GltfTest, BrokenContainers) {
  const std::string good = glb_file(square_json(""), square_buffer());
  const auto number = [](std::size_t n) { return little_endian(static_cast<std::uint32_t>(n)); };
  expect_error("a.glb", "glTF", ": byte 4: the file ends inside its GLB header");
  expect_error("a.glb", "no glTF at all", ": byte 0: a GLB file begins with 'glTF'");
  const std::string size = std::to_string(good.size());
  expect_error("a.glb", good.substr(0, good.size() - 1),
               ": byte 8: the header says " + size + " bytes, the file has " +
                   std::to_string(good.size() - 1));
  expect_error("a.glb", good + "x",
               ": byte 8: the header says " + size + " bytes, the file has " +
                   std::to_string(good.size() + 1));
  std::string text = good;
  expect_error("a.glb", text.replace(12, 4, number(5000000)),
               ": byte 12: a chunk of 5000000 bytes where " + std::to_string(good.size() - 20) +
                   " are left");
  text = good;
  expect_error("a.glb", text.replace(4, 4, number(1)), ": byte 4: not version 2 of GLB");
  text = good;
  expect_error("a.glb", text.replace(16, 4, "XXXX"), ": byte 16: this chunk should be JSON");
}

TEST_F(GltfTest, BrokenJson) {
  const std::string good = square_json("");
  const auto with = [&](const std::string& what, const std::string& by,
                        const std::string& message) {
    expect_error("a.glb", glb_file(replaced(good, what, by), square_buffer()), message);
  };
  expect_error("a.gltf", "{\"asset\" 3}", ": byte 9: malformed JSON");
  expect_error("a.gltf", "[]", ": the file has no asset");
  expect_error("a.gltf", "[1e999]", ": byte 0: a number in the JSON is out of range");
  with("\"2.0\"", "\"1.0\"", ": asset.version is not 2.x");
  with("\"scene\":0", "\"scene\":3", ": scenes[3] is named and not there");
  with("\"scene\":0", "\"scene\":-1", ": the file.scene is no whole number");
  with("[0,1]", "[0,7]", ": nodes[7] is named and not there");
  with("[0,1]", "[0,0]", ": nodes[0] has more than one parent");
  with("\"children\":[2]", "\"children\":[1]", ": nodes[1] has more than one parent");
  with("\"mesh\":0", "\"mesh\":5", ": meshes[5] is named and not there");
  with("\"indices\":1", "\"indices\":9", ": accessors[9] is named and not there");
  with("\"indices\":1", "\"indices\":0",
       ": meshes[0].primitives[0]: indices are not SCALAR of unsigned integers");
  with("\"indices\":1", "\"mode\":9", ": meshes[0].primitives[0] has an unknown mode");
  with("\"POSITION\":0", "\"NORMAL\":0", ": meshes[0].primitives[0] has no POSITION");
  with("\"count\":4", "\"count\":5", ": accessors[0] ends outside bufferViews[0]");
  with("\"count\":4", "\"count\":3", ": meshes[0].primitives[0]: index 5 names vertex 3 of 3");
  with("\"count\":6", "\"count\":5", ": meshes[0].primitives[0] has 5 corners, no whole triangles");
  with("\"count\":6", "\"count\":9007199254740993", ": accessors[1].count is no whole number");
  with("\"count\":6", "\"count\":9007199254740990", ": accessors[1] ends outside bufferViews[1]");
  with("\"byteLength\":48", "\"byteLength\":480", ": bufferViews[0] ends outside buffers[0]");
  with("\"byteLength\":60", "\"byteLength\":64", ": buffers[0] should have 64 bytes and has 60");
  with("5126", "5130", ": accessors[0] has an unknown componentType");
  with("5126", "5125", ": meshes[0].primitives[0]: POSITION is not VEC3 of float");
  with("\"asset\"", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],\"asset\"",
       ": requires the extension 'KHR_draco_mesh_compression', which is not supported");
}

TEST_F(GltfTest, BrokenBuffers) {
  const std::string missing = (folder_ / "none.bin").string();
  expect_error("a.gltf", square_json(R"("uri":"none.bin",)"),
               ": buffers[0]: " + missing + " cannot be opened");
  write("short.bin", square_buffer().substr(0, 59));
  expect_error("b.gltf", square_json(R"("uri":"short.bin",)"),
               ": buffers[0] should have 60 bytes and has 59");
  expect_error("c.gltf", square_json(R"("uri":"data:;base64,???",)"),
               ": buffers[0].uri is not base64");
  expect_error("d.gltf", square_json(""), ": buffers[0] has no uri");
}

TEST_F(GltfTest, BufferThatIsNoRegularFile) {
  expect_error("a.gltf", square_json(R"("uri":"/dev/null",)"),
               ": buffers[0]: /dev/null cannot be opened");
}

// Assimp overflowed the stack.
TEST_F(GltfTest, NestedTooDeep) {
  const auto nested = [&](std::size_t levels) {
    const std::string extras =
        "\"extras\":" + std::string(levels, '[') + std::string(levels, ']') + ",\"asset\"";
    return glb_file(replaced(square_json(""), "\"asset\"", extras), square_buffer());
  };
  expect_two_squares(load("a.glb", nested(200)));
  expect_error("b.glb", nested(1000000), ": the JSON has more than 256 levels");

  const auto chain = [&](std::size_t nodes) {
    std::string text = "\"nodes\":[";
    for (std::size_t i = 1; i < nodes; ++i) text += "{\"children\":[" + std::to_string(i) + "]},";
    const std::string json = replaced(square_json(""), "[0,1]", "[0]");
    const std::size_t from = json.find("\"nodes\":[\n");
    const std::size_t to = json.find("\"meshes\"");
    return glb_file(json.substr(0, from) + text + "{\"mesh\":0}],\n" + json.substr(to),
                    square_buffer());
  };
  EXPECT_EQ(load("c.glb", chain(1024)).faces.size(), 2U);
  expect_error("d.glb", chain(1025), ": the node tree has more than 1024 levels");
}

TEST_F(GltfTest, NoTriangle) {
  expect_error("a.glb", glb_file(replaced(square_json(""), "[0,1]", "[]"), square_buffer()),
               ": contains no triangle");
  expect_error("b.glb",
               glb_file(replaced(square_json(""), "\"indices\":1", "\"mode\":1"), square_buffer()),
               ": contains no triangle");
}

TEST_F(GltfTest, EveryTruncationIsAnError) {
  const std::string text = glb_file(square_json(""), square_buffer());
  for (std::size_t length = 0; length < text.size(); ++length) {
    EXPECT_THROW(load("a.glb", text.substr(0, length)), scene::LoadError) << length;
  }
}

TEST_F(GltfWithoutAssimpTest, IsOneClearError) {
  if (scene::can_read_gltf()) GTEST_SKIP() << "built with Assimp";
  expect_error("a.gltf", "{}",
               ": glTF is read by Assimp, which this program was built without "
               "(Debian and Ubuntu: libassimp-dev)");
}

}  // namespace
}  // namespace zkd::test
