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

  /// Throws LoadError `path:line: message`. Control characters of a message become '?', here and
  /// below.
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

/// A token for an error message: quoted, cut short.
[[nodiscard]] std::string in_quotes(std::string_view token);

/// Polygons in a few numbers: two readings of a file that agree in all of them are the same.
struct Outline {
  std::uint64_t polygons = 0;
  std::uint64_t corners = 0;  ///< of all polygons
  std::uint64_t digest = 0;   ///< of all sizes and indices in order

  /// One more polygon, then its corners one by one.
  void begin_polygon(std::uint64_t size) {
    ++polygons;
    corners += size;
    mix(~size);
  }
  void corner(std::uint64_t index) { mix(index); }

  friend bool operator==(const Outline&, const Outline&) = default;

 private:
  void mix(std::uint64_t value) { digest = (digest ^ value) * 0x9E3779B97F4A7C15u + 1; }
};

/// What our own pass over a file has read: the mesh, complete, and the outline that a library's
/// reading of the same file must have (second_reader.hpp).
struct Reading {
  Mesh mesh;  ///< coordinates correctly rounded
  Outline outline;
  [[nodiscard]] std::uint64_t triangles() const { return outline.corners - 2 * outline.polygons; }

  /// One more polygon, then its corners one by one: they become the fan round the first.
  void begin_polygon(std::uint64_t size) {
    outline.begin_polygon(size);
    corners_ = 0;
  }
  void corner(std::uint64_t index) {
    outline.corner(index);
    const auto vertex = static_cast<std::uint32_t>(index);  // its range is checked by the reader
    if (corners_ >= 2) mesh.faces.emplace_back(first_, last_, vertex);
    if (corners_ == 0) first_ = vertex;
    last_ = vertex;
    ++corners_;
  }

 private:
  std::uint64_t corners_ = 0;  // of the polygon that has begun
  std::uint32_t first_ = 0;
  std::uint32_t last_ = 0;
};

/// Readers of one format each; `file` is loaded, what they return is complete and checked.
[[nodiscard]] Mesh load_obj(SourceFile& file, Progress& progress);
[[nodiscard]] Mesh load_ply(const SourceFile& file, Progress& progress);
[[nodiscard]] Mesh load_stl(const SourceFile& file, Progress& progress);
[[nodiscard]] Mesh load_gltf(const SourceFile& file, Progress& progress);

}  // namespace zkd::scene
