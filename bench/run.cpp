// SPDX-License-Identifier: Apache-2.0
//
// One scene measured: what is timed, in which order, and what is found out besides.
#include "run.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <sys/resource.h>

#include <zkd/build.hpp>
#include <zkd/query.hpp>

#include "check.hpp"
#include "contender_zkd.hpp"
#include "images.hpp"
#include "memory.hpp"
#include "peers_embree.hpp"
#include "rays.hpp"
#include "scene/load.hpp"
#include "scene/progress.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::bench {
namespace {

using Samples = std::vector<double>;

Spread spread_of(Samples samples) {
  if (samples.empty()) return {};
  std::sort(samples.begin(), samples.end());
  const std::size_t middle = samples.size() / 2;
  const double median =
      samples.size() % 2 == 1 ? samples[middle] : 0.5 * (samples[middle - 1] + samples[middle]);
  return {median, samples.front(), samples.back(), samples.size()};
}

// Worker threads of OpenMP and of TBB spin for a while after their work and would take the cores
// from whoever is timed next.
void let_workers_sleep() { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }

// Involuntary context switches of all threads so far.
std::int64_t preemptions() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_nivcsw;
}

struct Workload {
  std::map<RayKind, std::vector<Ray>> rays;
};

// The rays everybody traces. Where they lead is seen by one tree; every correct tree agrees.
Workload make_workload(const Options& options, const scene::Camera& camera,
                       const TriangleView& triangles, const Tree& tree,
                       const cpu::Executor& executor) {
  std::vector<Ray> primary = tiled_primary_rays(camera, options.size).rays;
  std::vector<Hit> hits(primary.size());
  closest_hit(executor, tree.view(), triangles, primary, hits);
  const Box& box = tree.view().bounds();
  const std::vector<SurfacePoint> points = surface_points(triangles, box, primary, hits);
  Workload workload;
  for (const RayKind kind : options.rays) {
    switch (kind) {
      case RayKind::primary:
        workload.rays[kind] = primary;
        break;
      case RayKind::diffuse:
        workload.rays[kind] = diffuse_rays(points, points.size(), options.seed);
        break;
      case RayKind::shadow:
        workload.rays[kind] =
            shadow_rays(points, place_light(camera, box), points.size(), options.seed);
        break;
    }
  }
  return workload;
}

// One contender on its way through the repetitions.
struct Entrant {
  explicit Entrant(Contender& what) : contender(&what), traces(what.names().size()) {}

  Contender* contender;
  Samples build_ms;
  std::vector<Samples> stages_ms;  // zkd only
  struct Kind {
    Samples ms;
    std::uint64_t hits = 0;
  };
  std::vector<std::map<RayKind, Kind>> traces;  // for each way of tracing
};

// Everything one repetition does to one contender. Warm-ups are not kept.
void repeat_once(Entrant& entrant, const Workload& workload, bool keep) {
  Contender& contender = *entrant.contender;
  let_workers_sleep();
  const double build_ms = contender.build();
  if (keep) entrant.build_ms.push_back(build_ms);
  if (const auto* ours = dynamic_cast<const ZkdContender*>(&contender); ours != nullptr && keep) {
    const auto& stage_ms = ours->tree().statistics().stage_ms;
    entrant.stages_ms.resize(stage_ms.size());
    for (std::size_t stage = 0; stage < stage_ms.size(); ++stage) {
      entrant.stages_ms[stage].push_back(stage_ms[stage]);
    }
  }
  for (std::size_t way = 0; way < entrant.traces.size(); ++way) {
    for (const auto& [kind, rays] : workload.rays) {
      let_workers_sleep();
      const Contender::Timing timing = contender.trace(way, kind, rays);
      Entrant::Kind& seen = entrant.traces[way][kind];
      seen.hits = timing.hits;
      if (keep) seen.ms.push_back(timing.ms);
    }
  }
  contender.clear();
}

