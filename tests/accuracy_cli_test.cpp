// SPDX-License-Identifier: Apache-2.0
//
// zkd-accuracy from the outside: exit status, one-line errors, JSON, tables and plots.
// ZKD_ACCURACY_PATH is the program.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "support/program.hpp"

namespace {

using namespace zkd::test;
namespace fs = std::filesystem;
using Json = nlohmann::json;

class AccuracyCli : public ProgramTest {
 protected:
  AccuracyCli() : ProgramTest(ZKD_ACCURACY_PATH, "zkd-accuracy") {}

  // Everything is measured, on little.
  static constexpr const char* tiny =
      "tetra.obj --quick --size 8 --stress 100 --brute-force 5000 --leaks 4000 --meshes 3"
      " --threads 2";
};

// seen, rays, and either a rate above 0 or an upper bound on it.
void expect_rate(const Json& rate) {
  expect_keys(rate, {"seen", "rays", "rate", "below_at_95"});
  if (rate["seen"] == 0) {
    EXPECT_DOUBLE_EQ(rate["below_at_95"].get<double>(), 3.0 / rate["rays"].get<double>());
  } else {
    EXPECT_TRUE(rate["below_at_95"].is_null());
  }
}

TEST_F(AccuracyCli, HelpAndVersionSucceed) {
  const Outcome help = run("--help");
  EXPECT_EQ(help.status, 0);
  for (const char* option : {"--quick", "--full", "--measures", "--size", "--repeat", "--stress",
                             "--brute-force", "--leaks", "--meshes", "--threads", "--seed",
                             "--backend", "--peers", "--json", "--plots", "--table", "--version"}) {
    EXPECT_NE(help.out.find(option), std::string::npos) << option;
  }
  const Outcome version = run("--version");
  EXPECT_EQ(version.status, 0);
  EXPECT_TRUE(version.out.starts_with("zkd-accuracy ")) << version.out;
  EXPECT_EQ(help.err + version.err, "");
}

TEST_F(AccuracyCli, BadUsageIsOneLineThatNamesTheOption) {
  expect_error("tetra.obj --no-such-option", 2, "--no-such-option");
  expect_error("tetra.obj --measures e8", 2, "e8");
  expect_error("tetra.obj --measures ''", 2, "--measures");
  expect_error("tetra.obj --peers optix", 2, "optix");
  expect_error("tetra.obj --backend vulkan", 2, "vulkan");
  expect_error("tetra.obj --quick --full", 2, "--full");
  for (const char* option : {"--size", "--repeat", "--brute-force", "--leaks", "--meshes"}) {
    expect_error(std::string("tetra.obj ") + option + " 0", 2, option);
    expect_error(std::string("tetra.obj ") + option + " 1.5", 2, option);
    expect_error(std::string("tetra.obj ") + option, 2, option);
  }
  expect_error("tetra.obj --stress -1", 2, "--stress");
  expect_error("missing.obj --quick", 2, "missing.obj");
  expect_error("tetra.obj --json missing-folder/out.json", 2, "--json");
  expect_error("tetra.obj --table missing-folder/out.md", 2, "--table");
  expect_error("tetra.obj --plots tetra.obj/plots", 2, "--plots");
  expect_error("tetra.obj --measures e5 --table new.md", 2, "--table");
  expect_error("tetra.obj --seed 9223372036854775808", 2, "--seed");
}

// An option without a value must not take the scene for one and write over it.
TEST_F(AccuracyCli, NothingIsWrittenOverAScene) {
  for (const char* option : {"--json= ", "--json tetra.obj ", "--table= "})
    expect_error(std::string(option) + "tetra.obj --quick --stress 0", 2,
                 std::string(option).substr(0, 6));
  EXPECT_EQ(contents(folder_ / "tetra.obj"), tetrahedron);
}

// A run that fails leaves older results as they were.
TEST_F(AccuracyCli, OlderResultsAreKeptUntilThereAreNewOnes) {
  const std::string page = "<!-- table: begin -->\nold\n<!-- table: end -->\n";
  write(folder_ / "page.md", page);
  write(folder_ / "out.json", "old");
  expect_error("missing.obj --quick --stress 0 --json out.json --table page.md", 2, "missing.obj");
  EXPECT_EQ(contents(folder_ / "page.md"), page);
  EXPECT_EQ(contents(folder_ / "out.json"), "old");
  std::filesystem::remove(folder_ / "stderr");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 3) << "and no others";
}

TEST_F(AccuracyCli, OutputThatIsLostIsAnError) {
  const Outcome outcome =
      run("tetra.obj --quick --stress 0 --measures e3 --brute-force 2000 >/dev/full");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err, "zkd-accuracy: error: cannot write to standard output\n");
}

