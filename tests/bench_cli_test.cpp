// SPDX-License-Identifier: Apache-2.0
//
// zkd-bench from the outside: exit status, one-line errors, JSON, and silence where it is due.
// ZKD_BENCH_PATH is the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "support/program.hpp"

namespace {

using namespace zkd::test;
namespace fs = std::filesystem;
using Json = nlohmann::json;

class BenchCli : public ProgramTest {
 protected:
  BenchCli() : ProgramTest(ZKD_BENCH_PATH, "zkd-bench") {}

  // Whatever comes out: a wrong tree (status 1) is an answer too.
  bool cuda_answers() const {
    return run("tetra.obj --backend cuda" + std::string(quick)).status != 3;
  }

  bool can_check() const {
    return run("tetra.obj --backend cpu --check 1" + std::string(quick)).status == 0;
  }

  static constexpr const char* quick = " --size 32 --repeat 2 --threads 2";
};

void expect_spread(const Json& spread, std::size_t n) {
  expect_keys(spread, {"median", "min", "max", "n"});
  EXPECT_EQ(spread["n"], n);
  EXPECT_LE(spread["min"].get<double>(), spread["median"].get<double>());
  EXPECT_LE(spread["median"].get<double>(), spread["max"].get<double>());
}

TEST_F(BenchCli, HelpVersionAndListSucceed) {
  const Outcome help = run("--help");
  EXPECT_EQ(help.status, 0);
  for (const char* option :
       {"--backend",     "--threads",      "--references", "--budget",     "--builder",
        "--quality",     "--leaf-size",    "--code-bits",  "--axis-order", "--recode",
        "--invalid",     "--instructions", "--rays",       "--size",       "--repeat",
        "--peers",       "--check",        "--json",       "--images",     "--list",
        "--version",     "--seed",         "--cold",       "--time-limit", "--reference-capacity",
        "--intersector", "--stats"}) {
    EXPECT_NE(help.out.find(option), std::string::npos) << option;
  }
  const Outcome version = run("--version");
  EXPECT_EQ(version.status, 0);
  EXPECT_TRUE(version.out.starts_with("zkd-bench ")) << version.out;
  const Outcome list = run("--list");
  EXPECT_EQ(list.status, 0);
  EXPECT_NE(list.out.find("bunny"), std::string::npos);
  EXPECT_EQ(help.err + version.err + list.err, "");
}

TEST_F(BenchCli, BadUsageIsOneLineThatNamesTheOption) {
  expect_error("tetra.obj --no-such-option", 2, "--no-such-option");
  expect_error("tetra.obj --references twice", 2, "--references");
  expect_error("tetra.obj --references once,twice", 2, "twice");
  expect_error("tetra.obj --builder lego", 2, "--builder");
  expect_error("tetra.obj --quality low", 2, "--quality");
  expect_error("tetra.obj --rays purple", 2, "--rays");
  expect_error("tetra.obj --rays ''", 2, "--rays");
  expect_error("tetra.obj --peers optix", 2, "--peers");
  expect_error("tetra.obj --backend tpu", 2, "--backend");
  expect_error("tetra.obj --axis-order zyx", 2, "--axis-order");
  expect_error("tetra.obj --recode maybe", 2, "--recode");
  expect_error("tetra.obj --invalid keep", 2, "--invalid");
  expect_error("tetra.obj --instructions mmx", 2, "--instructions");
  expect_error("tetra.obj --intersector woop", 2, "--intersector");
  expect_error("tetra.obj --budget 0.5", 2, "--budget");
  expect_error("tetra.obj --budget nan", 2, "--budget");
  for (const char* option : {"--threads", "--leaf-size", "--code-bits", "--size", "--repeat",
                             "--check", "--seed", "--reference-capacity", "--time-limit"}) {
    expect_error(std::string("tetra.obj ") + option + " -1", 2, option);
    expect_error(std::string("tetra.obj ") + option + " 1.5", 2, option);
    expect_error(std::string("tetra.obj ") + option + " x", 2, option);
    expect_error(std::string("tetra.obj ") + option, 2, option);
  }
  expect_error("tetra.obj --leaf-size 1025", 2, "--leaf-size");
  expect_error("tetra.obj --code-bits 65", 2, "--code-bits");
  expect_error("tetra.obj --reference-capacity 2147483648", 2, "--reference-capacity");
  expect_error("--cold", 2, "--cold");
  expect_error("tetra.obj tetra.obj --cold", 2, "--cold");
}

TEST_F(BenchCli, BadInputIsOneLineThatNamesTheFile) {
  expect_error("missing.obj", 2, "missing.obj");
  expect_error("no-such-scene-name", 2, "no-such-scene-name");
  write(folder_ / "empty.obj", "v 0 0 0\n");
  expect_error("empty.obj", 2, "empty.obj");
  write(folder_ / "broken.obj", "v 0 0 0\nv 1 0 0\nv 0 1 zz\nf 1 2 3\n");
  expect_error("broken.obj", 2, "broken.obj:3");
  write(folder_ / "outside.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  expect_error("outside.obj", 2, "outside.obj:4");
  expect_error("tetra.obj --json missing-folder/out.json", 2, "--json");
  expect_error("tetra.obj --images tetra.obj/images", 2, "--images");
}

TEST_F(BenchCli, QualityHighIsTheSahBuilder) {
  const Json high = run_json("tetra.obj --quality high" + std::string(quick))["results"][0];
  const Json sah = run_json("tetra.obj --builder sah" + std::string(quick))["results"][0];
  EXPECT_EQ(high["options"]["builder"], "sah");
  EXPECT_EQ(high["options"]["quality"], "high");
  EXPECT_EQ(high["tree"]["hash"], sah["tree"]["hash"]);
}

TEST_F(BenchCli, Wu2011MakesTheTreeOfSah) {
  const Json results = run_json("tetra.obj --builder sah,wu2011" + std::string(quick))["results"];
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(results[1]["options"]["builder"], "wu2011");
  EXPECT_EQ(results[1]["options"]["references"], "all");
  EXPECT_EQ(results[1]["tree"]["hash"], results[0]["tree"]["hash"]);
  EXPECT_EQ(results[1]["tree"]["sah"], results[0]["tree"]["sah"]);
}

// What --backend cuda says here, if no CUDA device answers.
TEST_F(BenchCli, CudaWithoutCudaIsADeviceFailure) {
  for (const char* arguments : {"tetra.obj --backend cuda", "tetra.obj --cold"}) {
    SCOPED_TRACE(arguments);
    const Outcome outcome = run(arguments + std::string(quick));
    if (outcome.status == 0) GTEST_SKIP() << "a CUDA device answers here";
    EXPECT_EQ(outcome.status, 3);
    EXPECT_EQ(lines_of(outcome.err), 1u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("zkd-bench: error: ")) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
}

TEST_F(BenchCli, AutoFallsBackToTheCpuAndSaysWhy) {
  if (cuda_answers()) GTEST_SKIP() << "a CUDA device answers here";
  const Outcome outcome = run("tetra.obj --backend auto" + std::string(quick));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const std::string first = outcome.out.substr(0, outcome.out.find('\n'));
  EXPECT_NE(first.find("backend cpu (chosen by auto: "), std::string::npos) << first;
  const Outcome asked = run("tetra.obj --backend cpu" + std::string(quick));
  EXPECT_EQ(asked.out.find("chosen by auto"), std::string::npos) << asked.out;
}

TEST_F(BenchCli, CudaResultsStandBesideTheCpusTree) {
  if (!cuda_answers()) GTEST_SKIP() << "no CUDA device answers here";
  const Json json = run_json("tetra.obj --backend cuda --references once,all" + std::string(quick));
  EXPECT_TRUE(json["machine"]["gpu"].is_string());
  EXPECT_TRUE(json["machine"]["driver"].is_string());
  const Json of_cpu =
      run_json("tetra.obj --backend cpu --references once,all" + std::string(quick));
  ASSERT_EQ(json["results"].size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const Json& result = json["results"][i];
    EXPECT_EQ(result["backend"], "cuda");
    EXPECT_EQ(result["tree"]["hash"], of_cpu["results"][i]["tree"]["hash"]);
    const Json& gpu = result["gpu"];
    expect_keys(gpu, {"hash_equal", "graph_replay_ms", "cold_ms", "h2d_ms", "hits_equal", "d2h_ms",
                      "build_allocating_ms"});
    EXPECT_EQ(gpu["hash_equal"], true);
    EXPECT_EQ(gpu["hits_equal"], true);
    for (const char* time : {"graph_replay_ms", "cold_ms", "h2d_ms", "d2h_ms"}) {
      EXPECT_GT(gpu[time].get<double>(), 0.0) << time;
    }
  }
}

// What has been measured is on disk before the next scene is begun.
TEST_F(BenchCli, ResultsAreKeptWhenALaterSceneFails) {
  write(folder_ / "broken.obj", "v 0 0 0\nf 1 2 9\n");
  const Outcome outcome = run("tetra.obj broken.obj --json out.json" + std::string(quick));
  EXPECT_EQ(outcome.status, 2);
  const Json json = Json::parse(contents(folder_ / "out.json"), nullptr, false);
  ASSERT_TRUE(json.is_object());
  ASSERT_EQ(json["results"].size(), 1u);
  EXPECT_EQ(json["results"][0]["scene"], "tetra");
}

// An option without a value must not take the scene for one and write over it.
TEST_F(BenchCli, NothingIsWrittenOverAScene) {
  expect_error("--json= tetra.obj", 2, "--json=");
  expect_error("--json tetra.obj tetra.obj", 2, "--json");
  EXPECT_EQ(contents(folder_ / "tetra.obj"), tetrahedron);
}

TEST_F(BenchCli, OlderResultsAreKeptUntilThereAreNewOnes) {
  write(folder_ / "broken.obj", "v 0 0 0\nf 1 2 9\n");
  write(folder_ / "out.json", "old");
  expect_error("broken.obj --json out.json", 2, "broken.obj");
  EXPECT_EQ(contents(folder_ / "out.json"), "old");
}

TEST_F(BenchCli, OutputThatIsLostIsAnError) {
  const Outcome outcome = run("--list >/dev/full");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err, "zkd-bench: error: cannot write to standard output\n");
}

// Every coordinate is a float, but a camera that has all of it in view is not.
TEST_F(BenchCli, SceneThatNoCameraSeesIsNamed) {
  write(folder_ / "huge.obj", "v -3e38 0 0\nv 3e38 0 0\nv 0 3e38 3e38\nf 1 2 3\n");
  expect_error("huge.obj" + std::string(quick), 2, "huge.obj: no camera");
}

TEST_F(BenchCli, TimeLimitLeavesOutScenesAndSaysWhich) {
  write(folder_ / "second.obj", tetrahedron);
  const Outcome outcome =
      run("tetra.obj second.obj --time-limit 1 --size 32 --repeat 100 --threads 2");
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.err, "zkd-bench: note: second is left out: --time-limit is reached\n");
  EXPECT_NE(outcome.out.find("tetra"), std::string::npos);
}

TEST_F(BenchCli, TableFitsAHundredColumnsAndStderrIsQuiet) {
  if (!can_check()) GTEST_SKIP() << "built without GMP";
  const Outcome outcome = run("tetra.obj --references once,all --check 500" + std::string(quick));
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("tetra all"), std::string::npos) << outcome.out;
  std::istringstream lines(outcome.out);
  std::string line;
  std::getline(lines, line);  // names the processor, however long that is
  EXPECT_TRUE(line.starts_with("zkd-bench ")) << line;
  while (std::getline(lines, line)) EXPECT_LE(line.size(), 100u) << line;
}

