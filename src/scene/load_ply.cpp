// SPDX-License-Identifier: Apache-2.0
//
// PLY, text and binary: our own strict walk along the header's elements, with line or byte where
// something is wrong, and a second reading by Assimp that has to agree on everything.
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "scene/second_reader.hpp"
#include "scene/source_file.hpp"

namespace zkd::scene {
namespace {

enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

constexpr std::array<std::pair<std::string_view, Type>, 16> type_names{{
    {"char", Type::int8},
    {"int8", Type::int8},
    {"uchar", Type::uint8},
    {"uint8", Type::uint8},
    {"short", Type::int16},
    {"int16", Type::int16},
    {"ushort", Type::uint16},
    {"uint16", Type::uint16},
    {"int", Type::int32},
    {"int32", Type::int32},
    {"uint", Type::uint32},
    {"uint32", Type::uint32},
    {"float", Type::float32},
    {"float32", Type::float32},
    {"double", Type::float64},
    {"float64", Type::float64},
}};

constexpr std::size_t size_of(Type type) {
  constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

constexpr bool is_integer(Type type) { return type != Type::float32 && type != Type::float64; }

struct Property {
  std::string name;
  Type type = Type::float32;
  std::optional<Type> count_type;  // of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Format { text, little_endian, big_endian };

struct Header {
  Format format = Format::text;
  std::vector<Element> elements;
  std::size_t body = 0;       // offset of the first byte after the header
  std::size_t body_line = 1;  // and its line
};

std::vector<std::string_view> split(std::string_view line) {
  constexpr std::string_view blanks = " \t\r";
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(blanks); at != std::string_view::npos;
       at = line.find_first_not_of(blanks, at)) {
    const std::size_t end = std::min(line.find_first_of(blanks, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

class HeaderReader {
 public:
  explicit HeaderReader(const SourceFile& file) : file_(file) {}

  Header read() {
    if (!next() || words_.size() != 1 || words_[0] != "ply") fail("a PLY file begins with 'ply'");
    if (!next() || words_.size() != 3 || words_[0] != "format") fail("'format' is missing");
    format();
    while (next()) {
      if (words_.empty() || words_[0] == "comment" || words_[0] == "obj_info") continue;
      if (words_[0] == "end_header") {
        header_.body = at_;
        header_.body_line = line_ + 1;
        check();
        return std::move(header_);
      }
      if (words_[0] == "element") {
        element();
      } else if (words_[0] == "property") {
        property();
      } else {
        fail(in_quotes(words_[0]) + " is not known in a PLY header");
      }
    }
    fail("the file ends inside its header");
  }

 private:
  bool next() {
    const std::string& text = file_.bytes();
    const std::size_t end = text.find('\n', at_);
    ++line_;
    if (end == std::string::npos) return false;
    words_ = split(std::string_view(text).substr(at_, end - at_));
    at_ = end + 1;
    return true;
  }

  void format() {
    if (words_[1] == "ascii") {
      header_.format = Format::text;
    } else if (words_[1] == "binary_little_endian") {
      header_.format = Format::little_endian;
    } else if (words_[1] == "binary_big_endian") {
      header_.format = Format::big_endian;
    } else {
      fail("unknown format " + in_quotes(words_[1]));
    }
    if (words_[2] != "1.0") fail("unknown version " + in_quotes(words_[2]));
  }

  void element() {
    std::uint64_t count = 0;
    if (words_.size() != 3) fail("'element' needs a name and a count");
    const char* const end = words_[2].data() + words_[2].size();
    const auto [stop, error] = std::from_chars(words_[2].data(), end, count);
    if (error != std::errc() || stop != end) {
      fail("the count " + in_quotes(words_[2]) + " is not a number");
    }
    if (count > max_count) fail("a count of " + std::to_string(count) + " is more than 2147483647");
    for (const Element& other : header_.elements) {
      if (other.name == words_[1]) fail("a second element " + in_quotes(words_[1]));
    }
    if (words_[1] == "tristrips") fail("triangle strips are not supported");
    header_.elements.push_back({std::string(words_[1]), count, {}});
  }

  void property() {
    if (header_.elements.empty()) fail("a property before the first element");
    const bool list = words_.size() == 5 && words_[1] == "list";
    if (!list && words_.size() != 3) fail("'property' needs a type and a name");
    Property property;
    property.name = words_.back();
    property.type = type(words_[words_.size() - 2]);
    if (list) {
      property.count_type = type(words_[2]);
      if (!is_integer(*property.count_type)) fail("a list's count must be an integer");
    }
    for (const Property& other : header_.elements.back().properties) {
      if (other.name == property.name) fail("a second property " + in_quotes(property.name));
    }
    header_.elements.back().properties.push_back(std::move(property));
  }

  Type type(std::string_view word) const {
    for (const auto& [name, type] : type_names) {
      if (name == word) return type;
    }
    fail("unknown type " + in_quotes(word));
  }

  void check() const {
    bool vertices = false;
    bool faces = false;
    for (const Element& element : header_.elements) {
      if (element.properties.empty())
        fail("element " + in_quotes(element.name) + " has no properties");
      if (element.name == "vertex") {
        vertices = true;
        for (const char* name : {"x", "y", "z"}) {
          bool found = false;
          for (const Property& p : element.properties) found |= p.name == name && !p.count_type;
          if (!found) fail(std::string("element 'vertex' has no property '") + name + "'");
        }
      } else if (element.name == "face") {
        faces = element.count > 0;
        bool found = false;
        for (const Property& p : element.properties) {
          if (p.name != "vertex_indices" && p.name != "vertex_index") continue;
          if (!p.count_type || !is_integer(p.type))
            fail("the vertex indices are no list of integers");
          if (found) fail("a second list of vertex indices");
          found = true;
        }
        if (!found) fail("element 'face' has no list 'vertex_indices'");
      }
    }
    if (!vertices) fail("there is no element 'vertex'");
    if (!faces) file_.fail("contains no triangle");
  }

  [[noreturn]] void fail(const std::string& message) const { file_.fail_in_line(line_, message); }

  const SourceFile& file_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;
  std::vector<std::string_view> words_;
  Header header_;
};

std::string row_name(const Element& element, std::uint64_t row) {
  return element.name + " " + std::to_string(row) + " of " + std::to_string(element.count);
}

/// The values of a text body: one row a line.
class TextBody {
 public:
  TextBody(const SourceFile& file, const Header& header)
      : file_(file), text_(file.bytes()), at_(header.body), line_(header.body_line - 1) {}

  void begin_row(const Element& element, std::uint64_t row) {
    while (true) {
      if (at_ >= text_.size()) {
        file_.fail_in_line(line_, "the file ends before " + row_name(element, row));
      }
      const std::size_t end = std::min(text_.find('\n', at_), text_.size());
      rest_ = text_.substr(at_, end - at_);
      at_ = end + 1;
      ++line_;
      skip_blanks();
      if (!rest_.empty()) return;
    }
  }

  void skip(Type, const Element& element, std::uint64_t row) { token(element, row); }

  std::int64_t integer(Type, const Element& element, std::uint64_t row) {
    const std::string_view word = token(element, row);
    std::int64_t value = 0;
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (error != std::errc() || stop != end) {
      fail(in_quotes(word) + " in " + row_name(element, row) + " is not an integer");
    }
    return value;
  }

  float coordinate(Type, const Element& element, std::uint64_t row) {
    const std::string_view word = token(element, row);
    float value = 0.0F;
    if (const char* why = parse_coordinate(word, value)) {
      fail("coordinate " + in_quotes(word) + " of " + row_name(element, row) + " " + why);
    }
    return value;
  }

  void expect(std::int64_t, Type, const Element&, std::uint64_t) const {}

  void end_row(const Element& element, std::uint64_t row) {
    if (!rest_.empty()) {
      fail(row_name(element, row) + " has more values than the header says: " +
           in_quotes(rest_.substr(0, rest_.find_first_of(blanks))));
    }
  }

  void end() {
    const std::size_t more = text_.find_first_not_of(" \t\r\n", at_);
    if (at_ < text_.size() && more != std::string_view::npos) {
      file_.fail_in_line(file_.line_of(more), "there is more than the header says");
    }
  }

  [[noreturn]] void fail(const std::string& message) const { file_.fail_in_line(line_, message); }

  [[nodiscard]] std::size_t position() const { return std::min(at_, text_.size()); }

 private:
  static constexpr std::string_view blanks = " \t\r";

  void skip_blanks() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(blanks), rest_.size()));
  }

  std::string_view token(const Element& element, std::uint64_t row) {
    if (rest_.empty()) fail(row_name(element, row) + " has fewer values than the header says");
    const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks));
    rest_.remove_prefix(word.size());
    skip_blanks();
    return word;
  }

  const SourceFile& file_;
  std::string_view text_;
  std::size_t at_;
  std::size_t line_;
  std::string_view rest_;  // of the current line
};

/// The values of a binary body, in either byte order.
class BinaryBody {
 public:
  BinaryBody(const SourceFile& file, const Header& header)
      : file_(file),
        at_(header.body),
        swap_((header.format == Format::big_endian) ==
              (std::endian::native == std::endian::little)) {}