Traces traces_of(const std::map<RayKind, Entrant::Kind>& seen, const Workload& workload) {
  Traces traces;
  for (const auto& [kind, what] : seen) {
    Trace& trace = traces[kind];
    trace.rays = workload.rays.at(kind).size();
    trace.hits = what.hits;
    trace.ms = spread_of(what.ms);
  }
  return traces;
}

void measure_traversal(Result& result, const Workload& workload, const TriangleView& triangles,
                       const Tree& tree, const cpu::Executor& executor) {
  for (const auto& [kind, rays] : workload.rays) {
    if (rays.empty()) continue;
    std::vector<TraversalCost> costs(rays.size());
    if (kind == RayKind::shadow) {
      std::vector<std::uint8_t> occluded(rays.size());
      any_hit(executor, tree.view(), triangles, rays, occluded, costs);
    } else {
      std::vector<Hit> hits(rays.size());
      closest_hit(executor, tree.view(), triangles, rays, hits, costs);
    }
    std::uint64_t node_visits = 0;
    std::uint64_t triangle_tests = 0;
    for (const TraversalCost& cost : costs) {
      node_visits += cost.node_visits;
      triangle_tests += cost.triangle_tests;
    }
    const auto count = static_cast<double>(rays.size());
    result.traces[kind].node_visits_per_ray = static_cast<double>(node_visits) / count;
    result.traces[kind].triangle_tests_per_ray = static_cast<double>(triangle_tests) / count;
  }
}

// Bytes, in a build whose memory is counted. `once` can be asked for beforehand; for `all` the
// question is put with the number of references that it turned out to have.
AllocatedBytes measure_memory(const cpu::Executor& executor, const TriangleView& triangles,
                              const BuildOptions& options) {
  CountingResource memory;
  cpu::Executor counted = executor;
  counted.memory = &memory;
  AllocatedBytes bytes;
  const Tree tree = zkd::build(counted, triangles, options);
  bytes.tree = memory.held();
  bytes.workspace = memory.peak() - memory.held();
  const std::uint64_t references =
      options.references == References::once ? 0 : tree.view().reference_count();
  const MemoryRequirement asked =
      memory_requirement(counted, triangles.triangle_count, options, references);
  bytes.asked_beforehand = asked.tree_bytes + asked.workspace_bytes;
  return bytes;
}

// Facts that take no clock: memory, counts, quality, the tree's hash.
Result describe(const scene::SceneInfo& info, const scene::Mesh& mesh, const Options& options,
                std::size_t setting, const cpu::Executor& executor, Tree& tree) {
  Result result;
  result.scene = info.name;
  result.setting = options.labels[setting];
  result.triangles = mesh.faces.size();
  result.stand_in = info.stand_in;
  result.note = info.note;
  result.paper_scene = info.paper_scene;
  result.paper_triangles = info.paper_triangles;
  result.paper_ms = info.paper_ms;
  result.threads = executor.threads;
  result.instructions = to_string(executor.instructions);
  result.seed = options.seed;

  BuildOptions build = options.settings[setting];
  result.allocated = measure_memory(executor, mesh.view(), build);
  build.measure_quality = options.measure_quality;
  tree = zkd::build(executor, mesh.view(), build);
  result.has_quality = options.measure_quality;
  result.statistics = tree.statistics();
  result.options = tree.options();
  result.options.backend = Backend::cpu;  // an executor was given, so the option stays as asked
  result.tree_hash = verify::tree_hash(tree.view());
  return result;
}

// `bunny`, or `bunny-all` for the later of several settings.
std::string image_name(const Result& result, std::size_t setting) {
  if (setting == 0) return result.scene;
  std::string name = result.scene + "-" + result.setting;
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

}  // namespace

