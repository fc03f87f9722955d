// SPDX-License-Identifier: Apache-2.0
//
// OBJ read once more by tinyobjloader. It reads on where a file is broken (`zz` and `nan` become 0,
// faces of two corners and indices past the end pass), and its numbers may be an ulp off: what it
// read is only compared.
#include <tiny_obj_loader.h>

#include <algorithm>
#include <istream>
#include <streambuf>

#include "scene/second_reader.hpp"

namespace zkd::scene {
namespace {

constexpr std::size_t chunk = std::size_t{1} << 20;

/// Text in memory as a stream, in pieces so that progress can be seen.
class TextStream : public std::streambuf {
 public:
  TextStream(std::string& text, Progress& progress) : text_(text), progress_(progress) {}

 protected:
  int_type underflow() override {
    if (next_ == text_.size()) return traits_type::eof();
    const std::size_t size = std::min(chunk, text_.size() - next_);
    char* const first = text_.data() + next_;
    setg(first, first, first + size);
    next_ += size;
    progress_.advance(size);
    return traits_type::to_int_type(*first);
  }

 private:
  std::string& text_;
  Progress& progress_;
  std::size_t next_ = 0;
};

/// What tinyobjloader calls back with, held against what is expected.
struct Comparison {
  const SourceFile& file;
  const Mesh& expected;
  std::uint64_t vertices = 0;
  Outline seen;

  void vertex(float x, float y, float z) {
    if (vertices >= expected.positions.size() ||
        !nearly_equal(expected.positions[vertices], x, y, z)) {
      disagree("vertex " + std::to_string(vertices + 1));
    }
    ++vertices;
  }

  void polygon(const tinyobj::index_t* corners, int count) {
    seen.begin_polygon(static_cast<std::uint64_t>(count));
    const auto resolve = [this](int index) {
      return static_cast<std::uint32_t>(index > 0 ? std::int64_t{index} - 1
                                                  : static_cast<std::int64_t>(vertices) + index);
    };
    for (int i = 0; i < count; ++i) seen.corner(resolve(corners[i].vertex_index));
  }

  [[noreturn]] void disagree(const std::string& where) const {
    file.fail("tinyobjloader and zkd read " + where + " differently; the file is not trusted");
  }
};

}  // namespace

void compare_obj_with_tinyobjloader(SourceFile& file, const Reading& reading, Progress& progress) {
  Comparison comparison{file, reading.mesh, 0, {}};
  tinyobj::callback_t callbacks;
  callbacks.vertex_cb = [](void* to, float x, float y, float z, float) {
    static_cast<Comparison*>(to)->vertex(x, y, z);
  };
  callbacks.index_cb = [](void* to, tinyobj::index_t* corners, int count) {
    static_cast<Comparison*>(to)->polygon(corners, count);
  };
  TextStream buffer(file.bytes(), progress);
  std::istream stream(&buffer);
  std::string warnings;
  std::string errors;
  if (!tinyobj::LoadObjWithCallback(stream, callbacks, &comparison, nullptr, &warnings, &errors)) {
    file.fail("tinyobjloader: " + errors.substr(0, errors.find('\n')));
  }
  if (comparison.vertices != reading.mesh.positions.size()) {
    comparison.disagree("the number of vertices");
  }
  if (comparison.seen != reading.outline) comparison.disagree("the faces");
}

}  // namespace zkd::scene
