// SPDX-License-Identifier: Apache-2.0
//
// PLY files, text and binary, good and broken.
#include <array>
#include <limits>

#include "scene_files.hpp"

namespace zkd::test {
namespace {

using glm::uvec3;
using glm::vec3;
using PlyTest = SceneFiles;

const std::vector<uvec3> faces{{0, 1, 2}, {0, 2, 3}, {3, 1, 0}};

TEST_F(PlyTest, Text) {
  const scene::Mesh mesh =
      load("a.ply",
           ply_header("ascii", 4, 2) + "0 0 0\n1.5 0 0\n1.25 1 0\n0 1 -3.1\n4 0 1 2 3\n3 3 1 0\n");
  EXPECT_EQ(mesh.positions, ply_corners);
  EXPECT_EQ(mesh.faces, faces);
}

TEST_F(PlyTest, TextNumbersAreRoundedCorrectly) {
  const scene::Mesh mesh = load("a.ply", ply_header("ascii", 3, 1) +
                                             "1.23456789 123.456789 -1234.56789\n"
                                             "0.1 16777217 3.4028235e38\n"
                                             "-1.17549435e-38 .5 5.\n3 0 1 2\n");
  EXPECT_EQ(mesh.positions[0], vec3(1.23456789F, 123.456789F, -1234.56789F));
  EXPECT_EQ(mesh.positions[1], vec3(0.1F, 16777216.0F, std::numeric_limits<float>::max()));
  EXPECT_EQ(mesh.positions[2], vec3(-std::numeric_limits<float>::min(), 0.5F, 5.0F));
}

TEST_F(PlyTest, TextWithCrLfAndBlankLines) {
  std::string text =
      ply_header("ascii", 4, 2) + "0 0 0\n1.5 0 0 \n1.25 1 0\n0 1 -3.1\n4 0 1 2 3\n3 3 1 0\n\n";
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) {
    text.replace(at, 1, "\r\n");
  }
  const scene::Mesh mesh = load("a.ply", text);
  EXPECT_EQ(mesh.positions, ply_corners);
  EXPECT_EQ(mesh.faces, faces);
}

TEST_F(PlyTest, BinaryAfterAHeaderWithCrLf) {
  std::string head = ply_header("binary_little_endian", 4, 2);
  for (std::size_t at = 0; (at = head.find('\n', at)) != std::string::npos; at += 2) {
    head.replace(at, 1, "\r\n");
  }
  const scene::Mesh mesh = load("a.ply", head + ply_body<float, std::uint8_t, int, false>());
  EXPECT_EQ(mesh.positions, ply_corners);
  EXPECT_EQ(mesh.faces, faces);
}

// A carriage return inside a row is a blank to one reader and the end of the row to the other.
TEST_F(PlyTest, ReadersThatDisagreeAreNotTrusted) {
  if (!scene::can_read_gltf()) GTEST_SKIP() << "built without Assimp: there is no second reader";
  expect_error("a.ply", ply_header("ascii", 3, 1) + "0 0\r0\n1 0 0\n1 1 0\n3 0 1 2\n",
               ": Assimp and zkd read vertex 1 differently; the file is not trusted");
}

TEST_F(PlyTest, BinaryInBothByteOrders) {
  const scene::Mesh little = load("a.ply", ply_header("binary_little_endian", 4, 2) +
                                               ply_body<float, std::uint8_t, int, false>());
  const scene::Mesh big = load(
      "b.ply", ply_header("binary_big_endian", 4, 2) + ply_body<float, std::uint8_t, int, true>());
  for (const scene::Mesh& mesh : {little, big}) {
    EXPECT_EQ(mesh.positions, ply_corners);
    EXPECT_EQ(mesh.faces, faces);
  }
}

TEST_F(PlyTest, OtherTypes) {
  const auto load_as = [&](const std::string& head, const std::string& body) {
    const scene::Mesh mesh = load("a.ply", head + body);
    EXPECT_EQ(mesh.positions, ply_corners) << head;
    EXPECT_EQ(mesh.faces, faces) << head;
  };
  const std::string little = "binary_little_endian";
  load_as(ply_header(little, 4, 2, "double", "uint ushort"),
          ply_body<double, std::uint32_t, std::uint16_t, false>());
  load_as(ply_header(little, 4, 2, "float32", "uint8 uint32"),
          ply_body<float, std::uint8_t, std::uint32_t, false>());
  load_as(ply_header(little, 4, 2, "float", "ushort short"),
          ply_body<float, std::uint16_t, std::int16_t, false>());
  load_as(ply_header(little, 4, 2, "float", "char uchar"),
          ply_body<float, std::int8_t, std::uint8_t, false>());
  load_as(ply_header("binary_big_endian", 4, 2, "float64", "int32 int"),
          ply_body<double, std::int32_t, std::int32_t, true>());
}

TEST_F(PlyTest, OtherPropertiesAndElements) {
  const scene::Mesh mesh =
      load("a.ply",
           "ply\nformat ascii 1.0\nobj_info scanned\nelement vertex 3\nproperty float confidence\n"
           "property float z\nproperty float y\nproperty float x\nproperty uchar red\n"
           "element face 1\nproperty uchar flags\nproperty list uchar int vertex_index\n"
           "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
           "0.5 3 2 1 255\n0.5 6 5 4 0\n0.5 9 8 7 0\n1 3 0 1 2\n0 1\n");
  EXPECT_EQ(mesh.positions, (std::vector<vec3>{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
  EXPECT_EQ(mesh.faces, (std::vector<uvec3>{{0, 1, 2}}));
}

TEST_F(PlyTest, BrokenHeaders) {
  const std::string good = ply_header("ascii", 3, 1);
  const std::string body = "0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n";
  const auto with = [&](const std::string& what, const std::string& by,
                        const std::string& message) {
    std::string text = good + body;
    text.replace(text.find(what), what.size(), by);
    expect_error("a.ply", text, message);
  };
  expect_error("a.ply", "solid\n", ":1: a PLY file begins with 'ply'");
  expect_error("a.ply", "ply", ":1: a PLY file begins with 'ply'");
  expect_error("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n",
               ":4: the file ends inside its header");
  with("format ascii 1.0\n", "", ":2: 'format' is missing");
  with("ascii", "binary", ":2: unknown format 'binary'");
  with("1.0", "2.0", ":2: unknown version '2.0'");
  with("vertex 3", "vertex -3", ":4: the count '-3' is not a number");
  with("vertex 3", "vertex", ":4: 'element' needs a name and a count");
  with("vertex 3", "vertex 4000000000", ":4: a count of 4000000000 is more than 2147483647");
  with("float x", "real x", ":5: unknown type 'real'");
  with("float y", "float x", ":6: a second property 'x'");
  with("property float x", "property x", ":5: 'property' needs a type and a name");
  with("element vertex 3\n", "", ":4: a property before the first element");
  with("element face", "element vertex", ":8: a second element 'vertex'");
  with("property float z\n", "", ":9: element 'vertex' has no property 'z'");
  with("uchar int", "float int", ":9: a list's count must be an integer");
  with("uchar int", "uchar float", ":10: the vertex indices are no list of integers");
  with("vertex_indices", "corners", ":10: element 'face' has no list 'vertex_indices'");
  with("comment made by a test", "remark", ":3: 'remark' is not known in a PLY header");
  with("element vertex", "element point", ":10: there is no element 'vertex'");
  with("element face", "element tristrips", ":8: triangle strips are not supported");
  with("face 1", "face 0", ": contains no triangle");
}

TEST_F(PlyTest, BrokenTextBodies) {
  const std::string head = ply_header("ascii", 3, 1);  // 10 lines
  const auto body = [&](const std::string& text, const std::string& message) {
    expect_error("a.ply", head + text, message);
  };
  body("0 0 0\n1 0\n1 1 0\n3 0 1 2\n", ":12: vertex 1 of 3 has fewer values than the header says");
  body("0 0 0\n1 0 0 9\n1 1 0\n3 0 1 2\n",
       ":12: vertex 1 of 3 has more values than the header says: '9'");
  body("0 0 0\n1 zz 0\n1 1 0\n3 0 1 2\n", ":12: coordinate 'zz' of vertex 1 of 3 is not a number");
  body("0 0 0\n1 nan 0\n1 1 0\n3 0 1 2\n",
       ":12: coordinate 'nan' of vertex 1 of 3 is not a finite number in single precision");
  body("0 0 0\n1 1e39 0\n1 1 0\n3 0 1 2\n",
       ":12: coordinate '1e39' of vertex 1 of 3 is not a finite number in single precision");
  body("0 0 0\n1 0 0\n1 1 0\n3 0 1 3\n", ":14: face 0 of 1 names vertex 3 of 3");
  body("0 0 0\n1 0 0\n1 1 0\n3 0 1 -1\n", ":14: face 0 of 1 names vertex -1 of 3");
  body("0 0 0\n1 0 0\n1 1 0\n3 0 1 x\n", ":14: 'x' in face 0 of 1 is not an integer");
  body("0 0 0\n1 0 0\n1 1 0\n2 0 1\n", ":14: face 0 of 1 has 2 corners; a triangle needs 3");
  body("0 0 0\n1 0 0\n1 1 0\n-3 0 1 2\n", ":14: face 0 of 1 has -3 corners; a triangle needs 3");
  body("0 0 0\n1 0 0\n1 1 0\n4 0 1 2\n", ":14: face 0 of 1 has fewer values than the header says");
  body("0 0 0\n1 0 0\n", ":12: the file ends before vertex 2 of 3");
  body("0 0 0\n1 0 0\n1 1 0\n", ":13: the file ends before face 0 of 1");
  body("0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n\n3 0 1 2\n", ":16: there is more than the header says");
}

TEST_F(PlyTest, BrokenBinaryBodies) {
  const std::string head = ply_header("binary_little_endian", 4, 2);
  const std::string body = ply_body<float, std::uint8_t, int, false>();  // 48 + 17 + 13 bytes
  const auto at = [&](std::size_t offset) {
    return ": byte " + std::to_string(head.size() + offset) + ": ";
  };
  const auto patched = [&](std::size_t offset, const std::string& bytes) {
    std::string text = body;
    text.replace(offset, bytes.size(), bytes);
    return head + text;
  };
  expect_error("a.ply", head, at(0) + "the file ends inside vertex 0 of 4");
  expect_error("a.ply", head + body.substr(0, 47), at(47) + "the file ends inside vertex 3 of 4");
  expect_error("a.ply", head + body.substr(0, 48), at(48) + "the file ends inside face 0 of 2");
  expect_error("a.ply", head + body.substr(0, 77), at(77) + "the file ends inside face 1 of 2");
  expect_error("a.ply", head + body + "x", at(78) + "1 bytes more than the header says");
  expect_error("a.ply", patched(48, "\xFF"), at(78) + "the file ends inside face 0 of 2");
  expect_error("a.ply", patched(48, "\x02"),
               at(48) + "face 0 of 2 has 2 corners; a triangle needs 3");
  expect_error("a.ply", patched(53, little_endian(4)), at(53) + "face 0 of 2 names vertex 4 of 4");
  expect_error("a.ply", patched(53, little_endian(-1)),
               at(53) + "face 0 of 2 names vertex -1 of 4");
  expect_error("a.ply", patched(16, little_endian(std::numeric_limits<float>::quiet_NaN())),
               at(16) + "a coordinate of vertex 1 of 4 is not a finite number in single precision");
}

TEST_F(PlyTest, HugeCountsCostNothing) {
  expect_error("a.ply", ply_header("binary_little_endian", 2000000000, 1),
               ": byte " +
                   std::to_string(ply_header("binary_little_endian", 2000000000, 1).size()) +
                   ": the file ends inside vertex 0 of 2000000000");
}

TEST_F(PlyTest, EveryTruncationIsAnError) {
  const std::string binary =
      ply_header("binary_little_endian", 4, 2) + ply_body<float, std::uint8_t, int, false>();
  for (std::size_t length = 0; length < binary.size(); ++length) {
    EXPECT_THROW(load("a.ply", binary.substr(0, length)), scene::LoadError) << length;
  }
  const std::string text = ply_header("ascii", 3, 1) + "0 0 0\n1 0 0\n1 1 0\n3 0 1 2";
  for (std::size_t length = 0; length < text.size(); ++length) {
    EXPECT_THROW(load("a.ply", text.substr(0, length)), scene::LoadError) << length;
  }
}

// Names from the header are told in errors, whatever is in them.
TEST_F(PlyTest, ControlCharactersInAName) {
  std::string text = ply_header("ascii", 0, 1);
  text.replace(text.find("element vertex"), 0,
               std::string("element a\0b\x1B[2J 2\nproperty int n\n", 33));
  expect_error("a.ply", text + "1\n", ":13: the file ends before a?b?[2J 1 of 2");
}

}  // namespace
}  // namespace zkd::test
