// SPDX-License-Identifier: Apache-2.0
//
// Whole trees where the tests run. A test that needs no more of its platform than this is compiled
// once and linked for each: what is declared here is defined in platform_tree_cpu.cpp,
// platform_tree_cuda.cpp or platform_tree_simulated.cpp. Tests that hand arrays to single stages
// are compiled for each platform: see support/platform.hpp.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/query.hpp>
#include <zkd/tree.hpp>

namespace zkd::test {

/// Which backend builds here, as trees record it.
Backend backend();

/// Tests with hundreds of builds make one in so many (a prime, so that every option stays): all of
/// them, but where they run in simulation.
std::uint32_t build_thinning();

/// Code that rays are traced with.
enum class Walk { automatic, portable, avx2 };

/// The ones that this platform has.
std::vector<Walk> walks();

inline const char* name(Walk walk) {
  return walk == Walk::portable ? "portable" : walk == Walk::avx2 ? "avx2" : "automatic";
}

/// The ways to test a triangle that this platform has.
std::vector<Intersector> intersectors();

/// A tree in the memory of the platform, its triangles there as well.
class PlatformTree {
 public:
  /// Built there, from triangles that lie there; `all` with the room that it needs. Throws as the
  /// build does.
  explicit PlatformTree(const TriangleView& triangles, const BuildOptions& options = {});
  /// Brought there, with the triangles it was built from.
  PlatformTree(const Tree& tree, const TriangleView& triangles);
  PlatformTree(PlatformTree&& other) noexcept;
  ~PlatformTree();

  /// The same tree, brought to host memory: what zkd/query.hpp takes.
  [[nodiscard]] const Tree& host() const;

  /// Traced there, in the memory that the tree is in. Rays and answers are in host memory.
  [[nodiscard]] std::vector<Hit> closest_hits(
      std::span<const Ray> rays, Walk walk = Walk::automatic,
      std::vector<TraversalCost>* costs = nullptr,
      Intersector intersector = Intersector::watertight) const;
  [[nodiscard]] std::vector<std::uint8_t> any_hits(
      std::span<const Ray> rays, Walk walk = Walk::automatic,
      Intersector intersector = Intersector::watertight) const;
  /// The first hits of each ray, hits_per_ray places for each.
  [[nodiscard]] std::vector<Hit> hits_in_order(
      std::span<const Ray> rays, std::uint32_t hits_per_ray, std::vector<std::uint32_t>& counts,
      Walk walk = Walk::automatic, Intersector intersector = Intersector::watertight) const;
  [[nodiscard]] std::vector<Hit> brute_force_hits(
      std::span<const Ray> rays, Walk walk = Walk::automatic,
      Intersector intersector = Intersector::watertight) const;

 private:
  struct There;
  std::unique_ptr<There> there_;
};

/// Built on the platform, brought to host memory.
Tree build(const TriangleView& triangles, const BuildOptions& options = {});

/// A way to build: threads and instructions of the CPU, where triangles lie for a device, ...
/// Triangles in host memory go in, a tree in host memory comes out. Each fails the running test if
/// something is not given back, whether it throws or not.
struct WayToBuild {
  std::string name;
  std::function<Tree(const TriangleView&, const BuildOptions&)> build;
};
std::vector<WayToBuild> ways_to_build();

}  // namespace zkd::test
