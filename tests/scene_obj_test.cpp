// SPDX-License-Identifier: Apache-2.0
//
// OBJ files, good and broken.
#include <cmath>
#include <limits>
#include <ostream>

#include "scene_files.hpp"

namespace zkd::test {
namespace {

using glm::uvec3;
using glm::vec3;
using ObjTest = SceneFiles;

constexpr const char* square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST_F(ObjTest, TriangleAndQuad) {
  const scene::Mesh mesh = load("a.obj", std::string(square) + "f 1 2 3\nf 1 2 3 4\n");
  EXPECT_EQ(mesh.positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.faces, (std::vector<uvec3>{{0, 1, 2}, {0, 1, 2}, {0, 2, 3}}));
}

TEST_F(ObjTest, PolygonIsFanRoundItsFirstCorner) {
  const scene::Mesh mesh = load("a.obj", std::string(square) + "v 2 2 2\nv 3 3 3\nf 3 4 5 6 1 2\n");
  EXPECT_EQ(mesh.faces, (std::vector<uvec3>{{2, 3, 4}, {2, 4, 5}, {2, 5, 0}, {2, 0, 1}}));
}

TEST_F(ObjTest, PolygonOfThreeHundredCorners) {
  std::string text;
  std::string face = "f";
  for (int i = 1; i <= 300; ++i) {
    text += "v " + std::to_string(i) + " 0 0\n";
    face += " " + std::to_string(i);
  }
  const scene::Mesh mesh = load("a.obj", text + face + "\n");
  ASSERT_EQ(mesh.faces.size(), 298U);
  EXPECT_EQ(mesh.faces.back(), uvec3(0, 298, 299));
}

TEST_F(ObjTest, NegativeIndicesCountBack) {
  const scene::Mesh mesh =
      load("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 5 5 5\nf -4//-1 -2/7 -1/-1/-1\n");
  EXPECT_EQ(mesh.faces, (std::vector<uvec3>{{0, 1, 2}, {0, 2, 3}}));
}

TEST_F(ObjTest, FaceMayComeBeforeItsVertices) {
  const scene::Mesh mesh = load("a.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 1 1 0\n");
  EXPECT_EQ(mesh.faces, (std::vector<uvec3>{{0, 1, 2}}));
}

TEST_F(ObjTest, AllKindsOfCorners) {
  const scene::Mesh mesh =
      load("a.obj",
           std::string(square) + "vt 0 0\nvn 0 0 1\nf 1/1 2/1/1 3//1 4\nf +1 2 3\nf 1/ 2/ 3/\n");
  EXPECT_EQ(mesh.faces.size(), 4U);
}

TEST_F(ObjTest, LineEndsAndBlanks) {
  const std::vector<uvec3> expected{{0, 1, 2}};
  for (const char* text : {
           "v  0 0 0\r\nv\t1 0 0 \r\n  v 1 1 0\r\n\r\nf 1 2 3\r\n",  // CRLF, odd blanks
           "v 0 0 0\rv 1 0 0\rv 1 1 0\rf 1 2 3\r",                   // CR alone
           "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3",                     // no end of line at the end
           "\xEF\xBB\xBFv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n",       // byte order mark
           "v 0 0 \\\n0\nv 1 0 0\nv 1 1 0\nf 1 \\\r\n2 3\n",         // continued lines
           "# f\nv 0 0 0 # x\nv 1 0 0\nv 1 1 0\nf 1 2 3 # f 1 2\n",  // comments
       }) {
    const scene::Mesh mesh = load("a.obj", text);
    EXPECT_EQ(mesh.faces, expected) << text;
    EXPECT_EQ(mesh.positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}})) << text;
  }
}

TEST_F(ObjTest, StatementsThatMakeNoTriangle) {
  const scene::Mesh mesh = load("a.obj",
                                "mtllib not_here.mtl\ng\ng a b\no thing\ns 1\ns off\n"
                                "usemtl red\nv 0 0 0 1 0.5 0.25\nv 1 0 0 1.0\n"
                                "v 1 1 0 1 1 1 1\nvt 0 0\nvn nan 0 0\nl 1 2\np 1\n"
                                "something else\nf 1 2 3\n");
  EXPECT_EQ(mesh.positions.size(), 3U);
  EXPECT_EQ(mesh.faces.size(), 1U);
}

