// SPDX-License-Identifier: Apache-2.0
//
// The key by which trunks are ordered and told apart.
#pragma once

#include <cstdint>

#include <zkd/config.hpp>

namespace zkd::stages {

/// The key of a trunk or triangle: the Morton code, followed by the code of the second round.
///
///     bit 127 .. 64   code, aligned to the left: level 0 is bit 127
///     bit  63 .. 32   second-round code, aligned to the left; 0 where the trunk is not crowded
///     bit  31 ..  0   0
///
/// Keys compare as numbers. A level is the number of a bit counted from bit 127: levels 0 to 63
/// split the lattice of the scene, levels 64 to 95 the lattice of one crowded trunk.
struct TrunkKey {
  std::uint64_t code = 0;
  std::uint64_t fine = 0;

  friend ZKD_HOST_DEVICE bool operator<(const TrunkKey& a, const TrunkKey& b) {
    return a.code != b.code ? a.code < b.code : a.fine < b.fine;
  }
  friend ZKD_HOST_DEVICE bool operator==(const TrunkKey& a, const TrunkKey& b) {
    return a.code == b.code && a.fine == b.fine;
  }
};

/// Levels below this one split the scene's lattice, the others a crowded trunk's.
inline constexpr std::uint32_t first_fine_level = 64;

}  // namespace zkd::stages
