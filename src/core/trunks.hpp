// SPDX-License-Identifier: Apache-2.0
//
// Stage 6, trunks: the leaves. Conceptually the largest nodes of the complete binary tree with at
// most leaf_size triangles.
#pragma once

#include <cstdint>

#include "core/key.hpp"

namespace zkd::core {

/// Of a trunk, at most.
inline constexpr std::uint32_t most_leaf_size = 1024;

/// Whether a trunk begins with triangle i.
///
/// Neighbours i - 1 and i part at some node of the conceptual tree. A trunk begins at i exactly
/// when that node is too large to be a leaf, that is, when some leaf_size + 1 triangles in a row,
/// i - 1 and i among them, all lie below it. There are leaf_size such rows at most, and the first
/// and last key of each tell: no tree has to be known. Triangles of equal keys never part.
template <class Keys>
struct BeginsTrunk {
  Keys keys;
  const std::uint32_t* key_count;
  std::uint32_t leaf_size;
  std::uint32_t count = 0;

  ZKD_HOST_DEVICE void load() {
    keys.load();
    count = *key_count;
  }

  ZKD_HOST_DEVICE bool operator()(std::uint32_t i) const {
    if (i == 0) return true;
    const std::uint32_t level = parting_level(keys[i - 1], keys[i]);
    if (level == level_count || count <= leaf_size) return false;
    const std::uint32_t from = i > leaf_size ? i - leaf_size : 0;
    const std::uint32_t to = smaller(i - 1, count - 1 - leaf_size);
    for (std::uint32_t row = from; row <= to; ++row)
      if (parting_level(keys[row], keys[row + leaf_size]) >= level) return true;
    return false;
  }
};

/// The key of trunk t: that of its first triangle, which has all the bits in which the trunk
/// differs from others.
template <class Keys>
struct TrunkKeyOf {
  Keys keys;
  const std::uint32_t* first;
  TrunkKey* trunk_keys;

  ZKD_HOST_DEVICE void load() { keys.load(); }

  ZKD_HOST_DEVICE void operator()(std::uint32_t trunk) const {
    trunk_keys[trunk] = keys[first[trunk]];
  }
};

}  // namespace zkd::core