TEST_F(ObjTest, NumbersAreRoundedCorrectly) {
  const scene::Mesh mesh =
      load("a.obj",
           "v 1.23456789 123.456789 -1234.56789\n"
           "v 0.1 16777217 3.4028235e38\n"
           "v 1e-45 -1.17549435e-38 +.5\n"
           "v 1.00000005960464477539062500000001 1e-400 -0\nv 5. 1E2 -1e-2\nf 1 2 3\n");
  const vec3* p = mesh.positions.data();
  EXPECT_EQ(p[0], vec3(1.23456789F, 123.456789F, -1234.56789F));
  EXPECT_EQ(p[1], vec3(0.1F, 16777216.0F, std::numeric_limits<float>::max()));
  EXPECT_EQ(p[2], vec3(std::numeric_limits<float>::denorm_min(), -std::numeric_limits<float>::min(),
                       0.5F));
  EXPECT_EQ(p[3].x, 1.00000011920928955078125F) << "just above the middle of two floats";
  EXPECT_EQ(p[3].y, 0.0F);
  EXPECT_TRUE(std::signbit(p[3].z));
  EXPECT_EQ(p[4], vec3(5.0F, 100.0F, -0.01F));
}

TEST_F(ObjTest, NothingIsMergedOrLeftOut) {
  const scene::Mesh mesh =
      load("a.obj", "v 0 0 0\nv 0 0 0\nv 1 0 0\nv 9 9 9\nf 1 2 3\nf 1 1 1\nf 1 2 3\n");
  EXPECT_EQ(mesh.positions.size(), 4U);
  EXPECT_EQ(mesh.faces, (std::vector<uvec3>{{0, 1, 2}, {0, 0, 0}, {0, 1, 2}}));
}

TEST_F(ObjTest, ExtensionInAnyCase) {
  EXPECT_EQ(load("A.OBJ", std::string(square) + "f 1 2 3\n").faces.size(), 1U);
}

TEST_F(ObjTest, BrokenVertices) {
  const std::string rest = "\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
  const auto first = [&](const std::string& v, const std::string& message) {
    expect_error("a.obj", v + rest, message);
  };
  first("v 0 0", ":1: a vertex needs 3 coordinates, not 2");
  first("v", ":1: a vertex needs 3 coordinates, not 0");
  first("v 0 zz 0", ":1: coordinate 'zz' of a vertex is not a number");
  first("v 0 1x 0", ":1: coordinate '1x' of a vertex is not a number");
  first("v 0 1,5 0", ":1: coordinate '1,5' of a vertex is not a number");
  first("v 0x10 0 0", ":1: coordinate '0x10' of a vertex is not a number");
  first("v 1e 0 0", ":1: coordinate '1e' of a vertex is not a number");
  first("v - 0 0", ":1: coordinate '-' of a vertex is not a number");
  first("v +-1 0 0", ":1: coordinate '+-1' of a vertex is not a number");
  first("v 0 nan 0", ":1: coordinate 'nan' of a vertex is not a finite number in single precision");
  first("v 0 -inf 0",
        ":1: coordinate '-inf' of a vertex is not a finite number in single precision");
  first("v 0 0 1e39",
        ":1: coordinate '1e39' of a vertex is not a finite number in single precision");
  first("v 0 0 1e999",
        ":1: coordinate '1e999' of a vertex is not a finite number in single precision");
  first("v 0 0 0 w", ":1: value 'w' of a vertex is not a number");
  first(std::string("v 0 0 \0", 7), ":1: coordinate '?' of a vertex is not a number");
}

TEST_F(ObjTest, BrokenFaces) {
  const auto face = [&](const std::string& f, const std::string& message) {
    expect_error("a.obj", std::string(square) + f + "\nf 1 2 3\n", message);
  };
  face("f", ":5: a face needs 3 corners, not 0");
  face("f 1 2", ":5: a face needs 3 corners, not 2");
  face("f 1 2 0", ":5: vertex index 0: OBJ counts from 1");
  face("f 1 2 5", ":5: vertex index 5 is out of range: the file has 4 vertices");
  face("f 1 2 4294967297", ":5: vertex index 4294967297 is out of range: the file has 4 vertices");
  face("f 1 2 99999999999999999999", ":5: corner '99999999999999999999' is not an index");
  face("f 1 2 -5", ":5: vertex index -5 reaches back before the first of 4 vertices");
  face("f 1 2 -9223372036854775808", ":5: corner '-9223372036854775808' is not an index");
  face("f 1 2 x", ":5: corner 'x' is not an index");
  face("f 1 2 3.5", ":5: corner '3.5' is not an index");
  face("f 1 2 /3", ":5: corner '/3' is not an index");
  face("f 1 2 3/x", ":5: corner '3/x' is not an index");
  face("f 1 2 3/1/1/1", ":5: corner '3/1/1/1' is not an index");
  face("f 1 2 3 \x01", ":5: corner '?' is not an index");
  face("fo 1 2 3", ":5: the statement 'fo' is not supported");
  face("call other.obj", ":5: the statement 'call' is not supported");
}

TEST_F(ObjTest, ErrorNamesTheFirstOffender) {
  expect_error("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\nf 1 2 9\nf 1 2 7\nv 2 2 2\n",
               ":5: vertex index 9 is out of range: the file has 4 vertices");
}

