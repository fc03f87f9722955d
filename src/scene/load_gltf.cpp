// SPDX-License-Identifier: Apache-2.0
//
// glTF 2.0 and GLB: the file's own counts and indices held against its buffers, then Assimp.
//
// Assimp trusts accessors and passes over what it does not know. So everything a drawn triangle
// hangs on is checked here first (chunks, buffers, views, accessors, indices, the node tree), and
// Assimp has to bring as many triangles as the file says.
#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "scene/assimp_reader.hpp"
#include "scene/source_file.hpp"

namespace zkd::scene {
namespace {

using nlohmann::json;

constexpr std::uint32_t glb_magic = 0x46546C67u;   // "glTF"
constexpr std::uint32_t json_chunk = 0x4E4F534Au;  // "JSON"
constexpr std::uint32_t bin_chunk = 0x004E4942u;   // "BIN"

// Assimp calls itself for each level of the JSON and of the node tree, and would overflow the
// stack.
constexpr int most_json_levels = 256;
constexpr std::uint32_t most_node_levels = 1024;

std::uint32_t little_endian(std::string_view bytes, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t i = size; i-- > 0;) {
    value = (value << 8) | static_cast<unsigned char>(bytes[at + i]);
  }
  return value;
}

std::size_t component_size(std::uint64_t type) {
  switch (type) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5125:
    case 5126:
      return 4;
    default:
      return 0;
  }
}

/// Everything a triangle of the default scene hangs on.
class GltfCheck {
 public:
  explicit GltfCheck(const SourceFile& file) : file_(file) {
    parse();
    check_version();
    read_buffers();
    count_scene();
  }

  [[nodiscard]] std::uint64_t triangles() const { return triangles_; }

 private:
  void parse() {
    const std::string_view bytes = file_.bytes();
    std::string_view text = bytes;
    std::size_t text_at = 0;
    if (bytes.size() >= 4 && little_endian(bytes, 0, 4) == glb_magic) {
      if (bytes.size() < 20)
        file_.fail_at_byte(bytes.size(), "the file ends inside its GLB header");
      if (little_endian(bytes, 4, 4) != 2) file_.fail_at_byte(4, "not version 2 of GLB");
      const std::uint32_t length = little_endian(bytes, 8, 4);
      if (length != bytes.size()) {
        file_.fail_at_byte(8, "the header says " + std::to_string(length) +
                                  " bytes, the file has " + std::to_string(bytes.size()));
      }
      text_at = 20;
      text = chunk(12, json_chunk, "JSON");
      const std::size_t next = 20 + text.size();
      if (next < bytes.size()) glb_buffer_ = chunk(next, bin_chunk, "BIN");
      is_glb_ = true;
    } else if (file_.path().extension() == ".glb" || file_.path().extension() == ".GLB") {
      file_.fail_at_byte(0, "a GLB file begins with 'glTF'");
    }
    const auto check_depth = [this](int depth, json::parse_event_t, json&) {
      if (depth > most_json_levels) {
        file_.fail("the JSON has more than " + std::to_string(most_json_levels) + " levels");
      }
      return true;
    };
    try {
      root_ = json::parse(text, check_depth);
    } catch (const json::parse_error& error) {
      const std::size_t at = error.byte > 0 ? error.byte - 1 : 0;
      file_.fail_at_byte(text_at + at, "malformed JSON");
    } catch (const json::out_of_range&) {
      file_.fail_at_byte(text_at, "a number in the JSON is out of range");
    }
  }

  std::string_view chunk(std::size_t at, std::uint32_t type, const char* name) const {
    const std::string_view bytes = file_.bytes();
    if (bytes.size() - at < 8) file_.fail_at_byte(at, "the file ends inside a chunk header");
    const std::uint32_t length = little_endian(bytes, at, 4);
    if (little_endian(bytes, at + 4, 4) != type) {
      file_.fail_at_byte(at + 4, std::string("this chunk should be ") + name);
    }
    if (length > bytes.size() - at - 8) {
      file_.fail_at_byte(at, "a chunk of " + std::to_string(length) + " bytes where " +
                                 std::to_string(bytes.size() - at - 8) + " are left");
    }
    return bytes.substr(at + 8, length);
  }

  void check_version() const {
    const json& asset = member(root_, "asset", "the file");
    const json& version = member(asset, "version", "asset");
    if (!version.is_string() || !version.get<std::string>().starts_with("2.")) {
      file_.fail("asset.version is not 2.x");
    }
    // What changes where triangles are, or which there are, has to be understood.
    if (!root_.contains("extensionsRequired")) return;
    for (const json& name : array_of(root_, "extensionsRequired")) {
      const std::string text = name.is_string() ? name.get<std::string>() : name.dump();
      if (!text.starts_with("KHR_materials_") && text != "KHR_texture_transform") {
        file_.fail("requires the extension " + in_quotes(text) + ", which is not supported");
      }
    }
  }

