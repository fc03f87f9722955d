// SPDX-License-Identifier: Apache-2.0
//
// Stage 7, essential nodes: the prefixes at which neighbouring trunks first differ. They are the
// only inner nodes: every other node of the conceptual tree is empty, lies in a trunk, or has
// triangles below one of its children only.
#pragma once

#include <cstdint>

#include "core/key.hpp"

namespace zkd::core {

/// Essential node j stands between trunks j and j + 1; its level is the length of its prefix.
struct EssentialLevel {
  const TrunkKey* trunk_keys;
  std::uint8_t* levels;

  ZKD_HOST_DEVICE void operator()(std::uint32_t node) const {
    levels[node] = static_cast<std::uint8_t>(parting_level(trunk_keys[node], trunk_keys[node + 1]));
  }
};

}  // namespace zkd::core
