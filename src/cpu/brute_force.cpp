// SPDX-License-Identifier: Apache-2.0
//
// The loop over all triangles that trees are checked against: core::trace_brute_force, which is its
// definition, and the same eight triangles at a time, where the processor has AVX2.
//
// What eight at a time leave out is decided by the filter that leaves of wide trees have
// (cpu/wide/avx2.hpp); what is left is put to the intersector one by one, in the same order.
#include <zkd/query.hpp>

#include <algorithm>
#include <bit>

#include <zkd/traversal/traverse.hpp>

#include "cpu/rays.hpp"
#include "cpu/threads.hpp"
#include "cpu/wide/avx2.hpp"
#include "cpu/wide/block.hpp"

namespace zkd {
namespace {

using cpu::rays_at_once;
using cpu::TriangleBlock;

// Blocks that stay in the first-level cache while `rays_at_once` rays go through them.
constexpr std::uint32_t blocks_at_once = 64;
constexpr std::uint32_t triangles_at_once = blocks_at_once * cpu::wide;

/// Some triangles of a view, in blocks.
class Chunk {
 public:
  void fill(const TriangleView& triangles, std::uint32_t first) {
    const auto all = static_cast<std::uint32_t>(triangles.triangle_count);
    const std::uint32_t count = std::min(triangles_at_once, all - first);
    first_ = first;
    used_ = (count + cpu::wide - 1) / cpu::wide;
    for (std::uint32_t b = 0; b < used_; ++b) {
      const std::uint32_t begin = b * cpu::wide;
      cpu::fill(blocks_[b], triangles, std::min<std::uint32_t>(count - begin, cpu::wide),
                [&](std::uint32_t lane) { return first + begin + lane; });
    }
  }

  /// visit(id) for the triangles that are left, in their order.
  template <class Lanes, class Visit>
  void for_each_left(const Lanes& lanes, Visit visit) const {
    for (std::uint32_t b = 0; b < used_; ++b)
      for (std::uint32_t left = lanes(blocks_[b]); left != 0; left &= left - 1)
        visit(first_ + b * cpu::wide + static_cast<std::uint32_t>(std::countr_zero(left)));
  }

 private:
  std::uint32_t first_;
  std::uint32_t used_;
  TriangleBlock blocks_[blocks_at_once];
};

/// Up to `rays_at_once` rays.
template <class Intersect>
inline void trace_in_blocks(const TreeView& tree, const TriangleView& triangles,
                            std::span<const Ray> rays, Hit* hits) {
  using Decide = typename cpu::Avx2Wide::Decide<Intersect>;
  using Lanes = typename cpu::Avx2Wide::Lanes<Intersect>;
  typename Decide::Candidate best[rays_at_once];
  Chunk chunk;
  for (std::uint32_t first = 0; first < triangles.triangle_count; first += triangles_at_once) {
    chunk.fill(triangles, first);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const core::PreparedRay prepared(tree, rays[i], Intersect::hit_distance);
      if (!prepared.valid) continue;
      const Decide intersect(prepared, rays[i]);
      chunk.for_each_left(Lanes(prepared), [&](std::uint32_t id) {
        core::test_in_loop(intersect, core::corners_of(triangles, id), id, best[i]);
      });
    }
  }
  for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = core::to_hit(best[i]);
}

}  // namespace

void closest_hit_brute_force(const cpu::Executor& executor, const TreeView& tree,
                             const TriangleView& triangles, std::span<const Ray> rays,
                             std::span<Hit> hits, Intersector intersector) noexcept {
  const std::size_t count = std::min(rays.size(), hits.size());
  const cpu::Threads threads(executor);
  cpu::with_intersector(intersector, [&]<class Intersect>() {
    if (threads.avx2()) {
      cpu::for_each_range_of_rays(threads, count, 1, [=](std::size_t begin, std::size_t end) {
        for (; begin < end; begin += rays_at_once) {
          const std::size_t n = std::min<std::size_t>(rays_at_once, end - begin);
          trace_in_blocks<Intersect>(tree, triangles, rays.subspan(begin, n), &hits[begin]);
        }
      });
      return;
    }
    cpu::for_each_ray(threads, count, 1, [=](std::size_t i) {
      hits[i] = core::to_hit(core::trace_brute_force<Intersect>(tree, triangles, rays[i]));
    });
  });
}

}  // namespace zkd