  void read_buffers() {
    const json& buffers = array_of(root_, "buffers");
    for (std::size_t i = 0; i < buffers.size(); ++i) {
      const std::string name = "buffers[" + std::to_string(i) + "]";
      const std::uint64_t length = unsigned_of(buffers[i], "byteLength", name);
      std::string bytes;
      if (!buffers[i].contains("uri")) {
        if (!is_glb_ || i != 0) file_.fail(name + " has no uri");
        bytes = glb_buffer_;
      } else {
        bytes = load_uri(text_of(buffers[i], "uri", name), name);
      }
      if (bytes.size() < length) {
        file_.fail(name + " should have " + std::to_string(length) + " bytes and has " +
                   std::to_string(bytes.size()));
      }
      bytes.resize(length);
      buffers_.push_back(std::move(bytes));
    }
  }

  std::string load_uri(const std::string& uri, const std::string& name) const {
    if (uri.starts_with("data:")) {
      const std::size_t comma = uri.find(";base64,");
      if (comma == std::string::npos) file_.fail(name + ".uri is not base64");
      return decode_base64(std::string_view(uri).substr(comma + 8), name);
    }
    // As it stands, %20 and all: Assimp does not decode it either.
    const std::filesystem::path beside = file_.path().parent_path() / uri;
    std::error_code error;  // a device or a pipe need not ever end
    std::ifstream stream;
    if (std::filesystem::is_regular_file(beside, error)) stream.open(beside, std::ios::binary);
    if (!stream.is_open()) file_.fail(name + ": " + beside.string() + " cannot be opened");
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  std::string decode_base64(std::string_view text, const std::string& name) const {
    constexpr std::string_view alphabet =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    while (!text.empty() && text.back() == '=') text.remove_suffix(1);
    std::string bytes;
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
      const std::size_t digit = alphabet.find(c);
      if (digit == std::string_view::npos) file_.fail(name + ".uri is not base64");
      bits = (bits << 6) | static_cast<std::uint32_t>(digit);
      count += 6;
      if (count >= 8) {
        count -= 8;
        bytes += static_cast<char>((bits >> count) & 0xFFu);
      }
    }
    return bytes;
  }

  struct Accessor {
    std::uint64_t count = 0;
    std::uint64_t component_type = 0;
    std::string type;
    std::string_view data;  // from its first element on; empty without a buffer view
    std::uint64_t stride = 0;
  };

  Accessor accessor(std::uint64_t index, std::size_t components) const {
    const std::string name = "accessors[" + std::to_string(index) + "]";
    const json& entry = at(array_of(root_, "accessors"), index, name);
    if (entry.contains("sparse")) file_.fail(name + " is sparse, which is not supported");
    Accessor result;
    result.count = unsigned_of(entry, "count", name);
    result.component_type = unsigned_of(entry, "componentType", name);
    result.type = text_of(entry, "type", name);
    if (!entry.contains("bufferView")) file_.fail(name + " has no bufferView");
    const std::uint64_t view_index = unsigned_of(entry, "bufferView", name);
    const std::uint64_t offset = unsigned_or(entry, "byteOffset", 0, name);

    const std::string view_name = "bufferViews[" + std::to_string(view_index) + "]";
    const json& view = at(array_of(root_, "bufferViews"), view_index, view_name);
    const std::uint64_t buffer = unsigned_of(view, "buffer", view_name);
    if (buffer >= buffers_.size()) file_.fail(view_name + " names a buffer that is not there");
    const std::uint64_t view_offset = unsigned_or(view, "byteOffset", 0, view_name);
    const std::uint64_t view_length = unsigned_of(view, "byteLength", view_name);
    const std::uint64_t buffer_length = buffers_[buffer].size();
    if (view_offset > buffer_length || view_length > buffer_length - view_offset) {
      file_.fail(view_name + " ends outside buffers[" + std::to_string(buffer) + "]");
    }

    const std::uint64_t element = components * component_size(result.component_type);
    if (element == 0) file_.fail(name + " has an unknown componentType");
    result.stride = unsigned_or(view, "byteStride", element, view_name);
    if (result.stride < element || result.stride > 252) {
      file_.fail(view_name + " has a byteStride out of range");
    }
    const bool fits = result.count == 0 ||
                      (offset <= view_length && element <= view_length - offset &&
                       (result.count - 1) <= (view_length - offset - element) / result.stride);
    if (!fits) file_.fail(name + " ends outside " + view_name);
    result.data = std::string_view(buffers_[buffer])
                      .substr(view_offset)
                      .substr(result.count == 0 ? 0 : offset);
    return result;
  }

