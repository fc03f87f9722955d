// SPDX-License-Identifier: Apache-2.0
//
// The command line of zkd-accuracy: three sizes of run, and options that override them.
#include "options.hpp"

#include <array>
#include <cstdlib>
#include <string_view>
#include <utility>

#include <zkd/config.hpp>

#include "choices.hpp"
#include "command_line.hpp"

namespace zkd::bench::accuracy {
namespace {

struct Preset {
  std::int64_t stress;
  std::int64_t size;
  std::int64_t repeat;
  std::int64_t brute_force;
  std::int64_t leaks;
  std::int64_t meshes;
};
constexpr Preset quick_run{1000, 32, 1, 200'000, 400'000, 32};
constexpr Preset normal_run{20'000, 192, 3, 5'000'000, 10'000'000, 320};
constexpr Preset full_run{100'000, 1024, 5, 100'000'000, 100'000'000, 3200};

// Names of --measures; e1, e2 and e4 are one measurement.
constexpr std::array<std::pair<std::string_view, Measure>, 8> measure_names{
    {{"e1", Measure::errors},
     {"e2", Measure::errors},
     {"e3", Measure::e3},
     {"e4", Measure::errors},
     {"e5", Measure::e5},
     {"e6", Measure::e6},
     {"e7", Measure::e7},
     {"curves", Measure::curves}}};

std::set<Measure> measures_listed(std::string_view list) {
  std::set<Measure> measures;
  for (const std::string_view name : parts_of(list)) {
    const auto* const found = std::find_if(measure_names.begin(), measure_names.end(),
                                           [&](const auto& entry) { return entry.first == name; });
    if (found == measure_names.end()) {
      throw UsageError("--measures: '" + std::string(name) +
                       "' is not one of e1, e2, e3, e4, e5, e6, e7, curves");
    }
    measures.insert(found->second);
  }
  return measures;
}

std::string by_preset(std::int64_t quick, std::int64_t normal, std::int64_t full) {
  return " [" + std::to_string(quick) + " --quick, " + std::to_string(normal) + ", " +
         std::to_string(full) + " --full]";
}

}  // namespace

std::optional<Options> parse_options(int argc, const char* const* argv) {
  Options options;
  bool quick = false;
  bool full = false;
  std::string measures = "e1,e2,e3,e4,e5,e6,e7,curves";
  std::string backend = zkd::to_string(options.backend);
  std::string peers = "embree";
  std::string json;
  std::string plots;
  std::string table;
  std::int64_t threads = 0;
  std::int64_t seed = 1;
  Preset given{};

  CLI::App app(
      "Measures errors against exact arithmetic, and run time against error.\n"
      "Without a SCENE: every paper scene that is found (--quick: the first).",
      "zkd-accuracy");
  app.get_formatter()->column_width(28);
  app.set_version_flag("--version", "zkd-accuracy " ZKD_VERSION, "Print the version and exit");
  app.add_option("SCENE", options.scenes,
                 "Mesh files (.obj .ply .gltf .glb .stl) or names (zkd-bench --list)");

  const char* measure = "Measure";
  CLI::Option* const quick_flag =
      app.add_flag("--quick", quick, "A run of some ten seconds")->group(measure);
  app.add_flag("--full", full, "A run of hours")->group(measure)->excludes(quick_flag);
  app.add_option("--measures", measures, "List of e1, e2, e3, e4, e5, e6, e7, curves")
      ->group(measure)
      ->type_name("LIST")
      ->capture_default_str();
  const auto number = [&](const char* name, std::int64_t& value, const std::string& help,
                          std::int64_t lowest, std::int64_t highest) {
    return add_whole_number(app, name, value, help, lowest, highest)->group(measure);
  };
  const auto preset = [&](const char* name, std::int64_t Preset::*value, const std::string& help,
                          std::int64_t lowest, std::int64_t highest) {
    number(name, given.*value,
           help + by_preset(quick_run.*value, normal_run.*value, full_run.*value), lowest, highest)
        ->default_str("");
  };
  constexpr std::int64_t most_rays = 1'000'000'000'000;
  preset("--size", &Preset::size, "N x N primary rays, and as many at edges and vertices", 1, 8192);
  preset("--repeat", &Preset::repeat, "Interleaved repetitions of the curves", 1, 1000);
  preset("--stress", &Preset::stress, "Triangles of the generated scenes; 0: without them", 0,
         10'000'000);
  preset("--brute-force", &Preset::brute_force, "Rays of E3, tree against brute force", 1,
         most_rays);
  preset("--leaks", &Preset::leaks, "Rays of E5, from inside closed meshes", 1, most_rays);
  preset("--meshes", &Preset::meshes, "Small meshes of E7", 1, 1'000'000);
  app.add_option("--backend", backend,
                 "Which zkd: cpu; cuda: the device too; auto: the device too if one answers")
      ->group(measure)
      ->type_name("WHICH")
      ->capture_default_str();
  number("--threads", threads, "CPU threads; 0: all", 0, 4096);
  number("--seed", seed, "Of everything that is random", 0, std::int64_t{0x7FFFFFFFFFFFFFFF});
  app.add_option("--peers", peers, "Others to measure beside: embree (where built with it), none")
      ->group(measure)
      ->type_name("LIST")
      ->capture_default_str();

  const char* report = "Report";
  app.add_option("--json", json, "Write results; `-`: standard output, and no table")
      ->group(report)
      ->type_name("FILE");
  app.add_option("--plots", plots, "Draw run time against error, and where errors are")
      ->group(report)
      ->type_name("DIR");
  app.add_option("--table", table,
                 "Write the Pareto table in Markdown: between the markers of FILE, or a new FILE")
      ->group(report)
      ->type_name("FILE");
  app.footer(exit_status_help);
  if (!parse(app, argc, argv)) return std::nullopt;
  if (peers != "embree" && peers != "none") {
    throw UsageError("--peers: '" + peers + "' is not one of embree, none");
  }

  const Preset& base = quick ? quick_run : full ? full_run : normal_run;
  const auto chosen = [&](const char* name, std::int64_t Preset::*value) {
    return app.count(name) > 0 ? given.*value : base.*value;
  };
  options.measures = measures_listed(measures);
  options.stress = static_cast<std::uint32_t>(chosen("--stress", &Preset::stress));
  options.size = static_cast<unsigned>(chosen("--size", &Preset::size));
  options.repeat = static_cast<unsigned>(chosen("--repeat", &Preset::repeat));
  options.brute_force = static_cast<std::uint64_t>(chosen("--brute-force", &Preset::brute_force));
  options.leaks = static_cast<std::uint64_t>(chosen("--leaks", &Preset::leaks));
  options.meshes = static_cast<std::uint64_t>(chosen("--meshes", &Preset::meshes));
  options.seed = static_cast<std::uint64_t>(seed);
  options.threads = static_cast<int>(threads);
  if (app.count("--table") > 0 && !options.measures.contains(Measure::curves))
    throw UsageError("--table: shows curves, which --measures leaves out");
  options.backend = value_named(all_backends, "--backend", backend);
  options.peers = peers == "embree";
  options.first_scene_only = quick;
  if (app.count("--json") > 0) options.json = json;
  if (app.count("--plots") > 0) options.plots = plots;
  if (app.count("--table") > 0) options.table = table;
  return options;
}

}  // namespace zkd::bench::accuracy
