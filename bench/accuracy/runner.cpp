// SPDX-License-Identifier: Apache-2.0
//
// zkd with one setting, and Embree.
#include "runner.hpp"

#include <utility>

#include <zkd/build.hpp>

#include "contender.hpp"
#include "peers_embree.hpp"

namespace zkd::bench::accuracy {
namespace {

class ZkdRunner final : public Runner {
 public:
  ZkdRunner(const Setting& setting, const scene::Mesh& mesh, const cpu::Executor& executor)
      : setting_(setting), triangles_(mesh.view()), executor_(executor) {}

  double build() override {
    clear();
    const Stopwatch watch;
    tree_ = zkd::build(executor_, triangles_, setting_.build);
    return watch.ms();
  }

  void closest_hit(std::span<const Ray> rays, std::span<Hit> hits) override {
    accuracy::closest_hit(setting_.walk, setting_.intersector, executor_, tree_.view(), triangles_,
                          rays, hits);
  }

  void clear() override { tree_ = Tree(); }

  [[nodiscard]] double references_per_triangle() const override {
    return static_cast<double>(tree_.view().reference_count()) /
           static_cast<double>(std::max<std::size_t>(1, triangles_.triangle_count));
  }

 private:
  Setting setting_;
  TriangleView triangles_;
  cpu::Executor executor_;
  Tree tree_;
};

#if defined(ZKD_BENCH_EMBREE)
class PeerRunner final : public Runner {
 public:
  explicit PeerRunner(std::unique_ptr<EmbreeContender> contender)
      : contender_(std::move(contender)) {}

  double build() override { return contender_->build(); }
  void closest_hit(std::span<const Ray> rays, std::span<Hit> hits) override {
    contender_->closest_hit(rays, hits);
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
