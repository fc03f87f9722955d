// SPDX-License-Identifier: Apache-2.0
//
// zkd itself as a contender, on the CPU.
#pragma once

#include <zkd/cpu/executor.hpp>
#include <zkd/options.hpp>
#include <zkd/tree.hpp>

#include "contender.hpp"

namespace zkd::bench {

class ZkdContender final : public Contender {
 public:
  /// `triangles` must outlive it.
  ZkdContender(cpu::Executor executor, TriangleView triangles, BuildOptions options);

  [[nodiscard]] std::vector<std::string> names() const override;
  double build() override;
  Timing trace(std::size_t way, RayKind kind, std::span<const Ray> rays) override;
  void clear() override;

  /// What build() built last; empty before and after clear().
  [[nodiscard]] const Tree& tree() const { return tree_; }

 private:
  cpu::Executor executor_;
  TriangleView triangles_;
  BuildOptions options_;
  Tree tree_;
  std::vector<Hit> hits_;
  std::vector<std::uint8_t> occluded_;
};

}  // namespace zkd::bench
