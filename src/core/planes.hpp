// SPDX-License-Identifier: Apache-2.0
//
// Stage 9, split planes: axis and position of an essential node, exact from its prefix.
#pragma once

#include <cstdint>

#include <zkd/lattice.hpp>
#include <zkd/tree.hpp>

#include "core/key.hpp"
#include "core/lattice.hpp"
#include "core/morton.hpp"
#include "core/search.hpp"

namespace zkd::core {

struct SplitPlane {
  std::uint32_t axis;
  double position;
};

/// The plane of a node of this level; `above` is the code of a trunk on its upper side, aligned to
/// the left. There the bit of the level is 1: with the bits after it cleared, the code names the
/// first cell above the plane.
ZKD_HOST_DEVICE inline SplitPlane split_plane(const Lattice& lattice, const MortonCoder& coder,
                                              std::uint64_t above, std::uint32_t level) {
  const std::uint64_t first = above & (~0ull << (63 - level));
  const std::uint32_t axis = lattice.axis[level];
  const std::uint32_t k = coder.cell(first >> (64 - lattice.code_bits), static_cast<int>(axis));
  return {axis, plane_position(lattice, static_cast<int>(axis), k)};
}

/// Planes of the scene's lattice.
struct LatticePlanes {
  const Lattice* lattice;
  const MortonCoder* coder;

  [[nodiscard]] ZKD_HOST_DEVICE SplitPlane plane(std::uint64_t above, std::uint32_t level) const {
    return split_plane(*lattice, *coder, above, level);
  }
};

/// The lattice of the crowded trunk that a trunk came from, found by where both begin.
struct CrowdByPosition {
  const std::uint32_t* first;          ///< position of each trunk's first triangle
  const std::uint32_t* crowded_first;  ///< of each crowded trunk's, ascending
  const std::uint32_t* crowded_count;
  const Lattice* lattices;
  const MortonCoder* coders;

  ZKD_HOST_DEVICE SplitPlane plane(std::uint32_t trunk, std::uint64_t above,
                                   std::uint32_t level) const {
    const std::uint32_t crowd = last_at_or_before(crowded_first, *crowded_count, first[trunk]);
    return split_plane(lattices[crowd], coders[crowd], above, level);
  }
};

/// The same, listed for every trunk: for those who call the stage by itself.
struct CrowdByTrunk {
  const std::uint32_t* crowd;
  const Lattice* lattices;

  ZKD_HOST_DEVICE SplitPlane plane(std::uint32_t trunk, std::uint64_t above,
                                   std::uint32_t level) const {
    const Lattice& lattice = lattices[crowd[trunk]];
    return split_plane(lattice, MortonCoder(lattice), above, level);
  }
};

/// Where planes go: `stride` elements from one node's to the next.
struct PlaneWriter {
  std::uint32_t* axes;
  float* planes;
  std::size_t stride;
};

/// Essential node j: its plane, times `scale`.
template <class Scene, class Crowd>
struct PlaceSplitPlane {
  const TrunkKey* trunk_keys;
  const std::uint8_t* levels;
  Scene scene;
  Crowd crowd;
  const double* scale;
  PlaneWriter writer;

  ZKD_HOST_DEVICE void operator()(std::uint32_t node) const {
    const TrunkKey& above = trunk_keys[node + 1];
    const std::uint32_t level = levels[node];
    SplitPlane plane;
    if (level < first_fine_level) {
      plane = scene.plane(above.code, level);
    } else {
      // Second-round codes are aligned to the left of 64 bits too.
      plane = crowd.plane(node + 1, above.fine, level - first_fine_level);
    }
    writer.axes[writer.stride * node] = plane.axis;
    writer.planes[writer.stride * node] = static_cast<float>(plane.position * *scale) + 0.0F;
  }
};

}  // namespace zkd::core
