// SPDX-License-Identifier: Apache-2.0
//
// What avx2.hpp has, for any processor.
#pragma once

#include <cstdint>

#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/ray.hpp>

#include "cpu/wide/walk.hpp"

namespace zkd::cpu {

/// core::BoxTest of eight children.
class PortableWideBoxes {
 public:
  explicit PortableWideBoxes(const core::PreparedRay& ray) : ray_(ray) {}

  void operator()(const WideNode& node, core::Real last, WideEntries& entries) const {
    core::Real near[wide];
    core::Real far[wide];
    for (int i = 0; i < wide; ++i) {
      near[i] = ray_.first;
      far[i] = last;
    }
    for (std::uint32_t a = 0; a < 3; ++a) {
      const std::uint32_t side = ray_.is_negative(a) ? 1 : 0;
      for (int i = 0; i < wide; ++i) {
        const core::Real to_near = core::Real(node.bounds[a][side][i]) - ray_.origin[a];
        const core::Real to_far = core::Real(node.bounds[a][1 - side][i]) - ray_.origin[a];
        near[i] = core::larger(near[i], to_near * ray_.inverse[a] - ray_.padding[a]);
        far[i] =
            core::smaller(far[i], (to_far * ray_.inverse[a] + ray_.padding[a]) * ray_.far_slack);
      }
    }
    entries.hit = 0;
    for (int i = 0; i < wide; ++i) {
      entries.t[i] = ordered(near[i].value);
      entries.hit |= near[i] <= far[i] ? 1u << i : 0u;
    }
  }

 private:
  const core::PreparedRay& ray_;
};

/// All triangles of a block: what to leave out is the intersector's to say.
class PortableLanes {
 public:
  explicit PortableLanes(const core::PreparedRay&) {}

  std::uint32_t operator()(const TriangleBlock& block) const {
    std::uint32_t used = 0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(wide); ++i)
      used |= block.id(i) != TriangleBlock::unused ? 1u << i : 0u;
    return used;
  }
};

struct PortableWide {
  using Boxes = PortableWideBoxes;
  template <class Intersect>
  using Lanes = PortableLanes;
  template <class Intersect>
  using Decide = Intersect;
};

}  // namespace zkd::cpu