  /// Triangles of one mesh, counted and checked once.
  std::uint64_t mesh_triangles(std::uint64_t index) {
    const std::string name = "meshes[" + std::to_string(index) + "]";
    const json& mesh = at(array_of(root_, "meshes"), index, name);
    if (counted_.size() <= index) counted_.resize(index + 1, -1);
    if (counted_[index] >= 0) return static_cast<std::uint64_t>(counted_[index]);
    std::uint64_t triangles = 0;
    const json& primitives = array_of(mesh, "primitives");
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      triangles +=
          primitive_triangles(primitives[i], name + ".primitives[" + std::to_string(i) + "]");
    }
    counted_[index] = static_cast<std::int64_t>(triangles);
    return triangles;
  }

  std::uint64_t primitive_triangles(const json& primitive, const std::string& name) const {
    const std::uint64_t mode = unsigned_or(primitive, "mode", 4, name);
    if (mode > 6) file_.fail(name + " has an unknown mode");
    if (mode < 4) return 0;  // points and lines
    const json& attributes = member(primitive, "attributes", name);
    const Accessor positions = accessor(unsigned_of(attributes, "POSITION", name), 3);
    if (positions.type != "VEC3" || positions.component_type != 5126) {
      file_.fail(name + ": POSITION is not VEC3 of float");
    }
    std::uint64_t corners = positions.count;
    if (primitive.contains("indices")) {
      const Accessor indices = accessor(unsigned_of(primitive, "indices", name), 1);
      const std::size_t size = component_size(indices.component_type);
      if (indices.type != "SCALAR" ||
          (indices.component_type != 5121 && indices.component_type != 5123 &&
           indices.component_type != 5125)) {
        file_.fail(name + ": indices are not SCALAR of unsigned integers");
      }
      for (std::uint64_t i = 0; i < indices.count; ++i) {
        const std::uint32_t index = little_endian(indices.data, i * indices.stride, size);
        if (index >= positions.count) {
          file_.fail(name + ": index " + std::to_string(i) + " names vertex " +
                     std::to_string(index) + " of " + std::to_string(positions.count));
        }
      }
      corners = indices.count;
    }
    if (corners < 3 || (mode == 4 && corners % 3 != 0)) {
      file_.fail(name + " has " + std::to_string(corners) + " corners, no whole triangles");
    }
    return mode == 4 ? corners / 3 : corners - 2;
  }

  void count_scene() {
    const json& scenes = array_of(root_, "scenes");
    if (scenes.empty()) file_.fail("contains no scene");
    const std::uint64_t index = unsigned_or(root_, "scene", 0, "the file");
    const json& scene = at(scenes, index, "scenes[" + std::to_string(index) + "]");
    if (!scene.contains("nodes")) return;
    struct Open {
      std::uint64_t node;
      std::uint32_t level;
    };
    std::vector<Open> open;
    for (const json& node : array_of(scene, "nodes"))
      open.push_back({as_unsigned(node, "scene.nodes"), 1});
    std::set<std::uint64_t> seen;
    while (!open.empty()) {
      const auto [node_index, level] = open.back();
      open.pop_back();
      const std::string name = "nodes[" + std::to_string(node_index) + "]";
      const json& node = at(array_of(root_, "nodes"), node_index, name);
      if (level > most_node_levels) {
        file_.fail("the node tree has more than " + std::to_string(most_node_levels) + " levels");
      }
      if (!seen.insert(node_index).second) file_.fail(name + " has more than one parent");
      if (node.contains("mesh")) triangles_ += mesh_triangles(unsigned_of(node, "mesh", name));
      if (!node.contains("children")) continue;
      for (const json& child : array_of(node, "children")) {
        open.push_back({as_unsigned(child, name + ".children"), level + 1});
      }
    }
  }

  // ---- JSON with a reason when it is not as it should be ----

  const json& member(const json& object, const char* key, const std::string& name) const {
    if (!object.is_object() || !object.contains(key)) file_.fail(name + " has no " + key);
    return object[key];
  }

  /// An array, empty when it is not there.
  const json& array_of(const json& object, const char* key) const {
    static const json none = json::array();
    if (!object.is_object()) file_.fail(std::string("what should hold ") + key + " is no object");
    if (!object.contains(key)) return none;
    if (!object[key].is_array()) file_.fail(std::string(key) + " is no array");
    return object[key];
  }

  const json& at(const json& array, std::uint64_t index, const std::string& name) const {
    if (index >= array.size()) file_.fail(name + " is named and not there");
    if (!array[index].is_object()) file_.fail(name + " is no object");
    return array[index];
  }

  std::uint64_t as_unsigned(const json& value, const std::string& name) const {
    // 2^53: what JSON numbers hold exactly, and no sum of two of them overflows.
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > (std::uint64_t{1} << 53)) {
      file_.fail(name + " is no whole number");
    }
    return value.get<std::uint64_t>();
  }

  std::uint64_t unsigned_of(const json& object, const char* key, const std::string& name) const {
    return as_unsigned(member(object, key, name), name + "." + key);
  }

  std::uint64_t unsigned_or(const json& object, const char* key, std::uint64_t otherwise,
                            const std::string& name) const {
    return object.contains(key) ? as_unsigned(object[key], name + "." + key) : otherwise;
  }

  std::string text_of(const json& object, const char* key, const std::string& name) const {
    const json& value = member(object, key, name);
    if (!value.is_string()) file_.fail(name + "." + key + " is no text");
    return value.get<std::string>();
  }

  const SourceFile& file_;
  json root_;
  bool is_glb_ = false;
  std::string_view glb_buffer_;
  std::vector<std::string> buffers_;
  std::vector<std::int64_t> counted_;  // triangles of each mesh, -1: not yet counted
  std::uint64_t triangles_ = 0;
};

