// SPDX-License-Identifier: Apache-2.0
//
// A program that links zkd::cuda: a build that names no executor takes CUDA
// where a device answers, falls back to the CPU where none does, and says which.
#include <cstdio>
#include <string>
#include <vector>

#include <zkd/cuda/build.hpp>
#include <zkd/zkd.hpp>

int main() {
  const std::vector<glm::vec3> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<glm::uvec3> faces{{0, 1, 2}};
  const zkd::TriangleView triangles{vertices, faces};

  std::string why;
  const bool device = zkd::cuda::available(&why);
  const zkd::Tree tree = zkd::build(triangles);
  const bool on_device = tree.options().backend == zkd::Backend::cuda;
  std::printf("built on %s%s%s\n", zkd::to_string(tree.options().backend), device ? "" : ": ",
              why.c_str());
  if (on_device != device || tree.view().leaf_count() != 1) return 1;

  try {
    const zkd::Tree asked = zkd::build(triangles, {.backend = zkd::Backend::cuda});
    return device && asked.options().backend == zkd::Backend::cuda ? 0 : 1;
  } catch (const zkd::Error& error) {
    std::printf("%s: %s\n", zkd::to_string(error.code()), error.what());
    // It must have been found all the same.
    const bool linked = std::string(error.what()).find("does not link") == std::string::npos;
    return !device && linked && error.code() == zkd::ErrorCode::backend_unavailable ? 0 : 1;
  }
}
