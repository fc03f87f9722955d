// SPDX-License-Identifier: Apache-2.0
//
// Fuzz target: trees over triangles on a small integer lattice, where everything is decided
// exactly, with every valid choice of options.
#include <cstddef>
#include <cstdint>

#include <zkd/zkd.hpp>

#include "fuzz/bytes.hpp"
#include "fuzz/check_build.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace zkd;
  fuzz::Bytes bytes(data, size);
  const BuildOptions options = fuzz::valid_options(bytes);
  const std::uint64_t seed = bytes.byte();
  scene::Mesh mesh = fuzz::lattice_input(bytes, false).mesh;
  // One in so many is large enough for three threads to share. Which one is not for the fuzzer to
  // choose: it would choose it always.
  if (fuzz::checksum(data, size) % 128 == 0) mesh = fuzz::repeated(mesh, 2 * 2048 + 1);

  const Tree tree = build(cpu::Executor{.threads = 1}, mesh.view(), options);
  fuzz::check_properties(tree, mesh);
  fuzz::check_same(tree, mesh, options, seed);
  fuzz::check_memory(mesh, options, static_cast<std::uint32_t>(seed % 16));
  return 0;
}