TEST_F(BenchCli, JsonHasEveryKeyOfTheSchema) {
  if (!can_check()) GTEST_SKIP() << "built without GMP";
  const Json json =
      run_json("tetra.obj --backend cpu --references once,all --check 500" + std::string(quick));
  expect_keys(json, {"schema", "zkd", "commit", "machine", "results"});
  EXPECT_EQ(json["schema"], 1);
  expect_keys(json["machine"], {"cpu", "threads", "gpu", "driver", "compiler"});
  EXPECT_EQ(json["machine"]["threads"], 2);
  ASSERT_EQ(json["results"].size(), 2u);
  EXPECT_EQ(json["results"][0]["options"]["references"], "once");
  EXPECT_EQ(json["results"][1]["options"]["references"], "all");
  for (const Json& result : json["results"]) {
    expect_keys(result, {"scene", "triangles", "stand_in", "skipped_triangles", "backend",
                         "threads", "options", "preempted_per_s", "build_ms", "stages_ms",
                         "allocated_bytes", "tree", "trace", "check", "skipped", "peers"});
    EXPECT_EQ(result["scene"], "tetra");
    EXPECT_EQ(result["triangles"], 4);
    EXPECT_EQ(result["stand_in"], false);
    EXPECT_EQ(result["skipped_triangles"], 0);
    EXPECT_EQ(result["backend"], "cpu");
    EXPECT_FALSE(result.contains("gpu"));
    EXPECT_EQ(result["threads"], 2);
    expect_keys(
        result["options"],
        {"builder", "quality", "references", "budget", "leaf_size", "code_bits", "axis_order",
         "recode", "invalid", "reference_capacity", "sah_areas", "sah_visit_cost", "sah_test_cost",
         "sah_empty_bonus", "instructions", "intersector", "layout", "seed"});
    expect_spread(result["build_ms"], 2);
    expect_keys(result["stages_ms"], {"validate", "encode", "sort", "references", "tight_boxes"});
    expect_keys(result["allocated_bytes"], {"tree", "workspace", "asked_beforehand"});
    EXPECT_LE(result["allocated_bytes"]["tree"].get<std::uint64_t>() +
                  result["allocated_bytes"]["workspace"].get<std::uint64_t>(),
              result["allocated_bytes"]["asked_beforehand"].get<std::uint64_t>());
    expect_keys(result["tree"], {"nodes", "leaves", "references", "depth", "sah", "hash"});
    EXPECT_EQ(result["tree"]["hash"].get<std::string>().size(), 32u);
    expect_keys(result["trace"], {"primary", "diffuse", "shadow"});
    for (const char* kind : {"primary", "diffuse", "shadow"}) {
      const Json& trace = result["trace"][kind];
      expect_keys(trace, {"rays", "hits", "ms", "mrays_per_s", "node_visits_per_ray",
                          "triangle_tests_per_ray"});
      expect_spread(trace["ms"], 2);
    }
    EXPECT_EQ(result["trace"]["primary"]["rays"], 32 * 32);
    EXPECT_EQ(result["trace"]["diffuse"]["rays"], result["trace"]["primary"]["hits"]);
    EXPECT_EQ(result["trace"]["shadow"]["rays"], result["trace"]["primary"]["hits"]);
    // A tetrahedron is convex: nothing bounces back onto it.
    EXPECT_EQ(result["trace"]["diffuse"]["hits"], 0);
    expect_keys(result["check"],
                {"rays", "missed", "phantom", "wrong_triangle", "in_band", "t_ulp_p999", "leaks"});
    expect_keys(result["check"]["in_band"], {"missed", "phantom", "wrong_triangle"});
    EXPECT_EQ(result["check"]["rays"], 3 * 500);
    EXPECT_EQ(result["check"]["missed"], 0);
    EXPECT_EQ(result["check"]["phantom"], 0);
    EXPECT_EQ(result["check"]["wrong_triangle"], 0);
    EXPECT_EQ(result["check"]["leaks"], 0);
    EXPECT_TRUE(result["peers"].empty());
    for (const Json& skipped : result["skipped"]) {
      expect_keys(skipped, {"what", "why", "saved_ms"});
      EXPECT_FALSE(skipped["why"].get<std::string>().empty());
    }
    for (const Json& not_skipped : result["not_skipped"]) expect_keys(not_skipped, {"what", "why"});
    const bool strict = result["options"]["references"] == "all";
    EXPECT_EQ(result["skipped"].size() + result["not_skipped"].size(), strict ? 7u : 5u);
    ASSERT_EQ(result["stages_bytes"].size(), result["stages_ms"].size());
    for (const auto& [stage, bytes] : result["stages_bytes"].items()) {
      if (stage == "split" || stage == "clusters") {
        EXPECT_TRUE(bytes.is_null()) << stage << " was not asked for";
      } else {
        EXPECT_GT(bytes.get<std::uint64_t>(), 0u) << stage;
      }
    }
  }
}

