// SPDX-License-Identifier: Apache-2.0
//
// A simulated device for one test: its stream, its memory, and triangles on it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>

#include "scene/mesh.hpp"
#include "support/simulated_device.hpp"

namespace zkd::simulated {

struct Machine {
  Memory memory;
  Stream stream;

  explicit Machine(std::uint64_t seed = 1) : stream(seed) {}
  Machine(std::uint64_t seed, Stream::Pace pace) : stream(seed, pace) {}

  [[nodiscard]] Executor executor() {
    return {{.stream = stream.handle(), .memory = &memory}, false};
  }
  /// With a workspace.
  [[nodiscard]] Executor executor(Array<std::byte>& workspace) {
    Executor all = executor();
    const std::span<std::byte> bytes = workspace;
    all.workspace = bytes.data();
    all.workspace_bytes = bytes.size();
    return all;
  }
  /// Memory that is not counted.
  [[nodiscard]] Executor aside() { return {{.stream = stream.handle()}, false}; }

  /// Room for what memory_requirement() asks besides the tree.
  [[nodiscard]] Array<std::byte> workspace(std::size_t bytes) {
    return Array<std::byte>(bytes, std::byte{}, aside());
  }
};

/// A mesh in device memory that is not counted, and may change.
class Triangles {
 public:
  Triangles(Machine& machine, const scene::Mesh& mesh)
      : positions_(std::span(mesh.positions), machine.aside()),
        faces_(std::span(mesh.faces), machine.aside()) {}

  [[nodiscard]] TriangleView view() const {
    return {std::span<const glm::vec3>(positions_), std::span<const glm::uvec3>(faces_)};
  }
  /// As many positions and faces as before.
  void assign(const scene::Mesh& mesh) {
    positions_.assign(mesh.positions);
    faces_.assign(mesh.faces);
  }

 private:
  Array<glm::vec3> positions_;
  Array<glm::uvec3> faces_;
};

}  // namespace zkd::simulated
