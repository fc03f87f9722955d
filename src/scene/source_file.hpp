// SPDX-License-Identifier: Apache-2.0
//
// A mesh file in memory, and the words of a loader's error messages. Private to the loaders.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "scene/load.hpp"
#include "scene/progress.hpp"

namespace zkd::scene {

/// The bytes of a file, and where in them something is wrong.
class SourceFile {
 public:
  /// Reads the whole file. Throws LoadError when it is missing, no regular file, empty or cannot be
  /// read; advances `progress` by its size, which is added to the total by the caller.
  SourceFile(std::filesystem::path path, Progress& progress);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] std::string& bytes() { return bytes_; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }

  /// Which line the byte at `offset` is in, from 1. Lines end in LF, CR or CR LF.
  [[nodiscard]] std::size_t line_of(std::size_t offset) const;

  /// Throws LoadError `path:line: message`.
  [[noreturn]] void fail_in_line(std::size_t line, const std::string& message) const;
  /// Throws LoadError `path: byte offset: message`.
  [[noreturn]] void fail_at_byte(std::size_t offset, const std::string& message) const;
  /// Throws LoadError `path: message`.
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::filesystem::path path_;
  std::string bytes_;
};

/// Why a token is no coordinate; null when it is one.
///
/// The whole token must be a decimal number. It is rounded correctly to float, whatever the locale
/// and the C library; too small for float becomes a denormal or zero, and too large, NaN and
/// infinity are no coordinates.
[[nodiscard]] const char* parse_coordinate(std::string_view token, float& value);

/// A token for an error message: quoted, cut short, control characters as '?'.
[[nodiscard]] std::string in_quotes(std::string_view token);

/// What our own pass over a file found, to hold against what the library read from it: a reader
/// that is lenient where we are strict would otherwise give a smaller or different mesh silently.
struct Outline {
  std::vector<glm::vec3> positions;  ///< correctly rounded
  std::uint64_t polygons = 0;
  std::uint64_t corners = 0;  ///< of all polygons
  std::uint64_t digest = 0;   ///< of all sizes and indices in order
  [[nodiscard]] std::uint64_t triangles() const { return corners - 2 * polygons; }

  /// One more polygon, then its indices one by one.
  void begin_polygon(std::uint64_t size) {
    ++polygons;
    corners += size;
    mix(~size);
  }
  void mix(std::uint64_t value) { digest = (digest ^ value) * 0x9E3779B97F4A7C15u + 1; }
};

/// Whether a library's rounding of a coordinate is the one of `exact` give or take a few ulp.
[[nodiscard]] bool nearly_equal(const glm::vec3& exact, float x, float y, float z);

/// Readers of one format each; `file` is loaded, what they return is complete and checked.
[[nodiscard]] Mesh load_obj(SourceFile& file, Progress& progress);
[[nodiscard]] Mesh load_ply(const SourceFile& file, Progress& progress);
[[nodiscard]] Mesh load_stl(const SourceFile& file, Progress& progress);
[[nodiscard]] Mesh load_gltf(const SourceFile& file, Progress& progress);

}  // namespace zkd::scene