TEST_F(AccuracyCli, ErrorsAloneAreMeasuredOnTheIntersectorsAlone) {
  const Json json = run_json(std::string(tiny) + " --measures e1,e4 --backend cpu");
  EXPECT_EQ(json["curves"], Json::array());
  EXPECT_EQ(json["e5"], nullptr);
  std::set<std::string> names;
  for (const Json& row : json["e1"]["rows"]) names.insert(row["name"].get<std::string>());
  for (const char* name : {"watertight", "fast", "single", "double", "exact"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
  EXPECT_FALSE(names.contains("literal"));
}

TEST_F(AccuracyCli, JsonHasEveryKeyOfTheSchema) {
  const Json json = run_json(tiny);
  expect_keys(json, {"schema", "zkd", "commit", "machine", "seed", "scenes", "e1", "e2", "e3", "e4",
                     "e5", "e6", "e7", "oracle", "curves", "failures"});
  EXPECT_EQ(json["schema"], 1);
  EXPECT_EQ(json["seed"], 1);
  EXPECT_EQ(json["failures"], Json::array());

  expect_keys(json["e1"], {"rays", "missed", "phantom", "in_band", "rows"});
  EXPECT_GT(json["e1"]["rays"], 4 * 64);
  EXPECT_EQ(json["e1"]["missed"], 0);
  EXPECT_EQ(json["e1"]["phantom"], 0);
  for (const Json& row : json["e1"]["rows"]) {
    expect_keys(row, {"name", "rays_kind", "rays", "missed", "phantom", "classes"});
    std::uint64_t rays = 0;
    for (const char* name : {"interior", "edge", "vertex", "duplicate", "miss"}) {
      const Json& of_class = row["classes"][name];
      rays += of_class["rays"].get<std::uint64_t>();
      if (of_class["rays"] != 0) expect_rate(of_class["missed"]);
    }
    EXPECT_EQ(rays, row["rays"]);
  }
  expect_keys(json["e2"], {"rays", "wrong_triangle", "in_band", "benign", "real", "rows"});
  EXPECT_EQ(json["e2"]["wrong_triangle"], 0);

  expect_keys(json["e3"], {"rays", "different", "cases", "loop", "rows"});
  EXPECT_GE(json["e3"]["rays"], 2 * 5000);  // through trees and through wide trees
  EXPECT_EQ(json["e3"]["different"], 0);
  EXPECT_GT(json["e3"]["loop"]["rays"], 0);
  expect_rate(json["e3"]["loop"]["different"]);
  std::set<std::string> met;
  for (const Json& row : json["e3"]["rows"]) {
    if (row["rays"] > 0) met.insert(row["name"].get<std::string>());
  }
  for (const char* name : {"watertight", "fast", "single", "double", "exact"}) {
    EXPECT_TRUE(met.contains(name)) << name;
    EXPECT_TRUE(met.contains(std::string("wide ") + name)) << name;
    // The first cases with `exact` are not of strict trees.
    EXPECT_TRUE(name == std::string("exact") || met.contains(std::string("planes ") + name))
        << name;
  }

  expect_keys(json["e4"], {"rays", "t_ulp", "rows"});
  EXPECT_GT(json["e4"]["rays"], 0);
  // Every hit in double, rounded once; some of them seen edge-on.
  EXPECT_LE(json["e4"]["t_ulp"]["p999"].get<double>(), 4.0);
  EXPECT_GT(json["e4"]["t_ulp"]["median"].get<double>(), 0.0);

  expect_keys(json["e5"], {"rays", "leaks", "double_hits", "meshes", "rows"});
  EXPECT_GE(json["e5"]["rays"], 4000);
  EXPECT_EQ(json["e5"]["leaks"], 0);
  for (const char* target : {"random", "edge", "vertex", "near_vertex"}) {
    expect_rate(json["e5"]["rows"][0]["targets"][target]["leaks"]);
  }
  const auto meshes = json["e5"]["meshes"].get<std::set<std::string>>();
  EXPECT_TRUE(meshes.contains("tetra"));  // it is closed

  ASSERT_EQ(json["e6"].size(), 6 * json["scenes"].size());
  for (const Json& tree : json["e6"]) {
    expect_keys(tree, {"scene", "tree", "sah", "sah_over_exact_sah", "node_visits_per_ray",
                       "triangle_tests_per_ray", "references_per_triangle", "tree_bytes", "depth",
                       "deepest_stack"});
    if (tree["tree"] == "exact SAH") {
      EXPECT_EQ(tree["sah_over_exact_sah"], 1.0);
    } else {
      EXPECT_GT(tree["sah_over_exact_sah"], 0.5);
    }
    EXPECT_LE(tree["deepest_stack"], tree["depth"]);
  }
  expect_keys(json["e7"], {"cases", "hashes_too_many", "builds", "backends"});
  EXPECT_EQ(json["e7"]["cases"], 7 * (json["scenes"].size() + 3));
  EXPECT_EQ(json["e7"]["hashes_too_many"], 0);

  for (const Json& speed : json["oracle"]) {
    expect_keys(speed, {"scene", "rays_kind", "rays", "rays_per_s_per_core"});
  }
}

TEST_F(AccuracyCli, EverySettingIsAPointOfTheCurves) {
  const Json json = run_json("tetra.obj --quick --size 8 --stress 200 --measures curves");
  std::set<std::string> settings;
  bool literal_errs = false;
  for (const Json& point : json["curves"]) {
    expect_keys(point, {"scene", "setting", "family", "rays_kind", "rays", "ns_per_ray", "build_ms",
                        "trace_ms", "build_trace_ms", "error", "t_ulp", "pareto"});
    EXPECT_GT(point["ns_per_ray"].get<double>(), 0.0);
    EXPECT_GT(point["rays"], 0);
    const std::string setting = point["setting"];
    settings.insert(setting);
    if (setting.starts_with("embree-")) {
      EXPECT_TRUE(point["in_band"].is_null());
    }
    if (point["family"] == "literal") literal_errs = literal_errs || point["error"] > 0.0;
  }
  for (const char* wanted :
       {"watertight", "once", "all", "codes 32", "codes 64", "bits 5", "bits 21", "leaf 1",
        "leaf 32", "naive once", "padded once", "slab once", "naive all", "padded all", "slab all",
        "literal", "wide watertight", "wide exact", "wide balanced"}) {
    EXPECT_TRUE(settings.contains(wanted)) << wanted;
  }
  EXPECT_TRUE(literal_errs);  // triangles that straddle planes are lost, in some scene
  EXPECT_TRUE(json["e3"].is_null());
  EXPECT_TRUE(json["e5"].is_null());
}

TEST_F(AccuracyCli, SeedAndThreadsDecideTheRaysAndNothingElseDoes) {
  const std::string some = "tetra.obj --quick --size 8 --stress 100 --measures e1 --peers none";
  const Json one = run_json(some + " --threads 1");
  const Json three = run_json(some + " --threads 3");
  const Json other = run_json(some + " --seed 2");
  EXPECT_EQ(one["e1"], three["e1"]);
  EXPECT_EQ(one["e2"], three["e2"]);
  EXPECT_EQ(one["e4"], three["e4"]);
  EXPECT_NE(one["e4"], other["e4"]);
}

TEST_F(AccuracyCli, SummaryIsTheLastLine) {
  const Outcome outcome =
      run("tetra.obj --quick --stress 0 --measures e3 --brute-force 2000 --backend cpu");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const std::size_t last = outcome.out.rfind('\n', outcome.out.size() - 2);
  // Eight trees with 256 rays each, which their wide forms answer too, and the planes of four.
  EXPECT_EQ(outcome.out.substr(last + 1), "zkd-accuracy: ok, 1 scenes, 5120 rays of ours\n");
}

TEST_F(AccuracyCli, TableGoesBetweenTheMarkers) {
  const std::string some = "tetra.obj --quick --size 8 --stress 0 --measures curves --table ";
  write(folder_ / "page.md", "before\n<!-- table: begin -->\nold\n<!-- table: end -->\nafter\n");
  ASSERT_EQ(run(some + "page.md").status, 0);
  const std::string page = contents(folder_ / "page.md");
  EXPECT_TRUE(page.starts_with("before\n<!-- table: begin -->\n\n| scene |")) << page;
  EXPECT_TRUE(page.ends_with("|\n\n<!-- table: end -->\nafter\n")) << page;
  EXPECT_EQ(page.find("old"), std::string::npos);
  EXPECT_NE(page.find("| tetra | workload | literal |"), std::string::npos) << page;

  write(folder_ / "without.md", "no markers\n");
  expect_error(some + "without.md", 2, "without.md");
  EXPECT_EQ(run(some + "/dev/zero").status, 0) << "what never ends is not read";
  EXPECT_EQ(contents(folder_ / "without.md"), "no markers\n");
  ASSERT_EQ(run(some + "new.md").status, 0);
  EXPECT_TRUE(contents(folder_ / "new.md").starts_with("<!-- table: begin -->"));
}

TEST_F(AccuracyCli, PlotsAreSvgAndPng) {
  const Outcome outcome =
      run("tetra.obj --quick --size 8 --stress 0 --measures curves --plots plots");
  if (outcome.err.find("python3-matplotlib") != std::string::npos) {
    EXPECT_EQ(outcome.status, 2);
    GTEST_SKIP() << outcome.err;
  }
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const char* name : {"tetra-ray-error", "tetra-build-error", "tetra-build-trace-error",
                           "tetra-ray-t", "t-condition", "tetra-literal", "vertices"}) {
    EXPECT_TRUE(contents(folder_ / "plots" / (std::string(name) + ".png")).starts_with("\x89PNG"))
        << name;
    EXPECT_NE(contents(folder_ / "plots" / (std::string(name) + ".svg")).find("<svg"),
              std::string::npos)
        << name;
  }
}

}  // namespace