  void begin_row(const Element&, std::uint64_t) {}

  void skip(Type type, const Element& element, std::uint64_t row) {
    take(size_of(type), element, row);
  }

  std::int64_t integer(Type type, const Element& element, std::uint64_t row) {
    const char* const from = take(size_of(type), element, row);
    switch (type) {
      case Type::int8:
        return decode<std::int8_t>(from);
      case Type::uint8:
        return decode<std::uint8_t>(from);
      case Type::int16:
        return decode<std::int16_t>(from);
      case Type::uint16:
        return decode<std::uint16_t>(from);
      case Type::int32:
        return decode<std::int32_t>(from);
      default:
        return decode<std::uint32_t>(from);
    }
  }

  float coordinate(Type type, const Element& element, std::uint64_t row) {
    float value = 0.0F;
    if (type == Type::float32) {
      value = decode<float>(take(4, element, row));
    } else if (type == Type::float64) {
      value = static_cast<float>(decode<double>(take(8, element, row)));
    } else {
      value = static_cast<float>(integer(type, element, row));
    }
    if (!std::isfinite(value)) {
      fail("a coordinate of " + row_name(element, row) +
           " is not a finite number in single precision");
    }
    return value;
  }

  /// That `count` more values can still come: before anything is done for them.
  void expect(std::int64_t count, Type type, const Element& element, std::uint64_t row) const {
    const std::uint64_t left = (file_.size() - at_) / size_of(type);
    if (static_cast<std::uint64_t>(count) > left) ends_inside(element, row);
  }

