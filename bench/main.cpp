// SPDX-License-Identifier: Apache-2.0
//
// zkd-bench: from a command line to tables, JSON and an exit status.
#include <omp.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <optional>
#include <string>

#include <zkd/error.hpp>

#include "contender.hpp"
#include "cuda.hpp"
#include "exit_status.hpp"
#include "json.hpp"
#include "machine.hpp"
#include "options.hpp"
#include "output_file.hpp"
#include "run.hpp"
#include "scene/catalog.hpp"
#include "scene/image.hpp"
#include "scene/load.hpp"
#include "table.hpp"

namespace zkd::bench {
namespace {

std::vector<scene::SceneInfo> find_scenes(const Options& options) {
  if (options.scenes.empty()) {
    std::vector<scene::SceneInfo> scenes = scene::paper_scenes();
    if (scenes.empty()) {
      throw scene::LoadError(
          "no scene of the paper is on this machine: name a mesh file, set ZKD_SCENES to a folder "
          "with meshes, or run scenes/fetch");
    }
    return scenes;
  }
  std::vector<scene::SceneInfo> scenes;
  for (const std::string& name : options.scenes) scenes.push_back(scene::find_scene(name));
  return scenes;
}

void make_image_folder(const Options& options) {
  if (!options.images) return;
  std::error_code error;
  std::filesystem::create_directories(*options.images, error);
  if (!std::filesystem::is_directory(*options.images)) {
    throw UsageError("--images: cannot make the folder " + options.images->string());
  }
}

// --cold: what another zkd-bench asks for.
int run_cold(const Options& options) {
  const scene::SceneInfo info = scene::find_scene(options.scenes.front());
  const scene::Mesh mesh = scene::load_mesh(info.path);
  const ColdBuild cold = time_cold_build(mesh.view(), options.settings.front());
  std::cout << to_json(cold) << std::flush;
  return done;
}

bool failed(const Result& result) {
  return (result.check && result.check->outside.total() > 0) ||
         (result.gpu && !(result.gpu->hash_equal && result.gpu->hits_equal));
}

int run(const Options& options) {
  if (options.list) {
    print_scenes(std::cout, scene::list_scenes(), scene::known_scenes());
    return done;
  }
  if (options.cold) return run_cold(options);

  const Stopwatch watch;
  const std::vector<scene::SceneInfo> scenes = find_scenes(options);
  const Where where = resolve(options.settings.front().backend);
  if (options.images && !scene::can_write_png()) {
    throw UsageError("--images: this zkd-bench was built without OpenImageIO");
  }
  if (where.backend == Backend::cuda &&
      std::any_of(options.layouts.begin(), options.layouts.end(),
                  [](Layout layout) { return layout != Layout::binary; })) {
    throw UsageError("--layout: wide, planes and literal are for the CPU; add --backend cpu");
  }
  const bool json_only = options.json && *options.json == "-";
  make_image_folder(options);

  cpu::Executor executor;
  executor.threads = options.threads > 0 ? options.threads : omp_get_max_threads();
  executor.instructions = options.instructions;
  Machine machine = describe_machine(executor.threads);
  if (where.backend == Backend::cuda) describe_device(machine);

  std::vector<Result> results;
  std::optional<OutputFile> json;
  if (options.json && !json_only) {
    json.emplace("--json", *options.json);
    for (const scene::SceneInfo& info : scenes) json->must_not_be(info.path);
  }
  if (!json_only) print_header(std::cout, options, machine, where.backend, where.why_not_cuda);

  for (const scene::SceneInfo& info : scenes) {
    if (options.time_limit > 0 && watch.ms() > 1000.0 * options.time_limit) {
      std::cerr << "zkd-bench: note: " << info.name << " is left out: --time-limit is reached"
                << std::endl;
      continue;
    }
    std::vector<Result> of_scene = run_scene(info, options, where.backend, executor);
    std::move(of_scene.begin(), of_scene.end(), std::back_inserter(results));
    // After each scene, so that what was measured is kept if a later one fails.
    if (json) json->write(to_json(machine, results));
  }

  if (json_only)
    std::cout << to_json(machine, results);
  else
    print_results(std::cout, options, results);
  return std::any_of(results.begin(), results.end(), failed) ? check_failed : done;
}

}  // namespace
}  // namespace zkd::bench

int main(int argc, char** argv) {
  using namespace zkd::bench;
  return exit_status_of("zkd-bench", [&]() -> int {
    const std::optional<Options> options = parse_options(argc, argv);
    return options ? run(*options) : done;
  });
}
