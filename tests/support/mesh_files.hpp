// SPDX-License-Identifier: Apache-2.0
//
// The bytes of small mesh files: good ones, to be tried as they are and to be spoilt.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <glm/ext/vector_float3.hpp>

namespace zkd::test {

/// The bytes of a value, least significant first (x86-64 and AArch64 store it so).
template <typename Value>
std::string little_endian(Value value) {
  std::string bytes(sizeof(Value), '\0');
  std::memcpy(bytes.data(), &value, sizeof(Value));
  return bytes;
}

template <typename Value>
std::string big_endian(Value value) {
  const std::string bytes = little_endian(value);
  return {bytes.rbegin(), bytes.rend()};
}

// ---- PLY ----------------------------------------------------------------------------------------

inline std::string ply_header(const std::string& format, int vertices, int faces,
                              const std::string& coordinate = "float",
                              const std::string& list = "uchar int") {
  return "ply\nformat " + format + " 1.0\ncomment made by a test\nelement vertex " +
         std::to_string(vertices) + "\nproperty " + coordinate + " x\nproperty " + coordinate +
         " y\nproperty " + coordinate + " z\nelement face " + std::to_string(faces) +
         "\nproperty list " + list + " vertex_indices\nend_header\n";
}

inline const std::vector<glm::vec3> ply_corners{
    {0, 0, 0}, {1.5F, 0, 0}, {1.25F, 1, 0}, {0, 1, -3.1F}};

/// Four vertices, a quad and a triangle.
template <typename Coordinate, typename Count, typename Index, bool big>
std::string ply_body() {
  const auto bytes = [](auto value) { return big ? big_endian(value) : little_endian(value); };
  std::string body;
  for (const glm::vec3& p : ply_corners) {
    for (int a = 0; a < 3; ++a) body += bytes(static_cast<Coordinate>(p[a]));
  }
  body += bytes(static_cast<Count>(4));
  for (const int i : {0, 1, 2, 3}) body += bytes(static_cast<Index>(i));
  body += bytes(static_cast<Count>(3));
  for (const int i : {3, 1, 0}) body += bytes(static_cast<Index>(i));
  return body;
}

// ---- STL ----------------------------------------------------------------------------------------

inline std::string binary_stl(const std::vector<glm::vec3>& corners,
                              const std::string& start = "made") {
  std::string bytes = start;
  bytes.resize(80, ' ');
  bytes += little_endian(static_cast<std::uint32_t>(corners.size() / 3));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i % 3 == 0) bytes += std::string(12, '\0');
    for (int a = 0; a < 3; ++a) bytes += little_endian(corners[i][a]);
    if (i % 3 == 2) bytes += std::string(2, '\0');
  }
  return bytes;
}

inline std::string stl_facet(const std::string& a, const std::string& b, const std::string& c) {
  return "  facet normal 0 0 1\n    outer loop\n      vertex " + a + "\n      vertex " + b +
         "\n      vertex " + c + "\n    endloop\n  endfacet\n";
}

// ---- glTF ---------------------------------------------------------------------------------------

/// Four positions and the indices 0 1 2, 0 2 3 as 16 bits: 48 + 12 bytes.
inline std::string square_buffer() {
  std::string bytes;
  for (const float x : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 1.0F, 1.0F, 0.0F, 0.0F, 1.0F, 0.25F}) {
    bytes += little_endian(x);
  }
  for (const int i : {0, 1, 2, 0, 2, 3}) bytes += little_endian(static_cast<std::uint16_t>(i));
  return bytes;
}

/// A scene of one square, twice: moved by (10, 0, 0) and, inside a node that doubles sizes, turned
/// by a quarter round z. `uri` is `"uri":"...",` or nothing.
inline std::string square_json(const std::string& uri) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[
{"mesh":0,"translation":[10,0,0]},
{"children":[2],"scale":[2,2,2]},
{"mesh":0,"matrix":[0,1,0,0,-1,0,0,0,0,0,1,0,0,0,3,1]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[
{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0.25]},
{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},
{"buffer":0,"byteOffset":48,"byteLength":12}],
"buffers":[{)" +
         uri + R"("byteLength":60}]})";
}

inline std::string glb_file(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto number = [](std::size_t n) { return little_endian(static_cast<std::uint32_t>(n)); };
  return "glTF" + number(2) + number(28 + json.size() + binary.size()) + number(json.size()) +
         "JSON" + json + number(binary.size()) + std::string("BIN\0", 4) + binary;
}

inline std::string base64(const std::string& bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i + 2 < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = (bits << 8) | static_cast<unsigned char>(bytes[i + k]);
    for (int shift = 18; shift >= 0; shift -= 6) text += digits[(bits >> shift) & 63u];
  }
  return text;
}

}  // namespace zkd::test