TEST_F(BenchCli, RaysNotAskedForAreNull) {
  if (!can_check()) GTEST_SKIP() << "built without GMP";
  const Json json = run_json("tetra.obj --rays diffuse --check 100" + std::string(quick));
  const Json& trace = json["results"][0]["trace"];
  EXPECT_TRUE(trace["primary"].is_null());
  EXPECT_TRUE(trace["shadow"].is_null());
  EXPECT_GT(trace["diffuse"]["rays"], 0);
  EXPECT_EQ(json["results"][0]["check"]["rays"], 100);
}

TEST_F(BenchCli, OpenMeshHasNoLeaksToCount) {
  if (!can_check()) GTEST_SKIP() << "built without GMP";
  write(folder_ / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const Json json = run_json("open.obj --check 100" + std::string(quick));
  EXPECT_TRUE(json["results"][0]["check"]["leaks"].is_null());
}

TEST_F(BenchCli, EveryBuildOptionIsPassedOnAndRecorded) {
  const Json json = run_json(
      "tetra.obj --leaf-size 2 --code-bits 24 --axis-order cyclic"
      " --recode off --invalid skip --instructions portable --budget 1.5 --intersector single" +
      std::string(quick));
  const Json& options = json["results"][0]["options"];
  EXPECT_EQ(options["leaf_size"], 2);
  EXPECT_EQ(options["axis_order"], "cyclic");
  EXPECT_EQ(options["recode"], false);
  EXPECT_EQ(options["invalid"], "skip");
  EXPECT_EQ(options["instructions"], "portable");
  EXPECT_EQ(options["budget"], 1.5);
  EXPECT_EQ(options["intersector"], "single");
  EXPECT_LE(options["code_bits"], 24);
}

TEST_F(BenchCli, LayoutsAreMeasuredSideBySide) {
  const Json json = run_json("tetra.obj --backend cpu --layout binary,wide" + std::string(quick));
  ASSERT_EQ(json["results"].size(), 2u);
  EXPECT_EQ(json["results"][0]["options"]["layout"], "binary");
  EXPECT_EQ(json["results"][1]["options"]["layout"], "wide");
  EXPECT_EQ(json["results"][0]["trace"]["primary"]["hits"],
            json["results"][1]["trace"]["primary"]["hits"]);
  EXPECT_NE(json["results"][0]["allocated_bytes"]["tree"],
            json["results"][1]["allocated_bytes"]["tree"]);
}

TEST_F(BenchCli, PlanesAloneAreALayoutOfStrictTrees) {
  const Json json = run_json(
      "tetra.obj --backend cpu --layout binary,planes --references once,all" + std::string(quick));
  ASSERT_EQ(json["results"].size(), 3u);
  EXPECT_EQ(json["results"][2]["label"], "all planes");
  EXPECT_EQ(json["results"][2]["trace"]["primary"]["hits"],
            json["results"][1]["trace"]["primary"]["hits"]);
  EXPECT_NE(json["results"][2]["allocated_bytes"]["tree"],
            json["results"][1]["allocated_bytes"]["tree"]);
  const Outcome none = run("tetra.obj --layout planes --references once" + std::string(quick));
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("planes for --references all"), std::string::npos) << none.err;
}

