// SPDX-License-Identifier: Apache-2.0
//
// E3: the tree never changes an answer. Tree against a loop over all triangles, bit by bit, on many
// small meshes and rays that are hard on purpose.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace zkd::bench::accuracy {

struct TreeAgainstLoop {
  std::string name;  ///< the intersector; "wide ..." and "cuda ...": through other trees than Tree
  std::uint64_t rays = 0;
  std::uint64_t different = 0;          ///< closest_hit: any bit of the answer
  std::uint64_t any_hit_different = 0;  ///< any_hit is not (the loop found something)

  TreeAgainstLoop& operator+=(const TreeAgainstLoop& other);
};

struct TreeAgainstLoops {
  std::uint64_t cases = 0;  ///< trees: a mesh and build options
  std::vector<TreeAgainstLoop> of_intersector;
  TreeAgainstLoop loop;          ///< in one case of 64: the loop in vectors against the scalar loop
  std::string first_difference;  ///< mesh, options and ray of the first; empty if there is none

  /// Rays held against the loop: a ray counts once for each tree that it went through.
  [[nodiscard]] std::uint64_t rays() const;
  [[nodiscard]] std::uint64_t different() const;
};

/// At least `rays` rays, spread over the small meshes of the tests (some 300 triangles each, one of
/// every kind that was ever hard), `once` and `all`, leaf sizes, code widths and axis orders,
/// each ray through the tree and its wide form. The loop takes eight triangles at a time where the
/// processor can. What that leaves out the wide tree leaves out as well, but the tree does not.
/// With `cuda`, trees and answers of the device as well, held against the loop on the host.
[[nodiscard]] TreeAgainstLoops compare_with_brute_force(std::uint64_t rays, std::uint64_t seed,
                                                        int threads, bool cuda);

}  // namespace zkd::bench::accuracy
