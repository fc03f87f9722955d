// SPDX-License-Identifier: Apache-2.0
//
// zkd under the clock: the calls a user makes, nothing prepared beforehand.
#include "contender_zkd.hpp"

#include <algorithm>
#include <utility>

#include <zkd/build.hpp>
#include <zkd/query.hpp>

namespace zkd::bench {

ZkdContender::ZkdContender(cpu::Executor executor, TriangleView triangles, BuildOptions options)
    : executor_(executor), triangles_(triangles), options_(options) {}

std::vector<std::string> ZkdContender::names() const { return {"zkd"}; }

double ZkdContender::build() {
  clear();
  const Stopwatch watch;
  tree_ = zkd::build(executor_, triangles_, options_);
  return watch.ms();
}

Contender::Timing ZkdContender::trace(std::size_t, RayKind kind, std::span<const Ray> rays) {
  Timing timing;
  if (kind == RayKind::shadow) {
    occluded_.resize(rays.size());
    const Stopwatch watch;
    any_hit(executor_, tree_.view(), triangles_, rays, occluded_);
    timing.ms = watch.ms();
    timing.hits =
        static_cast<std::uint64_t>(std::count(occluded_.begin(), occluded_.end(), std::uint8_t{1}));
    return timing;
  }
  hits_.resize(rays.size());
  const Stopwatch watch;
  closest_hit(executor_, tree_.view(), triangles_, rays, hits_);
  timing.ms = watch.ms();
  timing.hits = static_cast<std::uint64_t>(std::count_if(
      hits_.begin(), hits_.end(), [](const Hit& hit) { return hit.triangle != no_triangle; }));
  return timing;
}

void ZkdContender::clear() { tree_ = Tree(); }

}  // namespace zkd::bench
