// SPDX-License-Identifier: Apache-2.0
//
// zkd on the CPU under the clock: the calls a user makes, nothing prepared beforehand.
#include "contender_zkd.hpp"

#include <algorithm>

#include <zkd/build.hpp>
#include <zkd/cpu/plane_tree.hpp>
#include <zkd/cpu/wide_tree.hpp>

#include "literal_walk.hpp"
#include "memory.hpp"

namespace zkd::bench {
namespace {

class CpuContender final : public ZkdContender {
 public:
  CpuContender(const cpu::Executor& executor, const TriangleView& triangles,
               const BuildOptions& options, Intersector intersector, Layout layout)
      : executor_(executor),
        triangles_(triangles),
        options_(options),
        intersector_(intersector),
        layout_(layout) {}

  double build() override {
    clear();
    const Stopwatch watch;
    tree_ = zkd::build(executor_, triangles_, options_);
    if (layout_ == Layout::wide) wide_ = cpu::widen(executor_, tree_.view(), triangles_);
    if (layout_ == Layout::planes) planes_ = cpu::strip_boxes(executor_, tree_);
    const double whole = watch.ms();
    if (layout_ != Layout::literal) return whole;
    return whole - tree_.statistics().stage_ms[static_cast<std::size_t>(Stage::tight_boxes)];
  }

  Timing trace(std::size_t, RayKind kind, std::span<const Ray> rays) override {
    Timing timing;
    if (kind == RayKind::shadow) {
      occluded_.resize(rays.size());
      timing.ms = any_hit(rays, occluded_, {});
      timing.hits = count_hits(occluded_);
      return timing;
    }
    hits_.resize(rays.size());
    timing.ms = closest_hit(rays, hits_, {});
    timing.hits = count_hits(hits_);
    return timing;
  }

  void clear() override {
    tree_ = Tree();
    wide_ = cpu::WideTree();
    planes_ = cpu::PlaneTree();
  }

  // Bytes, in a build whose memory is counted. `once` can be asked for beforehand; for `all` the
  // question is put with the number of references that it turned out to have; the others cannot
  // tell.
  void describe(Result& result) override {
    CountingResource memory;
    cpu::Executor counted = executor_;
    counted.memory = &memory;
    const Tree tree = zkd::build(counted, triangles_, options_);
    const cpu::WideTree wide =
        layout_ == Layout::wide ? cpu::widen(counted, tree.view(), triangles_) : cpu::WideTree();
    const cpu::PlaneTree planes =
        layout_ == Layout::planes ? cpu::strip_boxes(counted, tree) : cpu::PlaneTree();
    // Rays need one of them.
    result.allocated.tree = layout_ == Layout::wide     ? wide.bytes()
                            : layout_ == Layout::planes ? planes.bytes()
                                                        : memory.held();
    result.allocated.workspace = memory.peak() - result.allocated.tree;
    if (tree.options().builder == Builder::morton && layout_ == Layout::binary) {
      const std::uint64_t references =
          options_.references == References::once ? 0 : tree.view().reference_count();
      const MemoryRequirement asked =
          memory_requirement(counted, triangles_.triangle_count, options_, references);
      result.allocated.asked_beforehand = asked.tree_bytes + asked.workspace_bytes;
    }
    result.options = tree.options();
    result.layout = layout_;
    if (layout_ == Layout::literal) result.statistics.sah_cost = sah_cost_of_cells(tree.view());
    result.options.backend = Backend::cpu;  // an executor was given, so the option stays as asked
  }

  Samples stage_ms() override {
    const auto& stages = tree_.statistics().stage_ms;
    return {stages.begin(), stages.end()};
  }

  void measure_more(Result&, unsigned) override {}

  double closest_hit(std::span<const Ray> rays, std::span<Hit> hits,
                     std::span<TraversalCost> costs) override {
    const Stopwatch watch;
    if (layout_ == Layout::wide)
      cpu::closest_hit(executor_, wide_.view(), rays, hits, costs, intersector_);
    else if (layout_ == Layout::planes)
      cpu::closest_hit(executor_, planes_.view(), triangles_, rays, hits, costs, intersector_);
    else if (layout_ == Layout::literal)
      closest_hit_literally(executor_, tree_.view(), triangles_, rays, hits, costs);
    else
      zkd::closest_hit(executor_, tree_.view(), triangles_, rays, hits, costs, intersector_);
    return watch.ms();
  }
  double any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                 std::span<TraversalCost> costs) override {
    const Stopwatch watch;
    if (layout_ == Layout::literal) {  // the poster has no other question
      hits_.resize(rays.size());
      closest_hit_literally(executor_, tree_.view(), triangles_, rays, hits_, costs);
      std::transform(hits_.begin(), hits_.end(), occluded.begin(), [](const Hit& hit) {
        return static_cast<std::uint8_t>(hit.triangle != no_triangle ? 1 : 0);
      });
    } else if (layout_ == Layout::wide)
      cpu::any_hit(executor_, wide_.view(), rays, occluded, costs, intersector_);
    else if (layout_ == Layout::planes)
      cpu::any_hit(executor_, planes_.view(), triangles_, rays, occluded, costs, intersector_);
    else
      zkd::any_hit(executor_, tree_.view(), triangles_, rays, occluded, costs, intersector_);
    return watch.ms();
  }

  const Tree& tree() override { return tree_; }

 private:
  cpu::Executor executor_;
  TriangleView triangles_;
  BuildOptions options_;
  Intersector intersector_;
  Layout layout_;
  Tree tree_;
  cpu::WideTree wide_;     ///< of Layout::wide
  cpu::PlaneTree planes_;  ///< of Layout::planes
  std::vector<Hit> hits_;
  std::vector<std::uint8_t> occluded_;
};

}  // namespace

std::unique_ptr<ZkdContender> cpu_contender(const cpu::Executor& executor,
                                            const TriangleView& triangles,
                                            const BuildOptions& options, Intersector intersector,
                                            Layout layout) {
  return std::make_unique<CpuContender>(executor, triangles, options, intersector, layout);
}

}  // namespace zkd::bench
