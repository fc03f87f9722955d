// SPDX-License-Identifier: Apache-2.0
//
// zkd with one setting on either backend, and Embree.
#include "runner.hpp"

#include <algorithm>
#include <utility>

#include <zkd/build.hpp>
#include <zkd/cpu/wide_tree.hpp>

#include "contender.hpp"
#include "cuda.hpp"
#include "peers_embree.hpp"

namespace zkd::bench::accuracy {
namespace {

double references_per_triangle(const TreeView& tree, const TriangleView& triangles) {
  return static_cast<double>(tree.reference_count()) /
         static_cast<double>(std::max<std::size_t>(1, triangles.triangle_count));
}

class ZkdRunner final : public Runner {
 public:
  ZkdRunner(const Setting& setting, const scene::Mesh& mesh, const cpu::Executor& executor)
      : setting_(setting), triangles_(mesh.view()), executor_(executor) {}

  double build() override {
    clear();
    const Stopwatch watch;
    tree_ = zkd::build(executor_, triangles_, setting_.build);
    if (setting_.wide) wide_ = cpu::widen(executor_, tree_.view(), triangles_);
    return watch.ms();
  }

  double closest_hit(std::span<const Ray> rays, std::span<Hit> hits) override {
    const Stopwatch watch;
    if (setting_.wide)
      cpu::closest_hit(executor_, wide_.view(), rays, hits, {}, setting_.intersector);
    else
      accuracy::closest_hit(setting_.walk, setting_.intersector, executor_, tree_.view(),
                            triangles_, rays, hits);
    return watch.ms();
  }

  void clear() override {
    tree_ = Tree();
    wide_ = cpu::WideTree();
  }

  [[nodiscard]] double references_per_triangle() const override {
    return accuracy::references_per_triangle(tree_.view(), triangles_);
  }

 private:
  Setting setting_;
  TriangleView triangles_;
  cpu::Executor executor_;
  Tree tree_;
  cpu::WideTree wide_;  ///< where the setting is wide
};

// The device keeps a tree, its workspace and a copy of the triangles only from build() to clear():
// there are more settings than would fit at once.
class CudaRunner final : public Runner {
 public:
  CudaRunner(const Setting& setting, const scene::Mesh& mesh)
      : setting_(setting), triangles_(mesh.view()) {}

  double build() override {
    clear();
    const std::span<const BuildOptions> one(&setting_.build, 1);
    contender_ = std::move(cuda_contenders(triangles_, one, setting_.intersector).front());
    Result result;
    contender_->describe(result);
    return contender_->build();
  }

  double closest_hit(std::span<const Ray> rays, std::span<Hit> hits) override {
    return contender_->closest_hit(rays, hits);
  }

  void clear() override { contender_.reset(); }

  [[nodiscard]] double references_per_triangle() const override {
    return accuracy::references_per_triangle(contender_->tree().view(), triangles_);
  }

 private:
  Setting setting_;
  TriangleView triangles_;
  std::unique_ptr<ZkdContender> contender_;
};

#if defined(ZKD_BENCH_EMBREE)
class PeerRunner final : public Runner {
 public:
  explicit PeerRunner(std::unique_ptr<EmbreeContender> contender)
      : contender_(std::move(contender)) {}

  double build() override { return contender_->build(); }
  double closest_hit(std::span<const Ray> rays, std::span<Hit> hits) override {
    const Stopwatch watch;
    contender_->closest_hit(rays, hits);
    return watch.ms();
  }
  void clear() override { contender_->clear(); }
  [[nodiscard]] double references_per_triangle() const override { return 0.0; }

 private:
  std::unique_ptr<EmbreeContender> contender_;
};
#endif

}  // namespace

std::unique_ptr<Runner> make_runner(const Setting& setting, const scene::Mesh& mesh,
                                    const cpu::Executor& executor) {
  if (setting.cuda) return std::make_unique<CudaRunner>(setting, mesh);
  return std::make_unique<ZkdRunner>(setting, mesh, executor);
}

#if defined(ZKD_BENCH_EMBREE)
std::vector<Peer> make_peers(const scene::Mesh& mesh, int threads) {
  std::vector<Peer> peers;
  for (auto& contender : embree_contenders(mesh, threads)) {
    std::string name = contender->names().front();
    if (name.find(" high") != std::string::npos) continue;  // answers as MEDIUM does
    peers.push_back({std::move(name), std::make_unique<PeerRunner>(std::move(contender))});
  }
  return peers;
}

bool has_peers() noexcept { return true; }
#else
std::vector<Peer> make_peers(const scene::Mesh&, int) { return {}; }

bool has_peers() noexcept { return false; }
#endif

}  // namespace zkd::bench::accuracy
