// SPDX-License-Identifier: Apache-2.0
//
// The command line of zkd-bench: every option, its reading and its help.
#include "options.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <zkd/config.hpp>
#include <zkd/geometry.hpp>

#include "choices.hpp"
#include "command_line.hpp"

namespace zkd::bench {
namespace {

constexpr std::array all_references{References::once, References::budget, References::all,
                                    References::automatic};
constexpr std::array all_builders{Builder::morton, Builder::sah, Builder::wu2011};
constexpr std::array all_qualities{Quality::fast, Quality::balanced, Quality::high};
constexpr std::array all_axis_orders{AxisOrder::by_extent, AxisOrder::cyclic};
constexpr std::array all_sah_areas{SahAreas::tight, SahAreas::cells};
constexpr std::array all_invalid{InvalidTriangles::error, InvalidTriangles::skip};
constexpr std::array all_ray_kinds{RayKind::primary, RayKind::diffuse, RayKind::shadow};
constexpr std::array all_instructions{cpu::InstructionSet::automatic, cpu::InstructionSet::portable,
                                      cpu::InstructionSet::avx2};
constexpr std::array all_layouts{Layout::binary, Layout::wide, Layout::planes, Layout::literal};
constexpr std::array all_peers{PeerLibrary::embree};

const char* on_off(bool value) { return value ? "on" : "off"; }

bool on_or_off(const std::string& option, const std::string& value) {
  if (value == "on") return true;
  if (value == "off") return false;
  throw UsageError(option + ": '" + value + "' is not one of on, off");
}

// The poster knows one tree, and planes alone are for strict ones.
bool has_layout(Layout layout, Builder builder, Quality quality, References references) {
  const bool by_codes = builder == Builder::morton && quality != Quality::high;
  if (layout == Layout::literal)
    return by_codes && quality == Quality::fast && references == References::once;
  return layout != Layout::planes || !by_codes || references == References::all;
}

// What distinguishes a setting: its values on the options that were given more than one.
std::string label_of(const BuildOptions& setting, Layout layout, bool builders, bool qualities,
                     bool references, bool layouts) {
  std::string label;
  const auto add = [&](bool varies, const char* name) {
    if (!varies) return;
    if (!label.empty()) label += ' ';
    label += name;
  };
  add(builders, zkd::to_string(setting.builder));
  add(qualities, zkd::to_string(setting.quality));
  add(references, zkd::to_string(setting.references));
  add(layouts, to_string(layout));
  return label;
}

}  // namespace

const char* to_string(PeerLibrary) noexcept { return "embree"; }

const char* to_string(Layout layout) noexcept {
  constexpr const char* names[] = {"binary", "wide", "planes", "literal"};
  return names[static_cast<std::size_t>(layout)];
}

std::vector<std::string> flags_of(const BuildOptions& options) {
  return {"--builder",
          zkd::to_string(options.builder),
          "--quality",
          zkd::to_string(options.quality),
          "--references",
          zkd::to_string(options.references),
          "--budget",
          std::to_string(options.budget),
          "--leaf-size",
          std::to_string(options.leaf_size),
          "--code-bits",
          std::to_string(options.code_bits),
          "--axis-order",
          zkd::to_string(options.axis_order),
          "--recode",
          on_off(options.recode_crowded),
          "--invalid",
          zkd::to_string(options.invalid_triangles),
          "--reference-capacity",
          std::to_string(options.reference_capacity),
          "--sah-areas",
          zkd::to_string(options.sah.areas),
          "--sah-visit-cost",
          std::to_string(options.sah.visit_cost),
          "--sah-test-cost",
          std::to_string(options.sah.test_cost),
          "--sah-empty-bonus",
          std::to_string(options.sah.empty_bonus)};
}

std::optional<Options> parse_options(int argc, const char* const* argv) {
  const BuildOptions defaults;
  Options options;

  std::string backend = zkd::to_string(defaults.backend);
  std::string builder = zkd::to_string(defaults.builder);
  std::string quality = zkd::to_string(defaults.quality);
  std::string references = zkd::to_string(defaults.references);
  std::string axis_order = zkd::to_string(defaults.axis_order);
  std::string invalid = zkd::to_string(defaults.invalid_triangles);
  std::string sah_areas = zkd::to_string(defaults.sah.areas);
  std::string recode = on_off(defaults.recode_crowded);
  std::string measure_quality = "on";
  std::string instructions = to_string(options.instructions);
  std::string intersector = zkd::to_string(options.intersector);
  std::string layout = to_string(Layout::binary);
  std::string rays = names_of(all_ray_kinds, ",");
  std::string peers;
  double budget = static_cast<double>(defaults.budget);
  double visit_cost = static_cast<double>(defaults.sah.visit_cost);
  double test_cost = static_cast<double>(defaults.sah.test_cost);
  double empty_bonus = static_cast<double>(defaults.sah.empty_bonus);
  std::int64_t threads = 0;
  std::int64_t leaf_size = defaults.leaf_size;
  std::int64_t code_bits = defaults.code_bits;
  std::int64_t size = options.size;
  std::int64_t repeat = options.repeat;
  std::int64_t check = 0;
  std::int64_t seed = 1;
  std::int64_t reference_capacity = 0;
  std::int64_t time_limit = 0;
  std::string json;
  std::string images;

  CLI::App app(
      "Builds kd-trees, traces rays through them and says how long it took.\n"
      "Without a SCENE: the paper's table over every paper scene that is found.",
      "zkd-bench");
  app.get_formatter()->column_width(34);
  app.set_version_flag("--version", "zkd-bench " ZKD_VERSION, "Print the version and exit");

  app.add_option("SCENE", options.scenes,
                 "Mesh files (.obj .ply .gltf .glb .stl) or names (--list)");
  app.add_flag("--list", options.list, "List the scenes found on this machine and exit");

  const auto text = [&](const char* group, const char* name, std::string& value,
                        const std::string& help, const char* type) {
    app.add_option(name, value, help)->group(group)->type_name(type)->capture_default_str();
  };
  const auto number = [&](const char* group, const char* name, std::int64_t& value,
                          const std::string& help, std::int64_t lowest, std::int64_t highest) {
    add_whole_number(app, name, value, help, lowest, highest)->group(group);
  };

  const char* build = "Build";
  text(build, "--backend", backend, "Where to build: " + names_of(all_backends, ", "), "WHERE");
  number(build, "--threads", threads, "CPU threads; 0: all", 0, 4096);
  text(build, "--builder", builder, "List of " + names_of(all_builders, ", "), "LIST");
  text(build, "--quality", quality, "List of " + names_of(all_qualities, ", "), "LIST");
  text(build, "--references", references, "List of " + names_of(all_references, ", "), "LIST");
  const auto fraction = [&](const char* name, double& value, const char* help) {
    app.add_option(name, value, help)->group(build)->type_name("F")->capture_default_str();
  };
  fraction("--budget", budget,
           "References per triangle at most, for `budget`; fragments that decide cells of `all`");
  number(build, "--leaf-size", leaf_size, "Triangles in a leaf at most; 0: 4, for `all` 12", 0,
         1024);
  number(build, "--code-bits", code_bits, "Bits of a Morton code; 0: by triangle count", 0, 64);
  text(build, "--axis-order", axis_order,
       "Order of the axes in a code: " + names_of(all_axis_orders, ", "), "ORDER");
  text(build, "--recode", recode, "Code crowded trunks again: on, off", "ON|OFF");
  text(build, "--invalid", invalid, "NaN and infinite vertices: " + names_of(all_invalid, ", "),
       "WHAT");
  number(build, "--reference-capacity", reference_capacity,
         "On CUDA, references that `all` has room for; 0: as many as it needs", 0,
         std::int64_t{max_count});
  text(build, "--sah-areas", sah_areas,
       "For sah and wu2011, areas of: " + names_of(all_sah_areas, ", "), "WHAT");
  fraction("--sah-visit-cost", visit_cost, "For sah and wu2011, the cost of a node visit");
  fraction("--sah-test-cost", test_cost, "For sah and wu2011, the cost of a triangle test");
  fraction("--sah-empty-bonus", empty_bonus, "For both over cells, what cutting off space saves");
  text(build, "--measure-quality", measure_quality,
       "Depth and SAH cost, in a build of its own: on, off", "ON|OFF");
  text(build, "--instructions", instructions, names_of(all_instructions, ", "), "SET");

  const char* measure = "Measure";
  text(measure, "--intersector", intersector, "How: " + names_of(all_intersectors, ", "), "HOW");
  text(measure, "--layout", layout,
       "List of " + names_of(all_layouts, ", ") + ": what rays go through on the CPU", "LIST");
  text(measure, "--rays", rays, "List of " + names_of(all_ray_kinds, ", "), "LIST");
  number(measure, "--size", size, "N x N primary rays", 1, 16384);
  number(measure, "--seed", seed, "Of bounces and light samples", 0,
         std::int64_t{0x7FFFFFFFFFFFFFFF});
  number(measure, "--repeat", repeat, "Interleaved repetitions", 1, 100000);
  app.add_option("--peers", peers, "Others to time in the same run: " + names_of(all_peers, ", "))
      ->group(measure)
      ->type_name("LIST");
  number(measure, "--check", check, "Rays of each kind against the exact oracle; 0: none", 0,
         20000000);

  number(measure, "--time-limit", time_limit, "Seconds after which no scene is begun; 0: none", 0,
         1000000);
  app.add_flag("--cold", options.cold,
               "Time one CUDA build in this new process, print it as JSON and exit")
      ->group(measure);

  const char* report = "Report";
  app.add_option("--json", json, "Write results; `-`: standard output, and no table")
      ->group(report)
      ->type_name("FILE");
  app.add_option("--images", images, "Write PNG: shaded, depth, node visits")
      ->group(report)
      ->type_name("DIR");
  app.add_flag("--stats", options.stats, "Counts and histograms of the trees")->group(report);
  app.footer(exit_status_help);
  if (!parse(app, argc, argv)) return std::nullopt;

  if (options.cold && options.scenes.size() != 1) {
    throw UsageError("--cold: needs one SCENE");
  }
  if (!std::isfinite(budget) || budget < 1.0) {
    throw UsageError("--budget: '" + std::to_string(budget) + "' is not a number of at least 1");
  }

  BuildOptions base;
  base.backend = value_named(all_backends, "--backend", backend);
  base.budget = static_cast<float>(budget);
  base.leaf_size = static_cast<std::uint32_t>(leaf_size);
  base.code_bits = static_cast<std::uint32_t>(code_bits);
  base.axis_order = value_named(all_axis_orders, "--axis-order", axis_order);
  base.reference_capacity = static_cast<std::uint64_t>(reference_capacity);
  base.recode_crowded = on_or_off("--recode", recode);
  base.sah.areas = value_named(all_sah_areas, "--sah-areas", sah_areas);
  base.sah.visit_cost = static_cast<float>(visit_cost);
  base.sah.test_cost = static_cast<float>(test_cost);
  base.sah.empty_bonus = static_cast<float>(empty_bonus);
  base.invalid_triangles = value_named(all_invalid, "--invalid", invalid);

  const auto builders = values_listed(all_builders, "--builder", builder);
  const auto qualities = values_listed(all_qualities, "--quality", quality);
  const auto policies = values_listed(all_references, "--references", references);
  const auto layouts = values_listed(all_layouts, "--layout", layout);
  for (const Builder one_builder : builders) {
    for (const Quality one_quality : qualities) {
      for (const References one_policy : policies) {
        // The others know one policy and one quality only.
        if (one_builder != Builder::morton &&
            (one_policy != policies.front() || one_quality != qualities.front()))
          continue;
        for (const Layout one_layout : layouts) {
          if (!has_layout(one_layout, one_builder, one_quality, one_policy)) continue;
          BuildOptions setting = base;
          setting.builder = one_builder;
          setting.quality = one_quality;
          setting.references = one_policy;
          options.settings.push_back(setting);
          options.layouts.push_back(one_layout);
          options.labels.push_back(label_of(setting, one_layout, builders.size() > 1,
                                            qualities.size() > 1, policies.size() > 1,
                                            layouts.size() > 1));
        }
      }
    }
  }

  if (options.settings.empty())
    throw UsageError(
        "--layout: literal is for --builder morton, --quality fast, --references once; planes for "
        "--references all, --quality high, --builder sah, wu2011");

  options.threads = static_cast<int>(threads);
  options.instructions = value_named(all_instructions, "--instructions", instructions);
  options.measure_quality = on_or_off("--measure-quality", measure_quality);
  options.intersector = value_named(all_intersectors, "--intersector", intersector);
  if (options.intersector != Intersector::watertight &&
      std::find(options.layouts.begin(), options.layouts.end(), Layout::literal) !=
          options.layouts.end())
    throw UsageError("--layout: literal is for --intersector watertight");
  options.rays = values_listed(all_ray_kinds, "--rays", rays);
  std::sort(options.rays.begin(), options.rays.end());
  options.size = static_cast<unsigned>(size);
  options.seed = static_cast<std::uint64_t>(seed);
  options.repeat = static_cast<unsigned>(repeat);
  options.check = static_cast<std::uint64_t>(check);
  options.time_limit = static_cast<unsigned>(time_limit);
  if (app.count("--peers") > 0) options.peers = values_listed(all_peers, "--peers", peers);
  if (app.count("--json") > 0) options.json = json;
  if (app.count("--images") > 0) options.images = images;
  return options;
}

}  // namespace zkd::bench
