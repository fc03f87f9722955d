// SPDX-License-Identifier: Apache-2.0
//
// zkd itself as a contender, on either backend.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <zkd/cpu/executor.hpp>
#include <zkd/options.hpp>
#include <zkd/query.hpp>
#include <zkd/tree.hpp>

#include "contender.hpp"

namespace zkd::bench {

class ZkdContender : public Contender {
 public:
  [[nodiscard]] std::vector<std::string> names() const override { return {"zkd"}; }

  /// What takes no clock, in builds of its own: options as used, memory, and on CUDA what the
  /// device says of the tree. `result` has the counts and the hash of the CPU's tree already.
  virtual void describe(Result& result) = 0;

  /// Milliseconds of each stage of the last build(), or, where looking at the clock between stages
  /// would have made it longer, of one more like it.
  [[nodiscard]] virtual Samples stage_ms() = 0;

  /// Measures what only this backend has, `repeat` times each. After the interleaved repetitions.
  virtual void measure_more(Result& result, unsigned repeat) = 0;

  /// Answers of the tree that build() built last, as zkd/query.hpp has them; spans in host memory.
  /// Returns milliseconds, without those of copies to and from a device.
  virtual double closest_hit(std::span<const Ray> rays, std::span<Hit> hits,
                             std::span<TraversalCost> costs = {}) = 0;
  virtual double any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                         std::span<TraversalCost> costs = {}) = 0;

  /// The tree that build() built last, in host memory. Valid until build() or clear().
  [[nodiscard]] virtual const Tree& tree() = 0;
};

/// zkd on the CPU. With Layout::wide, builds end with a wide tree and rays go through that, with
/// Layout::planes with a plane tree; Layout::literal, which knows the watertight intersector only,
/// leaves out answers. `triangles` must outlive it.
[[nodiscard]] std::unique_ptr<ZkdContender> cpu_contender(const cpu::Executor& executor,
                                                          const TriangleView& triangles,
                                                          const BuildOptions& options,
                                                          Intersector intersector, Layout layout);

}  // namespace zkd::bench
