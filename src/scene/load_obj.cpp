// SPDX-License-Identifier: Apache-2.0
//
// Wavefront OBJ: our own strict reading of every `v` and `f`, with the line where something is
// wrong, and a second reading by tinyobjloader that has to agree on everything.
#include <algorithm>
#include <charconv>
#include <limits>
#include <utility>

#include "scene/second_reader.hpp"
#include "scene/source_file.hpp"

namespace zkd::scene {
namespace {

constexpr std::size_t chunk = std::size_t{1} << 20;

/// The text of an OBJ file, statement by statement.
class ObjScan {
 public:
  ObjScan(SourceFile& file, Progress& progress) : file_(file), text_(file.bytes()) {
    blank_byte_order_mark();
    join_continued_lines();
    scan(progress);
    check_forward_references();
  }

  [[nodiscard]] Reading take() { return std::move(reading_); }

 private:
  // The text is only ever overwritten by blanks, so offsets stay; lines that were joined are
  // counted again when an error is reported.
  void blank_byte_order_mark() {
    if (text_.starts_with("\xEF\xBB\xBF")) std::fill_n(text_.begin(), 3, ' ');
  }

  void join_continued_lines() {
    for (std::size_t at = text_.find('\\'); at != std::string::npos;
         at = text_.find('\\', at + 1)) {
      std::size_t end = at + 1;
      if (end < text_.size() && text_[end] == '\r') ++end;
      if (end < text_.size() && text_[end] == '\n') ++end;
      if (end == at + 1) continue;
      std::fill(text_.begin() + static_cast<std::ptrdiff_t>(at),
                text_.begin() + static_cast<std::ptrdiff_t>(end), ' ');
      joined_.push_back(at);
    }
  }

  void scan(Progress& progress) {
    std::size_t reported = 0;
    for (std::size_t at = 0; at < text_.size();) {
      std::size_t end = at;
      while (end < text_.size() && text_[end] != '\n' && text_[end] != '\r') ++end;
      statement(at, end);
      at = end + 1;
      if (at - reported >= chunk) {
        progress.advance(at - reported);
        reported = at;
      }
    }
  }

  void statement(std::size_t at, std::size_t end) {
    at = skip_blanks(at, end);
    if (at == end) return;
    const std::size_t word_end = token_end(at, end);
    const std::string_view word(text_.data() + at, word_end - at);
    if (word == "v") {
      vertex(word_end, strip_comment(word_end, end), at);
    } else if (word == "f") {
      face(word_end, strip_comment(word_end, end), at);
    } else if (word == "fo" || word == "call" || word == "csh") {
      fail(at, "the statement " + in_quotes(word) + " is not supported");
    }
  }

  /// A comment may follow a statement; a lenient reader would read on in it.
  std::size_t strip_comment(std::size_t at, std::size_t end) {
    const auto first = text_.begin() + static_cast<std::ptrdiff_t>(at);
    const auto last = text_.begin() + static_cast<std::ptrdiff_t>(end);
    std::fill(std::find(first, last, '#'), last, ' ');
    return end;
  }

  void vertex(std::size_t at, std::size_t end, std::size_t start) {
    float xyz[3] = {};
    int count = 0;
    while ((at = skip_blanks(at, end)) != end) {
      const std::size_t stop = token_end(at, end);
      const std::string_view token(text_.data() + at, stop - at);
      float value = 0.0F;
      if (const char* why = parse_coordinate(token, value)) {
        fail(at, (count < 3 ? "coordinate " : "value ") + in_quotes(token) + " of a vertex " + why);
      }
      if (count < 3) xyz[count] = value;
      ++count;
      at = stop;
    }
    if (count < 3) fail(start, "a vertex needs 3 coordinates, not " + std::to_string(count));
    reading_.mesh.positions.emplace_back(xyz[0], xyz[1], xyz[2]);
  }

  void face(std::size_t at, std::size_t end, std::size_t start) {
    indices_.clear();
    while ((at = skip_blanks(at, end)) != end) {
      const std::size_t stop = token_end(at, end);
      indices_.push_back(corner(at, stop));
      at = stop;
    }
    if (indices_.size() < 3) {
      fail(start, "a face needs 3 corners, not " + std::to_string(indices_.size()));
    }
    reading_.begin_polygon(indices_.size());
    for (const std::uint64_t index : indices_) reading_.corner(index);
  }

