// SPDX-License-Identifier: Apache-2.0
//
// zkd-accuracy: from a command line to tables, JSON, plots and an exit status.
#include <omp.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

#include <zkd/error.hpp>

#include "cuda.hpp"
#include "exit_status.hpp"
#include "machine.hpp"
#include "options.hpp"
#include "output_file.hpp"
#include "pictures.hpp"
#include "report.hpp"
#include "scene/catalog.hpp"
#include "scene/load.hpp"
#include "scenes.hpp"
#include "verify/oracle.hpp"

namespace zkd::bench::accuracy {
namespace {

std::vector<scene::SceneInfo> find_scenes(const Options& options) {
  std::vector<scene::SceneInfo> infos;
  if (options.scenes.empty()) {
    infos = scene::paper_scenes();
    if (options.first_scene_only && infos.size() > 1) infos.resize(1);
  }
  for (const std::string& name : options.scenes) infos.push_back(scene::find_scene(name));
  return infos;
}

std::vector<TestScene> load_scenes(const std::vector<scene::SceneInfo>& infos,
                                   const Options& options) {
  std::vector<TestScene> scenes;
  for (const scene::SceneInfo& info : infos) {
    TestScene loaded{info.name, info.stand_in, false, scene::load_mesh(info.path), {}};
    loaded.camera = scene::camera_for(info, loaded.mesh);
    scenes.push_back(std::move(loaded));
  }
  if (options.stress > 0) {
    for (TestScene& scene : stress_scenes(options.stress, options.seed)) {
      scenes.push_back(std::move(scene));
    }
  }
  return scenes;
}

// Exact answers are asked for here and nowhere else; they serve the curves, E1, E2, E4 and E6.
void measure_scene(const TestScene& scene, const Options& options, const cpu::Executor& executor,
                   const Beside& beside, Report& report) {
  const verify::Oracle oracle(scene.mesh.view(), verify::Oracle::Search::box_tree);
  const std::vector<RaySet> sets = ray_sets(scene, oracle, executor, options.size, options.seed);
  for (const RaySet& set : sets) {
    report.oracle.push_back({scene.name, set.kind, set.rays.size(), set.truth->oracle_seconds()});
  }
  const bool curves = options.measures.contains(Measure::curves);
  if (curves || options.measures.contains(Measure::errors)) {
    CurveOptions curve_options;
    curve_options.repeat = options.repeat;
    curve_options.beside = beside;
    curve_options.intersectors_only = !curves;
    const std::vector<Point> points = measure_curves(scene, sets, oracle, executor, curve_options);
    report.add_errors(points);
    if (curves) report.points.insert(report.points.end(), points.begin(), points.end());
  }
  if (options.measures.contains(Measure::e6)) {
    for (TreeQuality& quality : measure_quality(scene, sets, executor)) {
      report.e6.push_back(std::move(quality));
    }
  }
  if (options.plots) {
    const unsigned size = std::clamp(options.size * 4, 128u, 1024u);
    write_literal_errors(*options.plots, scene, oracle, size, executor);
  }
}

void make_plots(const std::filesystem::path& folder) {
  std::string program = ZKD_ACCURACY_PLOT;
  std::string argument = folder.string();
  char* arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  if (posix_spawn(&child, program.c_str(), nullptr, nullptr, arguments, environ) != 0) {
    throw UsageError("--plots: cannot run " + program);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw UsageError("--plots: " + program +
                     " failed (it needs matplotlib; Debian and Ubuntu: python3-matplotlib)");
  }
}

int run(const Options& options) {
  cpu::Executor executor;
  executor.threads = options.threads > 0 ? options.threads : omp_get_max_threads();
  Report report;
  report.machine = describe_machine(executor.threads);
  const Where where = resolve(options.backend);
  const Beside beside{.peers = options.peers, .cuda = where.backend == Backend::cuda};
  if (beside.cuda) describe_device(report.machine);

  // Before anything is measured, so that a bad path costs no minutes.
  const bool json_only = options.json && *options.json == "-";
  std::optional<OutputFile> json_file;
  std::optional<TableFile> table;
  if (options.json && !json_only) json_file.emplace("--json", *options.json);
  if (options.table) table.emplace(*options.table);
  if (options.plots) {
    std::error_code error;
    std::filesystem::create_directories(*options.plots, error);
    if (!std::filesystem::is_directory(*options.plots)) {
      throw UsageError("--plots: cannot make the folder " + options.plots->string());
    }
  }

  const std::vector<scene::SceneInfo> infos = find_scenes(options);
  for (const scene::SceneInfo& info : infos)
    if (json_file) json_file->must_not_be(info.path);
  const std::vector<TestScene> scenes = load_scenes(infos, options);
  for (const TestScene& scene : scenes) report.scenes.push_back(scene.name);
  const auto asked = [&](Measure measure) { return options.measures.contains(measure); };
  if (asked(Measure::curves) || asked(Measure::errors) || asked(Measure::e6) || options.plots) {
    for (const TestScene& scene : scenes) measure_scene(scene, options, executor, beside, report);
  }
  if (asked(Measure::e3)) {
    report.e3 =
        compare_with_brute_force(options.brute_force, options.seed, executor.threads, beside.cuda);
  }
  if (asked(Measure::e5)) {
    report.e5 = count_leaks(scenes, options.leaks, options.seed, executor, beside);
  }
  if (asked(Measure::e7))
    report.e7 = compare_hashes(scenes, options.meshes, options.seed, beside.cuda);

  const std::string json = to_json(report, options);
  if (json_file) json_file->write(json);
  if (table) table->write(pareto_table(report));
  if (options.plots) {
    write_vertex_leaks(*options.plots, 256, options.seed, executor);
    OutputFile("--plots", *options.plots / "results.json").write(json);
    make_plots(*options.plots);
  }
  if (json_only)
    std::cout << json;
  else
    print(std::cout, report);
  return report.failures().empty() ? done : check_failed;
}

}  // namespace
}  // namespace zkd::bench::accuracy

int main(int argc, char** argv) {
  using namespace zkd::bench::accuracy;
  return zkd::bench::exit_status_of("zkd-accuracy", [&]() -> int {
    const std::optional<Options> options = parse_options(argc, argv);
    return options ? run(*options) : zkd::bench::done;
  });
}
