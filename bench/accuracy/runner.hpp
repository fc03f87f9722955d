// SPDX-License-Identifier: Apache-2.0
//
// Something that builds over a mesh and answers rays: a setting of ours, or Embree. Both look the
// same from here, so that both are measured by the same loop.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/tree.hpp>

#include "scene/mesh.hpp"
#include "settings.hpp"

namespace zkd::bench::accuracy {

class Runner {
 public:
  Runner() = default;
  virtual ~Runner() = default;
  Runner(const Runner&) = delete;             // owns what it builds
  Runner& operator=(const Runner&) = delete;  // likewise

  /// Milliseconds from raw arrays to something that can be traced. What was built before is gone.
  virtual double build() = 0;
  /// Nearest hits, on all threads or the device; returns milliseconds, without those of copies to
  /// and from a device.
  virtual double closest_hit(std::span<const Ray> rays, std::span<Hit> hits) = 0;
  virtual void clear() = 0;
  /// 0 where that is not known.
  [[nodiscard]] virtual double references_per_triangle() const = 0;
};

/// What is measured beside zkd on the CPU.
struct Beside {
  bool peers = true;
  bool cuda = false;  ///< zkd on the current device
};

/// `mesh` must outlive it.
[[nodiscard]] std::unique_ptr<Runner> make_runner(const Setting& setting, const scene::Mesh& mesh,
                                                  const cpu::Executor& executor);

struct Peer {
  std::string name;  ///< "embree-3.13.5 medium robust"
  std::unique_ptr<Runner> runner;
};

/// Embree LOW and MEDIUM, fast and ROBUST; nothing where this program was built without Embree.
/// `mesh` must outlive them.
[[nodiscard]] std::vector<Peer> make_peers(const scene::Mesh& mesh, int threads);

/// Whether this program was built with Embree.
[[nodiscard]] bool has_peers() noexcept;

}  // namespace zkd::bench::accuracy