TEST_F(BenchCli, ThePosterTakenAtItsWordIsALayout) {
  const Json json = run_json(
      "tetra.obj --backend cpu --layout binary,literal --references all,once" + std::string(quick));
  ASSERT_EQ(json["results"].size(), 3u);  // of `once` only
  EXPECT_EQ(json["results"][2]["label"], "once literal");
  EXPECT_EQ(json["results"][2]["options"]["layout"], "literal");
  EXPECT_GT(json["results"][2]["trace"]["primary"]["hits"], 0);
  EXPECT_GT(json["results"][2]["tree"]["sah"], 0.0);
  const Outcome none = run("tetra.obj --layout literal --references all" + std::string(quick));
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("--references once"), std::string::npos) << none.err;
  const Outcome other = run("tetra.obj --layout literal --intersector fast" + std::string(quick));
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("--intersector watertight"), std::string::npos) << other.err;
}

TEST_F(BenchCli, AnswersAreJudgedByTheBandOfTheirIntersector) {
  if (!can_check()) GTEST_SKIP() << "built without GMP";
  for (const char* name : {"watertight", "fast", "single", "double", "exact"}) {
    const Json json = run_json("tetra.obj --check 500 --intersector " + std::string(name) + quick);
    const Json& check = json["results"][0]["check"];
    EXPECT_EQ(check["missed"], 0) << name;
    EXPECT_EQ(check["phantom"], 0) << name;
    EXPECT_EQ(check["wrong_triangle"], 0) << name;
    if (std::string(name) == "exact") {
      EXPECT_EQ(check["in_band"]["wrong_triangle"], 0);
    }
  }
}