std::vector<Result> run_scene(const scene::SceneInfo& info, const Options& options,
                              const cpu::Executor& executor) {
  const scene::Mesh mesh = scene::load_mesh(info.path);
  const TriangleView triangles = mesh.view();
  const scene::Camera camera = info.camera ? *info.camera : scene::fit_camera(scene::bounds(mesh));

  std::vector<Result> results;
  std::vector<std::unique_ptr<ZkdContender>> ours;
  Workload workload;
  for (std::size_t setting = 0; setting < options.settings.size(); ++setting) {
    Tree tree;
    results.push_back(describe(info, mesh, options, setting, executor, tree));
    if (setting == 0) workload = make_workload(options, camera, triangles, tree, executor);
    measure_traversal(results.back(), workload, triangles, tree, executor);
    ours.push_back(std::make_unique<ZkdContender>(executor, triangles, options.settings[setting]));
  }

  std::vector<std::unique_ptr<EmbreeContender>> peers;
  if (!options.peers.empty()) peers = embree_contenders(mesh, executor.threads);

  std::vector<Entrant> entrants;
  for (const auto& contender : ours) entrants.emplace_back(*contender);
  for (const auto& contender : peers) entrants.emplace_back(*contender);

  const Stopwatch timing;
  const std::int64_t preempted_before = preemptions();
  {
    scene::Progress progress("timing " + info.name, (options.repeat + 1) * entrants.size());
    for (unsigned repetition = 0; repetition <= options.repeat; ++repetition) {
      for (Entrant& entrant : entrants) {
        repeat_once(entrant, workload, repetition > 0);
        progress.advance(1);
      }
    }
  }

  const double preempted_per_s =
      static_cast<double>(preemptions() - preempted_before) / (1e-3 * timing.ms());

  std::vector<Peer> timed_peers;
  for (std::size_t i = 0; i < peers.size(); ++i) {
    const Entrant& entrant = entrants[ours.size() + i];
    const std::vector<std::string> names = peers[i]->names();
    for (std::size_t way = 0; way < names.size(); ++way) {
      Peer peer;
      peer.name = names[way];
      peer.build_ms = spread_of(entrant.build_ms);
      peer.held_bytes = peers[i]->memory().held;
      peer.peak_bytes = peers[i]->memory().peak;
      peer.traces = traces_of(entrant.traces[way], workload);
      timed_peers.push_back(std::move(peer));
    }
  }
  peers.clear();

  std::optional<verify::Oracle> oracle;
  if (options.check > 0) {
    // A loop over all triangles is the oracle's choice for small meshes; with many rays it is long.
    const bool many =
        static_cast<double>(options.check) * static_cast<double>(triangles.triangle_count) > 1e8;
    oracle.emplace(triangles,
                   many ? verify::Oracle::Search::box_tree : verify::Oracle::Search::automatic);
  }
  const bool closed = options.check > 0 && is_closed(mesh);

  for (std::size_t setting = 0; setting < results.size(); ++setting) {
    Result& result = results[setting];
    const Entrant& entrant = entrants[setting];
    result.build_ms = spread_of(entrant.build_ms);
    for (const Samples& stage : entrant.stages_ms) result.stages_ms.push_back(spread_of(stage));
    for (auto& [kind, trace] : traces_of(entrant.traces[0], workload)) {
      Trace& known = result.traces[kind];
      known.rays = trace.rays;
      known.hits = trace.hits;
      known.ms = trace.ms;
    }
    result.peers = timed_peers;
    result.preempted_per_s = preempted_per_s;

    if (!oracle && !options.images) continue;
    ours[setting]->build();
    const Tree& tree = ours[setting]->tree();
    if (oracle) {
      const CheckedScene checked{mesh,         *oracle,       camera,      options.rays,
                                 options.size, options.check, options.seed};
      result.checks = check_tree(checked, tree, executor);
      result.check = all_kinds(result.checks);
      if (closed) result.check->leaks = count_leaks(checked, tree, executor);
    }
    if (options.images) {
      result.visits_at_white = write_images(*options.images, image_name(result, setting), triangles,
                                            tree, camera, options.size, executor);
    }
    ours[setting]->clear();
  }
  return results;
}

}  // namespace zkd::bench
