// SPDX-License-Identifier: Apache-2.0
//
// Fuzz target: rays of any bits through triangles of any bits, or through those of a lattice.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fuzz/bytes.hpp"
#include "fuzz/check_query.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace zkd;
  fuzz::Bytes bytes(data, size);
  const BuildOptions options = fuzz::valid_options(bytes);
  const bool on_lattice = bytes.one_in(2);
  // Rays are read first, so that the triangles are what is read last; those that aim at corners are
  // made of the same bytes.
  const fuzz::Bytes from_here = bytes;
  const std::vector<Ray> unaimed = fuzz::any_rays(bytes, {});
  fuzz::Bytes again = from_here;
  scene::Mesh mesh = on_lattice ? fuzz::lattice_input(bytes, false).mesh : fuzz::any_mesh(bytes);
  std::erase_if(mesh.faces, [&](const glm::uvec3& face) {
    return face.x >= mesh.positions.size() || face.y >= mesh.positions.size() ||
           face.z >= mesh.positions.size();
  });
  std::vector<Ray> rays = fuzz::any_rays(again, mesh.positions);
  rays.insert(rays.end(), unaimed.begin(), unaimed.end());
  fuzz::check_queries(mesh, options, rays);
  return 0;
}
