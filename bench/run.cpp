// SPDX-License-Identifier: Apache-2.0
//
// One scene measured: what is timed, in which order, and what is found out besides.
#include "run.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <sys/resource.h>

#include <zkd/build.hpp>
#include <zkd/query.hpp>
#include <zkd/tree_statistics.hpp>

#include "check.hpp"
#include "cold_start.hpp"
#include "contender_zkd.hpp"
#include "cuda.hpp"
#include "images.hpp"
#include "peers_embree.hpp"
#include "rays.hpp"
#include "scene/load.hpp"
#include "scene/progress.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::bench {
namespace {

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
  if (auto* const ours = dynamic_cast<ZkdContender*>(&contender); ours != nullptr && keep) {
    const Samples stage_ms = ours->stage_ms();
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

void measure_traversal(Result& result, const Workload& workload, ZkdContender& contender) {
  for (const auto& [kind, rays] : workload.rays) {
    if (rays.empty()) continue;
    std::vector<TraversalCost> costs(rays.size());
    if (kind == RayKind::shadow) {
      std::vector<std::uint8_t> occluded(rays.size());
      contender.any_hit(rays, occluded, costs);
    } else {
      std::vector<Hit> hits(rays.size());
      contender.closest_hit(rays, hits, costs);
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

// Whether the contender's answers have the bits of the CPU's.
bool answers_equal(const Workload& workload, const TriangleView& triangles, const Tree& tree,
                   const cpu::Executor& executor, Intersector intersector,
                   ZkdContender& contender) {
  const auto same = [](const auto& a, const auto& b) {
    return std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
  };
  for (const auto& [kind, rays] : workload.rays) {
    if (kind == RayKind::shadow) {
      std::vector<std::uint8_t> expected(rays.size());
      std::vector<std::uint8_t> seen(rays.size());
      any_hit(executor, tree.view(), triangles, rays, expected, {}, intersector);
      contender.any_hit(rays, seen);
      if (!rays.empty() && !same(expected, seen)) return false;
    } else {
      std::vector<Hit> expected(rays.size());
      std::vector<Hit> seen(rays.size());
      closest_hit(executor, tree.view(), triangles, rays, expected, {}, intersector);
      contender.closest_hit(rays, seen);
      if (!rays.empty() && !same(expected, seen)) return false;
    }
  }
  return true;
}

// Facts that take no clock, from the CPU's tree: what every backend has to make.
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
  result.intersector = to_string(options.intersector);
  result.seed = options.seed;

  BuildOptions build = options.settings[setting];
  build.measure_quality = options.measure_quality;
  tree = zkd::build(executor, mesh.view(), build);
  result.has_quality = options.measure_quality;
  result.statistics = tree.statistics();
  if (options.stats) result.tree_statistics = measure_tree(tree.view());
  result.tree_hash = verify::tree_hash(tree.view());
  return result;
}

std::vector<std::unique_ptr<ZkdContender>> our_contenders(const Options& options, Backend backend,
                                                          const TriangleView& triangles,
                                                          const cpu::Executor& executor) {
  if (backend == Backend::cuda)
    return cuda_contenders(triangles, options.settings, options.intersector);
  std::vector<std::unique_ptr<ZkdContender>> contenders;
  for (std::size_t i = 0; i < options.settings.size(); ++i) {
    contenders.push_back(cpu_contender(executor, triangles, options.settings[i],
                                       options.intersector, options.layouts[i]));
  }
  return contenders;
}

// `bunny`, or `bunny-all` for the later of several settings.
std::string image_name(const Result& result, std::size_t setting) {
  if (setting == 0) return result.scene;
  std::string name = result.scene + "-" + result.setting;
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

}  // namespace

std::vector<Result> run_scene(const scene::SceneInfo& info, const Options& options, Backend backend,
                              const cpu::Executor& executor) {
  const scene::Mesh mesh = scene::load_mesh(info.path);
  const TriangleView triangles = mesh.view();
  const scene::Camera camera = scene::camera_for(info, mesh);

  std::unique_ptr<Checker> checker;
  if (options.check > 0) checker = make_checker(mesh, camera, options, executor.threads);
  std::vector<std::unique_ptr<EmbreeContender>> peers;
  if (!options.peers.empty()) peers = embree_contenders(mesh, executor.threads);

  std::vector<Result> results;
  const auto ours = our_contenders(options, backend, triangles, executor);
  Workload workload;
  for (std::size_t setting = 0; setting < ours.size(); ++setting) {
    Tree tree;
    Result result = describe(info, mesh, options, setting, executor, tree);
    ZkdContender& contender = *ours[setting];
    contender.describe(result);
    if (setting == 0) workload = make_workload(options, camera, triangles, tree, executor);
    contender.build();
    measure_traversal(result, workload, contender);
    if (result.gpu) {
      result.gpu->hits_equal =
          answers_equal(workload, triangles, tree, executor, options.intersector, contender);
      if (const auto cold = cold_build_elsewhere(info.path, result.options)) {
        result.gpu->context_ms = cold->context_ms;
        result.gpu->cold_ms = cold->build_ms;
      }
    }
    contender.clear();
    results.push_back(std::move(result));
  }

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

    ZkdContender& contender = *ours[setting];
    contender.measure_more(result, options.repeat);
    if (!checker && !options.images) continue;
    contender.build();
    if (checker) checker->check(contender, result);
    if (options.images) {
      result.visits_at_white = write_images(*options.images, image_name(result, setting), triangles,
                                            contender.tree(), camera, options.size, executor);
    }
    contender.clear();
  }
  return results;
}

}  // namespace zkd::bench
