// SPDX-License-Identifier: Apache-2.0
//
// Makes the corpora that the fuzz targets begin with and that CTest replays: small mesh files of
// each format, good and spoilt, and strings of random bytes. The same on every machine.
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "scene/random.hpp"
#include "support/mesh_files.hpp"

namespace {

using namespace zkd;

std::vector<std::string> obj_files() {
  return {
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
      "# a square\r\nv 0 0 0 1\r\nv 1 0 0 1\r\nv 1 1 0\r\nv 0 1 -3.1e-1\r\nf 1/1 2/2 3/3 4/4\r\n",
      "o a\ng b\nvn 0 0 1\nvt 0 0\nf -3//1 -2//1 -1//1\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 .5\nf -4 -3 -2 \\\n -1\nl 1 2\np 1\nusemtl x\ns off\n",
      "\xEF\xBB\xBFv 1e-46 -0 +1\nv 3.4028235e38 0 0\nv 1.17549435e-38 5. .5\nf 1/2/3 2/2/3 3 # "
      "x\n",
  };
}

std::vector<std::string> ply_files() {
  const std::string rows = "0 0 0\n1.5 0 0\n1.25 1 0\n0 1 -3.1\n4 0 1 2 3\n3 3 1 0\n";
  const std::string little = "binary_little_endian";
  const std::string big = "binary_big_endian";
  return {
      test::ply_header("ascii", 4, 2) + rows,
      test::ply_header(little, 4, 2) + test::ply_body<float, std::uint8_t, std::int32_t, false>(),
      test::ply_header(big, 4, 2) + test::ply_body<float, std::uint8_t, std::int32_t, true>(),
      test::ply_header(little, 4, 2, "double", "int uint") +
          test::ply_body<double, std::int32_t, std::uint32_t, false>(),
      test::ply_header(big, 4, 2, "short", "ushort uchar") +
          test::ply_body<std::int16_t, std::uint16_t, std::uint8_t, true>(),
      "ply\nformat ascii 1.0\nelement material 1\nproperty list uchar int names\nelement vertex 3\n"
      "property float x\nproperty float y\nproperty uchar red\nproperty float z\nelement face 1\n"
      "property uchar flags\nproperty list uint8 uint16 vertex_index\nend_header\n2 7 8\n"
      "0 0 255 0\n1 0 0 0\n0 1 9 0\n1 3 0 1 2\n",
  };
}

std::vector<std::string> stl_files() {
  const std::vector<glm::vec3> corners = {{0, 0, 0}, {1, 0, 0},       {1, 1, 0},
                                          {0, 0, 0}, {1, 1, 0.0625F}, {0, 1, -3.1F}};
  const std::string text = "solid made\n" + test::stl_facet("0 0 0", "1 0 0", "1 1 0") +
                           test::stl_facet("0 0 0", "1 1 0.0625", "0 1 -3.1") + "endsolid made\n";
  return {text, text + text, test::binary_stl(corners), test::binary_stl(corners, "solid binary"),
          test::binary_stl({corners.begin(), corners.begin() + 3})};
}

std::vector<std::string> gltf_files() {
  const std::string buffer = test::square_buffer();
  const std::string data =
      R"("uri":"data:application/octet-stream;base64,)" + test::base64(buffer) + "\",";
  return {test::square_json(data), test::glb_file(test::square_json(""), buffer)};
}

// One to four places changed: a byte set, a bit turned, bytes taken out, doubled or taken from
// elsewhere in the file.
std::string spoilt(std::string bytes, scene::Random& random) {
  for (std::uint32_t changes = 1 + random.below(4); changes > 0 && !bytes.empty(); --changes) {
    const std::size_t at = random.below(static_cast<std::uint32_t>(bytes.size()));
    const std::size_t from = random.below(static_cast<std::uint32_t>(bytes.size()));
    const std::size_t length = 1 + random.below(12);
    switch (random.below(6)) {
      case 0:
        bytes[at] = static_cast<char>(random.below(256));
        break;
      case 1:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random.below(8)));
        break;
      case 2:
        bytes.erase(at, length);
        break;
      case 3:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 4:
        bytes.insert(at, bytes.substr(from, length));
        break;
      default:
        bytes.replace(at, length, bytes.substr(from, length));
        break;
    }
  }
  return bytes;
}

std::vector<std::string> with_spoilt(std::vector<std::string> files, std::uint32_t each,
                                     std::uint64_t seed) {
  scene::Random random(seed);
  const std::size_t good = files.size();
  for (std::size_t i = 0; i < good; ++i) {
    for (std::uint32_t k = 0; k < each; ++k) files.push_back(spoilt(files[i], random));
  }
  return files;
}

// Random bytes of all lengths up to 700; and those that decode to the simplest inputs.
std::vector<std::string> random_strings(std::uint32_t count, std::uint64_t seed) {
  std::vector<std::string> strings = {"", std::string(40, '\0'), std::string(300, '\xFF')};
  scene::Random random(seed);
  for (std::uint32_t i = 0; i < count; ++i) {
    std::string bytes(4 + random.below(700), '\0');
    // Small values on odd turns: few corners, and the same ones again and again.
    const std::uint32_t bound = i % 2 == 0 ? 256 : 1 + random.below(32);
    for (char& byte : bytes) byte = static_cast<char>(random.below(bound));
    strings.push_back(std::move(bytes));
  }
  return strings;
}

bool write(const std::filesystem::path& folder, const std::vector<std::string>& inputs) {
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::ofstream stream(folder / std::to_string(i), std::ios::binary);
    stream.write(inputs[i].data(), static_cast<std::streamsize>(inputs[i].size()));
    if (!stream.good()) return false;
  }
  return true;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2 || arguments[1][0] == '-') {
    std::fprintf(stderr, "Usage: %s FOLDER\nWrites a corpus for each fuzz target into FOLDER.\n",
                 arguments[0]);
    return 2;
  }
  const std::filesystem::path folder = arguments[1];
  const std::vector<std::pair<std::string, std::vector<std::string>>> corpora = {
      {"obj", with_spoilt(obj_files(), 40, 1)},  {"ply", with_spoilt(ply_files(), 40, 2)},
      {"stl", with_spoilt(stl_files(), 40, 3)},  {"gltf", with_spoilt(gltf_files(), 80, 4)},
      {"build_lattice", random_strings(150, 5)}, {"build_bits", random_strings(150, 6)},
      {"query_lattice", random_strings(150, 7)}, {"query_bits", random_strings(150, 8)},
  };
  for (const auto& [target, inputs] : corpora) {
    if (!write(folder / target, inputs)) {
      std::fprintf(stderr, "%s: cannot write the corpus of %s\n", arguments[0], target.c_str());
      return 1;
    }
  }
  return 0;
}
