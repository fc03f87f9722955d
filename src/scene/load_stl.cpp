// SPDX-License-Identifier: Apache-2.0
//
// STL, text and binary: sizes, grammar and numbers read and checked here, with line or byte where
// something is wrong, and a second reading by Assimp that has to agree on every corner.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "scene/second_reader.hpp"
#include "scene/source_file.hpp"

namespace zkd::scene {
namespace {

constexpr std::size_t header_size = 84;    // 80 bytes of anything, a 32-bit count
constexpr std::size_t triangle_size = 50;  // normal, three corners, 16 bits of attributes

std::uint32_t little_endian32(const char* from) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = (value << 8) | static_cast<unsigned char>(from[i]);
  return value;
}

float little_endian_float(const char* from) {
  const std::uint32_t bits = little_endian32(from);
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

std::uint64_t binary_size(std::uint64_t triangles) {
  return header_size + triangles * triangle_size;
}

/// A text file says `solid` first; so do some binary ones, which the size gives away, or a zero
/// byte.
bool is_text(const SourceFile& file) {
  const std::string_view bytes = file.bytes();
  if (bytes.size() >= header_size &&
      binary_size(little_endian32(bytes.data() + 80)) == bytes.size()) {
    return false;
  }
  const std::size_t start = bytes.find_first_not_of(" \t\r\n");
  return start != std::string_view::npos && bytes.substr(start, 5) == "solid" &&
         bytes.substr(0, 512).find('\0') == std::string_view::npos;
}

std::vector<glm::vec3> read_binary(const SourceFile& file) {
  const std::string& bytes = file.bytes();
  if (bytes.size() < header_size) {
    file.fail_at_byte(bytes.size(), "the file ends inside the header of a binary STL");
  }
  const std::uint32_t count = little_endian32(bytes.data() + 80);
  if (bytes.size() < binary_size(count)) {
    file.fail_at_byte(bytes.size(),
                      "the file ends inside triangle " +
                          std::to_string((bytes.size() - header_size) / triangle_size) + " of " +
                          std::to_string(count));
  }
  if (bytes.size() > binary_size(count)) {
    file.fail_at_byte(binary_size(count), std::to_string(bytes.size() - binary_size(count)) +
                                              " bytes more than " + std::to_string(count) +
                                              " triangles need");
  }
  std::vector<glm::vec3> corners;
  corners.reserve(3 * std::size_t{count});
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      glm::vec3 position;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t at = header_size + i * triangle_size + 12 * (corner + 1) + 4 * axis;
        const float value = little_endian_float(bytes.data() + at);
        if (!std::isfinite(value)) {
          file.fail_at_byte(
              at, "a coordinate of triangle " + std::to_string(i) + " is not a finite number");
        }
        position[static_cast<int>(axis)] = value;
      }
      corners.push_back(position);
    }
  }
  return corners;
}

class TextReader {
 public:
  explicit TextReader(const SourceFile& file) : file_(file), rest_(file.bytes()) {}

  std::vector<glm::vec3> read() {
    while (next(true)) {
      if (word_ != "solid") fail("expected 'solid', found " + in_quotes(word_));
      skip_line();
      solid();
      skip_line();
    }
    return std::move(corners_);
  }

 private:
  void solid() {
    for (next(false); word_ == "facet"; next(false)) {
      expect("normal");
      for (int i = 0; i < 3; ++i) next(false);
      expect("outer");
      expect("loop");
      for (int corner = 0; corner < 3; ++corner) {
        expect("vertex");
        glm::vec3 position;
        for (int axis = 0; axis < 3; ++axis) {
          next(false);
          float value = 0.0F;
          if (const char* why = parse_coordinate(word_, value)) {
            fail("coordinate " + in_quotes(word_) + " " + why);
          }
          position[axis] = value;
        }
        corners_.push_back(position);
      }
      expect("endloop");
      expect("endfacet");
    }
    if (word_ != "endsolid") fail("expected 'facet' or 'endsolid', found " + in_quotes(word_));
  }

  void expect(std::string_view what) {
    next(false);
    if (word_ != what) fail("expected '" + std::string(what) + "', found " + in_quotes(word_));
  }

  /// The next word, in whatever line; false at the end of the file, if it may end here.
  bool next(bool may_end) {
    while (!rest_.empty() && is_space(rest_[0])) {
      if (rest_[0] == '\n') ++line_;
      rest_.remove_prefix(1);
    }
    if (rest_.empty()) {
      if (may_end) return false;
      fail("the file ends inside a solid, after " + std::to_string(corners_.size() / 3) +
           " whole triangles");
    }
    std::size_t length = 0;
    while (length < rest_.size() && !is_space(rest_[length])) ++length;
    word_ = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return true;
  }

  void skip_line() { rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size())); }

  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

  [[noreturn]] void fail(const std::string& message) const { file_.fail_in_line(line_, message); }

  const SourceFile& file_;
  std::string_view rest_;
  std::string_view word_;
  std::size_t line_ = 1;
  std::vector<glm::vec3> corners_;
};

}  // namespace

Mesh load_stl(const SourceFile& file, Progress& progress) {
  Mesh mesh;
  mesh.positions = is_text(file) ? TextReader(file).read() : read_binary(file);
  progress.advance(file.size());
  if (mesh.positions.empty()) file.fail("contains no triangle");
  if (mesh.positions.size() > max_count) file.fail("has more than 715827882 triangles");

  mesh.faces.reserve(mesh.positions.size() / 3);
  for (std::uint32_t corner = 0; corner < mesh.positions.size(); corner += 3) {
    mesh.faces.emplace_back(corner, corner + 1, corner + 2);
  }
  compare_stl_with_assimp(file, mesh);
  return mesh;
}

}  // namespace zkd::scene
