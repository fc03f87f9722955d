// SPDX-License-Identifier: Apache-2.0
//
// zkd-bench: from a command line to tables, JSON and an exit status.
#include <omp.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <new>
#include <string>

#include <zkd/build.hpp>
#include <zkd/error.hpp>

#include "json.hpp"
#include "machine.hpp"
#include "options.hpp"
#include "run.hpp"
#include "scene/catalog.hpp"
#include "scene/load.hpp"
#include "table.hpp"

namespace zkd::bench {
namespace {

enum ExitStatus { done = 0, check_failed = 1, bad_input = 2, device_failure = 3 };

int fail(ExitStatus status, std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::cerr << "zkd-bench: error: " << message << std::endl;
  return status;
}

ExitStatus status_of(ErrorCode code) {
  return code == ErrorCode::out_of_memory || code == ErrorCode::backend_unavailable ? device_failure
                                                                                    : bad_input;
}

// Asks the library, which knows what is linked and whether a device answers.
Backend resolve(Backend wanted) {
  BuildOptions options;
  options.backend = wanted;
  return build(TriangleView{}, options).options().backend;
}

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

// Opens the file before anything is measured, so that a bad path costs no minutes.
std::ofstream open_json(const Options& options) {
  std::ofstream file;
  if (!options.json || *options.json == "-") return file;
  file.open(*options.json);
  if (!file) throw UsageError("--json: cannot write " + options.json->string());
  return file;
}

void make_image_folder(const Options& options) {
  if (!options.images) return;
  std::error_code error;
  std::filesystem::create_directories(*options.images, error);
  if (!std::filesystem::is_directory(*options.images)) {
    throw UsageError("--images: cannot make the folder " + options.images->string());
  }
}

int run(const Options& options) {
  if (options.list) {
    print_scenes(std::cout, scene::list_scenes(), scene::known_scenes());
    return done;
  }

  const std::vector<scene::SceneInfo> scenes = find_scenes(options);
  const Backend backend = resolve(options.settings.front().backend);
  std::ofstream json_file = open_json(options);
  make_image_folder(options);

  cpu::Executor executor;
  executor.threads = options.threads > 0 ? options.threads : omp_get_max_threads();
  executor.instructions = options.instructions;
  const Machine machine = describe_machine(executor.threads);

  const bool json_only = options.json && *options.json == "-";
  if (!json_only) print_header(std::cout, options, machine, backend);

  std::vector<Result> results;
  for (const scene::SceneInfo& info : scenes) {
    std::vector<Result> of_scene = run_scene(info, options, executor);
    std::move(of_scene.begin(), of_scene.end(), std::back_inserter(results));
  }

  if (!json_only) print_results(std::cout, options, results);
  if (options.json) {
    std::ostream& out = json_only ? static_cast<std::ostream&>(std::cout) : json_file;
    out << to_json(machine, results) << std::flush;
    if (!out) throw UsageError("--json: cannot write " + options.json->string());
  }
  const bool failed = std::any_of(results.begin(), results.end(), [](const Result& result) {
    return result.check && result.check->outside.total() > 0;
  });
  return failed ? check_failed : done;
}

}  // namespace
}  // namespace zkd::bench

int main(int argc, char** argv) {
  using namespace zkd::bench;
  try {
    const std::optional<Options> options = parse_options(argc, argv);
    return options ? run(*options) : done;
  } catch (const zkd::Error& error) {
    return fail(status_of(error.code()), error.what());
  } catch (const std::bad_alloc&) {
    return fail(device_failure, "out of memory");
  } catch (const std::exception& error) {
    return fail(bad_input, error.what());
  }
}