  void end_row(const Element&, std::uint64_t) {}

  void end() {
    if (at_ != file_.size()) {
      file_.fail_at_byte(at_,
                         std::to_string(file_.size() - at_) + " bytes more than the header says");
    }
  }

  [[noreturn]] void fail(const std::string& message) const { file_.fail_at_byte(last_, message); }

  [[nodiscard]] std::size_t position() const { return at_; }

 private:
  const char* take(std::size_t size, const Element& element, std::uint64_t row) {
    if (file_.size() - at_ < size) ends_inside(element, row);
    last_ = at_;
    at_ += size;
    return file_.bytes().data() + last_;
  }

  [[noreturn]] void ends_inside(const Element& element, std::uint64_t row) const {
    file_.fail_at_byte(file_.size(), "the file ends inside " + row_name(element, row));
  }

  template <typename Value>
  Value decode(const char* from) const {
    std::array<char, sizeof(Value)> raw;
    std::memcpy(raw.data(), from, sizeof(Value));
    if (swap_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<Value>(raw);
  }

  const SourceFile& file_;
  std::size_t at_;
  std::size_t last_ = 0;  // where the value read last begins
  bool swap_;
};

template <typename Body>
class BodyWalk {
 public:
  BodyWalk(const SourceFile& file, const Header& header, Progress& progress)
      : file_(file), body_(file, header), progress_(progress) {
    for (const Element& element : header.elements) {
      if (element.name == "vertex") vertex_count_ = element.count;
    }
    reading_.mesh.positions.reserve(std::min<std::uint64_t>(vertex_count_, file.size()));
    for (const Element& element : header.elements) {
      for (std::uint64_t row = 0; row < element.count; ++row) {
        body_.begin_row(element, row);
        if (element.name == "vertex") {
          vertex(element, row);
        } else {
          other(element, row, element.name == "face");
        }
        body_.end_row(element, row);
        if (row % 16384 == 0) report();
      }
    }
    body_.end();
    report();
  }