TEST_F(BenchCli, StatsAreShownOnRequest) {
  const Outcome shown = run("tetra.obj --stats" + std::string(quick));
  EXPECT_NE(shown.out.find("Tree of tetra"), std::string::npos);
  EXPECT_NE(shown.out.find("triangles in a leaf"), std::string::npos);
  EXPECT_NE(shown.out.find("MB held"), std::string::npos);
  EXPECT_NE(shown.out.find("few triangles: short codes tell them apart"), std::string::npos);
  const Json tree = run_json("tetra.obj --stats" + std::string(quick))["results"][0]["tree"];
  expect_keys(tree["statistics"], {"nodes", "leaves", "empty_leaves", "references", "mean_depth",
                                   "expected_node_visits", "leaves_at_depth", "leaves_of_size"});
  EXPECT_EQ(tree["statistics"]["leaves"], tree["leaves"]);
  EXPECT_EQ(tree["statistics"]["sah_cost"], tree["sah"]);
  EXPECT_FALSE(
      run_json("tetra.obj" + std::string(quick))["results"][0]["tree"].contains("statistics"));
}

TEST_F(BenchCli, SameTreeAndSameRaysOnAnyNumberOfThreads) {
  const Json one = run_json("tetra.obj --size 32 --repeat 1 --threads 1");
  const Json three = run_json("tetra.obj --size 32 --repeat 1 --threads 3");
  EXPECT_EQ(one["results"][0]["tree"]["hash"], three["results"][0]["tree"]["hash"]);
  for (const char* kind : {"primary", "diffuse", "shadow"}) {
    EXPECT_EQ(one["results"][0]["trace"][kind]["hits"], three["results"][0]["trace"][kind]["hits"]);
  }
}