TEST_F(ObjTest, ErrorCountsLinesOfAnyKind) {
  expect_error("a.obj", "\r\n\r\nv 0 0 0\r\nv 1 zz 0\r\n",
               ":4: coordinate 'zz' of a vertex is not a number");
  expect_error("a.obj", "\r\rv 0 zz 0\r", ":3: coordinate 'zz' of a vertex is not a number");
  expect_error("a.obj", "v 0 \\\n0 \\\r\n0\nv 0 zz 0\n",
               ":4: coordinate 'zz' of a vertex is not a number");
  expect_error("a.obj", "v 0 \\\n0 \\\n zz\n", ":3: coordinate 'zz' of a vertex is not a number");
}

TEST_F(ObjTest, NoTriangle) {
  expect_error("a.obj", "v 0 0 0\nl 1 1\n", ": contains no triangle");
  expect_error("a.obj", "nothing of the kind", ": contains no triangle");
}

TEST_F(ObjTest, FilesThatCannotBeRead) {
  EXPECT_THROW((void)scene::load_mesh(folder_ / "none.obj"), scene::LoadError);
  expect_error("empty.obj", "", ": is empty");
  expect_error("mesh.xyz", "v 0 0 0\n",
               ": unknown kind of mesh file; known are .obj .ply .stl .gltf .glb");
  const auto message = [](const std::filesystem::path& file) -> std::string {
    try {
      (void)scene::load_mesh(file);
    } catch (const scene::LoadError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message(folder_ / "none.obj"), (folder_ / "none.obj").string() + ": no such file");
  EXPECT_EQ(message(folder_), folder_.string() + ": is a directory, not a mesh file");
  EXPECT_EQ(message("/dev/null"),
            "/dev/null: unknown kind of mesh file; known are .obj .ply .stl "
            ".gltf .glb");
  if (geteuid() != 0) {
    const auto file = write("secret.obj", "v 0 0 0\n");
    std::filesystem::permissions(file, std::filesystem::perms::none);
    EXPECT_EQ(message(file), file.string() + ": cannot be opened: Permission denied");
  }
}

/// Every prefix of a file is an error or, where only whole statements were cut off, a mesh that
/// these statements describe; never a crash.
TEST_F(ObjTest, EveryTruncationIsHandled) {
  const std::string text = std::string(square) + "f 1/1/1 2/2/2 3/3/3 4/4/4\nf -1 -2 -3\n";
  for (std::size_t length = 1; length < text.size(); ++length) {
    try {
      const scene::Mesh mesh = load("a.obj", text.substr(0, length));
      EXPECT_GE(mesh.faces.size(), 1U);
      EXPECT_EQ(mesh.positions.size(), 4U);
    } catch (const scene::LoadError&) {
    }
  }
}

struct RealObj {
  const char* name;
  std::size_t vertices;
  std::size_t triangles;
  float lo[3];
  float hi[3];
};

void PrintTo(const RealObj& obj, std::ostream* out) { *out << obj.name; }

class RealObjTest : public testing::TestWithParam<RealObj> {};

TEST_P(RealObjTest, CountsAndBounds) {
  const RealObj& expected = GetParam();
  const auto file = shared_scenes() / "obj" / expected.name;
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not here";
  const scene::Mesh mesh = scene::load_mesh(file);
  EXPECT_EQ(mesh.positions.size(), expected.vertices);
  EXPECT_EQ(mesh.faces.size(), expected.triangles);
  const Box box = bounds(mesh);
  for (int a = 0; a < 3; ++a) {
    EXPECT_EQ(box.lo[a], expected.lo[a]);
    EXPECT_EQ(box.hi[a], expected.hi[a]);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Shared, RealObjTest,
    testing::Values(RealObj{"bunny.obj",
                            35947,
                            69451,
                            {-0.0946900025010109F, 0.032986998558044434F, -0.06187399849295616F},
                            {0.0610090009868145F, 0.1873210072517395F, 0.058800000697374344F}},
                    RealObj{"sponza.obj",
                            39999,
                            66454,
                            {-17.402759552001953F, -0.9066889882087708F, -7.798511981964111F},
                            {17.417240142822266F, 15.653311729431152F, 7.801488876342773F}},
                    RealObj{"beast.obj",
                            32311,
                            64618,
                            {-136.88795471191406F, -0.8694260120391846F, -29.67483901977539F},
                            {136.88795471191406F, 251.32579040527344F, 86.852294921875F}},
                    RealObj{"quadknot.obj",
                            1440,
                            2880,
                            {-149.29086303710938F, -66.8590087890625F, -167.22898864746094F},
                            {21.443805694580078F, 66.8602294921875F, 14.094596862792969F}}),
    [](const auto& parameter) {
      const std::string name = parameter.param.name;
      return name.substr(0, name.find('.'));
    });

}  // namespace
}  // namespace zkd::test