  Reading take() { return std::move(reading_); }

 private:
  void vertex(const Element& element, std::uint64_t row) {
    glm::vec3 position(0.0F);
    for (const Property& property : element.properties) {
      const bool xyz =
          property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z';
      if (property.count_type) {
        skip_list(property, element, row);
      } else if (xyz) {
        position[property.name[0] - 'x'] = body_.coordinate(property.type, element, row);
      } else {
        body_.skip(property.type, element, row);
      }
    }
    reading_.mesh.positions.push_back(position);
  }

  void other(const Element& element, std::uint64_t row, bool face) {
    for (const Property& property : element.properties) {
      if (!property.count_type) {
        body_.skip(property.type, element, row);
      } else if (face && (property.name == "vertex_indices" || property.name == "vertex_index")) {
        polygon(property, element, row);
      } else {
        skip_list(property, element, row);
      }
    }
  }

  void polygon(const Property& property, const Element& element, std::uint64_t row) {
    const std::int64_t size = body_.integer(*property.count_type, element, row);
    if (size < 3) {
      body_.fail(row_name(element, row) + " has " + std::to_string(size) +
                 " corners; a triangle needs 3");
    }
    body_.expect(size, property.type, element, row);
    reading_.begin_polygon(static_cast<std::uint64_t>(size));
    for (std::int64_t i = 0; i < size; ++i) {
      const std::int64_t index = body_.integer(property.type, element, row);
      if (index < 0 || index >= static_cast<std::int64_t>(vertex_count_)) {
        body_.fail(row_name(element, row) + " names vertex " + std::to_string(index) + " of " +
                   std::to_string(vertex_count_));
      }
      reading_.corner(static_cast<std::uint64_t>(index));
    }
  }

  void skip_list(const Property& property, const Element& element, std::uint64_t row) {
    const std::int64_t size = body_.integer(*property.count_type, element, row);
    if (size < 0) body_.fail("a list of " + row_name(element, row) + " has a negative length");
    body_.expect(size, property.type, element, row);
    for (std::int64_t i = 0; i < size; ++i) body_.skip(property.type, element, row);
  }

  void report() {
    progress_.advance(body_.position() - reported_);
    reported_ = body_.position();
  }

  const SourceFile& file_;
  Body body_;
  Progress& progress_;
  std::size_t reported_ = 0;
  std::uint64_t vertex_count_ = 0;
  Reading reading_;
};

}  // namespace

Mesh load_ply(const SourceFile& file, Progress& progress) {
  const Header header = HeaderReader(file).read();
  Reading reading = header.format == Format::text
                        ? BodyWalk<TextBody>(file, header, progress).take()
                        : BodyWalk<BinaryBody>(file, header, progress).take();
  if (reading.triangles() > max_count) file.fail("has more than 2147483647 triangles");
  compare_ply_with_assimp(file, reading);
  return std::move(reading.mesh);
}

}  // namespace zkd::scene