/// A node's transform down from the root, in double.
using Transform = std::array<double, 12>;

Transform product(const Transform& outer, const aiMatrix4x4& inner) {
  const ai_real rows[3][4] = {{inner.a1, inner.a2, inner.a3, inner.a4},
                              {inner.b1, inner.b2, inner.b3, inner.b4},
                              {inner.c1, inner.c2, inner.c3, inner.c4}};
  Transform result{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 4; ++c) {
      double sum = c == 3 ? outer[4 * r + 3] : 0.0;
      for (std::size_t k = 0; k < 3; ++k) sum += outer[4 * r + k] * double{rows[k][c]};
      result[4 * r + c] = sum;
    }
  }
  return result;
}

glm::vec3 moved(const Transform& t, const aiVector3D& p) {
  glm::vec3 result;
  for (std::size_t r = 0; r < 3; ++r) {
    const double sum = t[4 * r] * double{p.x} + t[4 * r + 1] * double{p.y} +
                       t[4 * r + 2] * double{p.z} + t[4 * r + 3];
    result[static_cast<int>(r)] = static_cast<float>(sum);
  }
  return result;
}

/// Adds the triangles of one mesh, moved by `transform`.
void append(Mesh& mesh, const aiMesh& part, const Transform& transform, const SourceFile& file) {
  const std::size_t base = mesh.positions.size();
  if (base + part.mNumVertices > max_count) file.fail("has more than 2147483647 vertices");
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const aiFace& face = part.mFaces[f];
    if (face.mNumIndices != 3) continue;  // points and lines
    glm::uvec3 corners;
    for (unsigned k = 0; k < 3; ++k) {
      if (face.mIndices[k] >= part.mNumVertices) {
        file.fail("Assimp gave a triangle a vertex that is not there");
      }
      corners[static_cast<int>(k)] = static_cast<std::uint32_t>(base + face.mIndices[k]);
    }
    mesh.faces.push_back(corners);
  }
  for (unsigned v = 0; v < part.mNumVertices; ++v) {
    mesh.positions.push_back(moved(transform, part.mVertices[v]));
  }
}

}  // namespace

bool can_read_gltf() noexcept { return true; }

Mesh load_gltf(const SourceFile& file, Progress& progress) {
  const std::uint64_t expected = GltfCheck(file).triangles();
  progress.advance(file.size());
  if (expected == 0) file.fail("contains no triangle");

  Assimp::Importer importer;
  const aiScene& scene = read_with_assimp(importer, file);
  Mesh mesh;
  constexpr Transform identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  std::vector<std::pair<const aiNode*, Transform>> open{{scene.mRootNode, identity}};
  while (!open.empty()) {
    const auto [node, parent] = open.back();
    open.pop_back();
    const Transform transform = product(parent, node->mTransformation);
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      append(mesh, *scene.mMeshes[node->mMeshes[i]], transform, file);
    }
    for (unsigned i = node->mNumChildren; i-- > 0;) {
      open.emplace_back(node->mChildren[i], transform);
    }
  }
  if (mesh.faces.size() != expected) {
    file.fail("Assimp read " + std::to_string(mesh.faces.size()) +
              " triangles where the file has " + std::to_string(expected) +
              "; the file is not trusted");
  }
  return mesh;
}

}  // namespace zkd::scene
