// SPDX-License-Identifier: Apache-2.0
//
// Fuzz target: rays and triangles on a small integer lattice.
#include <cstddef>
#include <cstdint>

#include "fuzz/bytes.hpp"
#include "fuzz/check_query.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace zkd;
  fuzz::Bytes bytes(data, size);
  const BuildOptions options = fuzz::valid_options(bytes);
  const fuzz::LatticeInput input = fuzz::lattice_input(bytes, true);
  fuzz::check_queries(input.mesh, options, input.rays);
  fuzz::check_exactly(input.mesh, options, input.rays);
  return 0;
}