  /// The vertex a corner `v`, `v/vt`, `v//vn` or `v/vt/vn` names, counted from 0.
  std::uint64_t corner(std::size_t at, std::size_t stop) {
    const std::string_view token(text_.data() + at, stop - at);
    const std::size_t slash = token.find('/');
    const std::string_view first = token.substr(0, slash);
    std::int64_t index = 0;
    if (!parse_index(first, index)) fail(at, "corner " + in_quotes(token) + " is not an index");
    if (slash != std::string_view::npos) check_attributes(token, slash, at);
    if (index == 0) fail(at, "vertex index 0: OBJ counts from 1");
    const auto known = static_cast<std::int64_t>(reading_.mesh.positions.size());
    if (index < 0) {
      if (-index > known) {
        fail(at, "vertex index " + std::string(first) + " reaches back before the first of " +
                     std::to_string(known) + " vertices");
      }
      return static_cast<std::uint64_t>(known + index);
    }
    if (index > known && (forward_.empty() || index > forward_.back().second)) {
      forward_.emplace_back(at, index);
    }
    return static_cast<std::uint64_t>(index - 1);
  }

  static bool parse_index(std::string_view token, std::int64_t& index) {
    if (token.size() > 1 && token[0] == '+' && token[1] != '-') token.remove_prefix(1);
    const char* const end = token.data() + token.size();
    const auto [stop, error] = std::from_chars(token.data(), end, index);
    return error == std::errc() && stop == end && index >= -std::int64_t{max_count};
  }

  /// Texture and normal indices are not used here, but a face that has nonsense there is broken.
  void check_attributes(std::string_view token, std::size_t slash, std::size_t at) {
    std::string_view rest = token.substr(slash + 1);
    for (int part = 0;; ++part) {
      const std::size_t next = rest.find('/');
      const std::string_view attribute = rest.substr(0, next);
      std::int64_t ignored = 0;
      if (part > 1 || (!attribute.empty() && !parse_index(attribute, ignored))) {
        fail(at, "corner " + in_quotes(token) + " is not an index");
      }
      if (next == std::string_view::npos) return;
      rest.remove_prefix(next + 1);
    }
  }

  /// A face may name a vertex that comes later, but one that never comes is an error. Of the
  /// indices ahead of their time only those larger than all before are kept: the first that is too
  /// large in the end is always among them.
  void check_forward_references() {
    const auto count = static_cast<std::int64_t>(reading_.mesh.positions.size());
    for (const auto& [at, index] : forward_) {
      if (index > count) {
        fail(at, "vertex index " + std::to_string(index) + " is out of range: the file has " +
                     std::to_string(count) + " vertices");
      }
    }
  }

  [[nodiscard]] std::size_t skip_blanks(std::size_t at, std::size_t end) const {
    while (at < end && is_blank(text_[at])) ++at;
    return at;
  }

  [[nodiscard]] std::size_t token_end(std::size_t at, std::size_t end) const {
    while (at < end && !is_blank(text_[at])) ++at;
    return at;
  }

  static bool is_blank(char c) { return c == ' ' || c == '\t'; }

  [[noreturn]] void fail(std::size_t at, const std::string& message) const {
    const auto joins = std::lower_bound(joined_.begin(), joined_.end(), at) - joined_.begin();
    file_.fail_in_line(file_.line_of(at) + static_cast<std::size_t>(joins), message);
  }

  SourceFile& file_;
  std::string& text_;
  std::vector<std::size_t> joined_;  // offsets of the backslashes that joined two lines
  std::vector<std::pair<std::size_t, std::int64_t>> forward_;
  std::vector<std::uint64_t> indices_;
  Reading reading_;
};

}  // namespace

Mesh load_obj(SourceFile& file, Progress& progress) {
  Reading reading = ObjScan(file, progress).take();
  if (reading.outline.polygons == 0) file.fail("contains no triangle");
  if (reading.mesh.positions.size() > max_count || reading.triangles() > max_count) {
    file.fail("has more than 2147483647 vertices or triangles");
  }
  compare_obj_with_tinyobjloader(file, reading, progress);
  return std::move(reading.mesh);
}

}  // namespace zkd::scene
