// SPDX-License-Identifier: Apache-2.0
//
// What a run of zkd-bench finds out: plain data between measuring (run, check) and telling (table,
// json). Nothing here computes. std::nullopt is "unknown" and becomes null in JSON.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <zkd/options.hpp>
#include <zkd/statistics.hpp>
#include <zkd/tree_statistics.hpp>

#include "verify/check.hpp"

namespace zkd::bench {

/// The three kinds of rays of the workload (rays.hpp).
enum class RayKind : std::uint8_t { primary, diffuse, shadow };

/// "primary", "diffuse", "shadow". Static storage.
[[nodiscard]] const char* to_string(RayKind kind) noexcept;

/// What rays are traced through: the tree as it was built, or, on the CPU, the forms that
/// cpu::widen and cpu::strip_boxes make of it (making one is a part of the time of a build), or the
/// tree's planes as literal_walk.hpp has it (whose boxes are no part of that time).
enum class Layout : std::uint8_t { binary, wide, planes, literal };

/// "binary", "wide", "planes", "literal". Static storage.
[[nodiscard]] const char* to_string(Layout layout) noexcept;

/// Repetitions of one measurement, milliseconds.
struct Spread {
  double median = 0.0;
  double min = 0.0;
  double max = 0.0;
  std::size_t n = 0;
};

/// One kind of rays through one tree.
struct Trace {
  std::uint64_t rays = 0;
  std::uint64_t hits = 0;
  Spread ms;
  std::optional<double> node_visits_per_ray;
  std::optional<double> triangle_tests_per_ray;

  /// Millions of rays a second at the median; nothing where there was nothing to time.
  [[nodiscard]] std::optional<double> mrays_per_s() const {
    if (rays == 0 || !(ms.median > 0.0)) return std::nullopt;
    return static_cast<double>(rays) / (1000.0 * ms.median);
  }
};

using Traces = std::map<RayKind, Trace>;

/// Bytes that a build took from its memory resource.
struct AllocatedBytes {
  std::uint64_t tree = 0;       ///< still held when build returned
  std::uint64_t workspace = 0;  ///< most that was held besides
  /// zkd::memory_requirement, tree and workspace together; 0 where it cannot tell.
  std::uint64_t asked_beforehand = 0;
};

/// Answers that differ from the exact oracle.
using Differences = verify::Mistakes;

/// Rays of one kind, or of all, against the exact oracle.
struct Check {
  std::uint64_t rays = 0;
  Differences outside;  ///< beyond the published error bound: errors of ours
  Differences in_band;  ///< where exact arithmetic itself is within the bound
  std::optional<double> t_ulp_p999;
  std::optional<std::uint64_t> leaks;          ///< known for closed meshes only
  std::vector<std::uint64_t> first_offenders;  ///< of one kind: first rays outside the band, few
};

/// Another library on the same rays.
struct Peer {
  std::string name;  ///< `embree-3.13.5 medium robust packet8`
  Spread build_ms;
  std::optional<std::uint64_t> held_bytes;  ///< by its own account, once built
  std::optional<std::uint64_t> peak_bytes;  ///< the same, during the build
  Traces traces;
};

/// What only builds on a CUDA device have, besides: milliseconds by the device's clock unless said
/// otherwise. The triangles are in device memory beforehand, except where their way is what is
/// timed. Result::build_ms is rebuild() with the caller's workspace on a stream that is idle.
struct Gpu {
  /// The tree of build() and, into memory overwritten before, that of a replayed graph have the
  /// hash of the CPU's tree of this run.
  bool hash_equal = false;
  /// Every ray of the workload has the CPU's answer, bit for bit.
  bool hits_equal = false;

  Spread graph_replay_ms;  ///< rebuild() captured in a graph, one replay on an idle stream
  double graph_replay_chained_ms{};  ///< many replays one behind the other: time of one
  std::uint64_t graph_nodes = 0;     ///< kernels, copies and fills in that graph
  Spread submit_ms;                  ///< the host's time for one rebuild(), by its own clock
  Spread build_allocating_ms;        ///< build() with tree and workspace from the default pool
  Spread h2d_ms;                     ///< the triangles from pinned host memory
  Spread h2d_pageable_ms;            ///< from ordinary host memory, by the host's clock
  Spread d2h_ms;                     ///< Tree::to_host(), by the host's clock
  std::optional<double> analyse_ms;  ///< analyse() for `all`, by the host's clock
  /// The first build of a process of its own, by the host's clock: kernels are loaded and pools
  /// made on the way. The context is there, and what that took is told apart.
  std::optional<double> cold_ms;
  std::optional<double> context_ms;
};

/// One scene with one set of options.
struct Result {
  std::string scene;
  std::string setting;  ///< tells results of one scene apart; empty if there is only one
  std::uint64_t triangles = 0;
  bool stand_in = false;
  std::string note;  ///< what the mesh is, in words
  std::string paper_scene;
  std::uint64_t paper_triangles = 0;  ///< 0: not in the paper
  double paper_ms = 0.0;              ///< 0: not in the paper
  int threads = 0;
  BuildOptions options;  ///< as used, after automatic
  std::string instructions;
  std::string intersector;
  Layout layout = Layout::binary;
  std::uint64_t seed = 0;
  Spread build_ms;
  std::vector<Spread> stages_ms;  ///< one for each Stage, in order
  AllocatedBytes allocated;
  Statistics statistics;     ///< counts of the timed builds
  bool has_quality = false;  ///< depth and SAH cost in `statistics` were measured
  std::optional<TreeStatistics> tree_statistics;  ///< with --stats
  std::string tree_hash;
  Traces traces;
  std::optional<Gpu> gpu;           ///< CUDA only
  std::map<RayKind, Check> checks;  ///< empty without --check
  std::optional<Check> check;       ///< all kinds together
  std::vector<Peer> peers;

  /// How often a second another program took a core from this one while the clock ran (involuntary
  /// context switches): near 0 on a machine that is otherwise idle. The same for all results of a
  /// scene, which are timed together.
  std::optional<double> preempted_per_s;
  std::optional<double> visits_at_white;  ///< node visits at the top of the heat map's scale
};

/// Where it all ran.
struct Machine {
  std::optional<std::string> cpu;
  int threads = 0;
  std::optional<std::string> gpu;
  std::optional<std::string> driver;
  std::optional<std::string> cuda;                ///< of the runtime, `13.0`
  std::optional<std::string> compute_capability;  ///< `9.0`
  std::optional<std::uint64_t> multiprocessors;
  std::optional<std::uint64_t> gpu_memory_bytes;
  std::optional<std::string> compiler;
  std::optional<std::string> commit;
};

}  // namespace zkd::bench
