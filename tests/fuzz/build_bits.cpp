// SPDX-License-Identifier: Apache-2.0
//
// Fuzz target: builds from any bits at all, coordinates, indices and options. Either one clear
// error that names the first offender, or a tree with all its properties.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <zkd/zkd.hpp>

#include "fuzz/bytes.hpp"
#include "fuzz/check_build.hpp"
#include "fuzz/fail.hpp"

namespace zkd::fuzz {
namespace {

struct Wrong {
  ErrorCode code;
  std::uint64_t offender;
};

template <class Enum>
bool known(Enum value, Enum last) {
  return static_cast<int>(value) >= 0 && static_cast<int>(value) <= static_cast<int>(last);
}

// By the documented ranges.
bool in_range(const BuildOptions& options) {
  return known(options.builder, Builder::wu2011) && known(options.quality, Quality::high) &&
         known(options.references, References::automatic) &&
         known(options.invalid_triangles, InvalidTriangles::skip) &&
         known(options.axis_order, AxisOrder::cyclic) && options.leaf_size <= 1024 &&
         options.code_bits <= 64 && std::isfinite(options.budget) && options.budget >= 1.0F &&
         options.reference_capacity <= max_count;
}

// The first triangle that may not be there: a wrong index comes before what is not finite.
std::optional<Wrong> first_offender(const scene::Mesh& mesh, InvalidTriangles policy) {
  std::optional<Wrong> found;
  for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
    bool finite = true;
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t index = mesh.faces[i][c];
      if (index >= mesh.positions.size()) return Wrong{ErrorCode::index_out_of_range, i};
      const glm::vec3& p = mesh.positions[index];
      finite = finite && std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    }
    if (!finite && policy == InvalidTriangles::error && !found) {
      found = Wrong{ErrorCode::non_finite_vertex, i};
    }
  }
  return found;
}

void check_error(const Error& error, const scene::Mesh& mesh, const BuildOptions& options) {
  const std::string words = error.what();
  require(!words.empty() && words.find('\n') == std::string::npos, "an error of one line");
  if (error.code() == ErrorCode::unsupported_option) return;  // a matter of the version
  if (!in_range(options)) {
    if (error.code() != ErrorCode::invalid_option) fail("an option out of range: " + words);
    return;
  }
  const std::optional<Wrong> wrong = first_offender(mesh, options.invalid_triangles);
  if (!wrong) fail("an error without a reason: " + words);
  if (error.code() != wrong->code || error.offender() != wrong->offender) {
    fail("not the first offender, " + std::to_string(wrong->offender) + ": " + words);
  }
}

void run(Bytes bytes) {
  const BuildOptions options = any_options(bytes);
  const std::uint64_t seed = bytes.byte();
  const scene::Mesh mesh = any_mesh(bytes);
  std::optional<Tree> tree;
  try {
    tree = build(cpu::Executor{.threads = 1}, mesh.view(), options);
  } catch (const Error& error) {
    check_error(error, mesh, options);
    return;
  }
  require(in_range(options) && !first_offender(mesh, options.invalid_triangles),
          "a tree where an error was due");
  check_properties(*tree, mesh);
  BuildOptions skipping = options;
  skipping.invalid_triangles = InvalidTriangles::skip;
  check_same(*tree, mesh, skipping, seed);
  check_memory(mesh, skipping, static_cast<std::uint32_t>(seed % 16));
}

}  // namespace
}  // namespace zkd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  zkd::fuzz::run(zkd::fuzz::Bytes(data, size));
  return 0;
}