TEST_F(BenchCli, WorksFromAnyFolderAndWritesWhereAsked) {
  fs::create_directory(folder_ / "elsewhere");
  const Outcome no_images = run("tetra.obj --images images" + std::string(quick));
  if (no_images.err.find("without OpenImageIO") != std::string::npos) {
    EXPECT_EQ(no_images.status, 2);
    GTEST_SKIP() << no_images.err;
  }
  const Outcome outcome =
      run("'" + (folder_ / "tetra.obj").string() + "' --json '" +
              (folder_ / "elsewhere/out.json").string() + "' --images elsewhere/images" + quick,
          "cd / && cd \"$OLDPWD\" &&");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("tetra"), std::string::npos);
  const Json json = Json::parse(contents(folder_ / "elsewhere/out.json"), nullptr, false);
  EXPECT_EQ(json["results"].size(), 1u);
  for (const char* image : {"tetra-shaded.png", "tetra-depth.png", "tetra-visits.png"}) {
    const std::string png = contents(folder_ / "elsewhere/images" / image);
    EXPECT_TRUE(png.starts_with("\x89PNG")) << image;
  }
}

TEST_F(BenchCli, EmbreeIsTimedOnTheSameRays) {
  const Outcome outcome = run("tetra.obj --peers embree --json -" + std::string(quick));
  if (outcome.status == 2 && outcome.err.find("without Embree") != std::string::npos) {
    GTEST_SKIP() << outcome.err;
  }
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const Json json = Json::parse(outcome.out, nullptr, false);
  const Json& result = json["results"][0];
  std::vector<std::string> settings;
  for (const Json& peer : result["peers"]) {
    const std::string name = peer["name"];
    EXPECT_TRUE(name.starts_with("embree-")) << name;
    settings.push_back(name.substr(name.find(' ') + 1));
    expect_spread(peer["build_ms"], 2);
    EXPECT_EQ(peer["trace"]["primary"]["rays"], 32 * 32);
    expect_spread(peer["trace"]["shadow"]["ms"], 2);
  }
  for (const char* wanted : {"low", "medium", "high", "low robust", "medium robust", "high robust",
                             "medium packet8", "high robust packet8"}) {
    EXPECT_NE(std::find(settings.begin(), settings.end(), wanted), settings.end()) << wanted;
  }
}

}  // namespace
