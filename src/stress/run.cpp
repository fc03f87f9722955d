// SPDX-License-Identifier: Apache-2.0
#include "stress/run.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include <zkd/build.hpp>
#include <zkd/cpu/plane_tree.hpp>
#include <zkd/cpu/wide_tree.hpp>
#include <zkd/query.hpp>

#include "scene/generate.hpp"
#include "stress/hits_in_order.hpp"
#include "stress/intersectors.hpp"
#include "verify/check.hpp"
#include "verify/counting_resource.hpp"
#include "verify/hits.hpp"
#include "verify/oracle.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::stress {
namespace {

using verify::CountingResource;
using verify::is_hit;
using verify::print;
using verify::same_bits;

// Work that grows with triangles times rays, and what is done once a triangle many times over, is
// bounded by these.
constexpr std::uint64_t most_oracle_tests = 40'000'000;
constexpr std::uint64_t most_brute_force_tests(Size size) {
  return size == Size::small ? 5'000'000 : 50'000'000;
}
constexpr std::size_t many_triangles = 100'000;

double ms_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

std::string describe(const BuildOptions& options) {
  return std::string(to_string(options.references)) + ", leaf size " +
         std::to_string(options.leaf_size) + ", " +
         (options.code_bits == 0 ? std::string("auto") : std::to_string(options.code_bits)) +
         " bits" + (options.axis_order == AxisOrder::cyclic ? ", cyclic" : "") +
         (options.recode_crowded ? "" : ", no recoding");
}

// ---- Trees --------------------------------------------------------------------------------------

// A tree and the memory that it was made in.
struct Built {
  std::unique_ptr<CountingResource> memory;
  Tree tree;
};

Built build_counted(const TriangleView& triangles, const BuildOptions& options, int threads,
                    Findings& findings) {
  Built built{std::make_unique<CountingResource>(), {}};
  const cpu::Executor executor{.threads = threads, .memory = built.memory.get()};
  built.tree = build(executor, triangles, options);
  const Statistics& s = built.tree.statistics();
  const MemoryRequirement need =
      memory_requirement(executor, triangles.triangle_count, options, s.references);
  findings.expect(built.memory->peak_bytes() <= need.tree_bytes + need.workspace_bytes,
                  "a build took " + std::to_string(built.memory->peak_bytes()) + " bytes, and " +
                      std::to_string(need.tree_bytes + need.workspace_bytes) +
                      " were said to be the most");
  findings.expect(built.memory->live_bytes() == s.tree_bytes, "a build kept more than the tree");
  return built;
}

void check_permuted(const scene::Mesh& mesh, const BuildOptions& options, std::uint64_t seed,
                    const Tree& tree, Findings& findings) {
  const std::string want = verify::tree_hash_mapped(tree.view(), {});
  std::vector<std::uint32_t> permutation;
  const scene::Mesh shuffled = scene::shuffled(mesh, seed, &permutation);
  findings.expect(
      verify::tree_hash_mapped(build(shuffled.view(), options).view(), permutation) == want,
      "another tree for shuffled triangles");
  scene::Mesh reversed = mesh;
  std::reverse(reversed.faces.begin(), reversed.faces.end());
  std::iota(permutation.rbegin(), permutation.rend(), 0u);
  findings.expect(
      verify::tree_hash_mapped(build(reversed.view(), options).view(), permutation) == want,
      "another tree for reversed triangles");
}

Built make_tree(const Case& which, const BuildOptions& options, const Setting& setting,
                Findings& findings) {
  findings.about(which.name + ", " + describe(options));
  const TriangleView triangles = which.mesh.view();
  std::vector<std::string> hashes;
  Built built;
  for (int threads = 1; threads <= 3; ++threads) {
    built.tree = {};  // before its memory
    built = build_counted(triangles, options, threads, findings);
    hashes.push_back(verify::tree_hash(built.tree.view()));
  }
  findings.expect(std::count(hashes.begin(), hashes.end(), hashes[0]) == 3,
                  "another tree with 2 or 3 threads than with 1");
  for (const std::string& violation : verify::check_tree(built.tree, triangles)) {
    findings.fail(violation);
  }
  const bool permute = setting.size == Size::small || which.mesh.faces.size() < many_triangles;
  if (permute) check_permuted(which.mesh, options, setting.seed, built.tree, findings);
  return built;
}

// ---- Rays ---------------------------------------------------------------------------------------

// Every so many rays, so that at most `most` are left.
std::vector<std::size_t> sample(std::size_t rays, std::uint64_t most) {
  const std::size_t stride = (rays + most - 1) / std::max<std::uint64_t>(most, 1);
  std::vector<std::size_t> chosen;
  // Odd: kinds of rays come in turn, often an even number of them, and all should be met.
  for (std::size_t i = 0; i < rays; i += stride | 1u) chosen.push_back(i);
  return chosen;
}

template <class Value>
std::vector<Value> at(std::span<const Value> values, const std::vector<std::size_t>& places) {
  std::vector<Value> chosen;
  chosen.reserve(places.size());
  for (const std::size_t i : places) chosen.push_back(values[i]);
  return chosen;
}

void compare(std::span<const Hit> got, std::span<const Hit> want, std::span<const Ray> rays,
             const char* how, Findings& findings) {
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (same_bits(got[i], want[i])) continue;
    ++findings.different;
    findings.fail(std::string(how) + ": " + print(got[i]) + " instead of " + print(want[i]) +
                  ", ray " + print(rays[i]));
  }
}

void compare_any(std::span<const std::uint8_t> occluded, std::span<const Hit> hits,
                 std::span<const Ray> rays, Findings& findings) {
  for (std::size_t i = 0; i < rays.size(); ++i) {
    findings.expect((occluded[i] != 0) == is_hit(hits[i]),
                    "any hit and closest hit disagree: ray " + print(rays[i]));
  }
}

void check_brute_force(const Case& which, const Tree& tree, std::span<const Ray> rays,
                       std::span<const Hit> hits, const cpu::Executor& executor, Size size,
                       Findings& findings) {
  const std::uint64_t most =
      most_brute_force_tests(size) / std::max<std::uint64_t>(which.mesh.faces.size(), 1);
  const std::vector<std::size_t> places = sample(rays.size(), most);
  const std::vector<Ray> some = at(rays, places);
  std::vector<Hit> want(some.size());
  closest_hit_brute_force(executor, tree.view(), which.mesh.view(), some, want);
  const std::vector<Hit> answers = at(hits, places);
  compare(answers, want, some, "not brute force's", findings);
  const std::span<const Ray> fewer = std::span(some).first((some.size() + 2) / 3);
  check_rounding_intersectors(which, tree, fewer, answers, executor, findings);
}

// The other forms of a tree have its answers.
void check_forms(const Tree& tree, const TriangleView& triangles, std::span<const Ray> rays,
                 std::span<const Hit> hits, const cpu::Executor& executor, Findings& findings) {
  std::vector<Hit> others(rays.size());
  std::vector<std::uint8_t> occluded(rays.size());
  {
    const cpu::WideTree wide = cpu::widen(executor, tree.view(), triangles);
    cpu::closest_hit(executor, wide.view(), rays, others);
    compare(others, hits, rays, "another answer through the wide tree", findings);
    cpu::any_hit(executor, wide.view(), rays, occluded);
    compare_any(occluded, hits, rays, findings);
  }
  if (tree.options().references != References::all) return;
  const cpu::PlaneTree planes = cpu::strip_boxes(executor, tree);
  cpu::closest_hit(executor, planes.view(), triangles, rays, others);
  compare(others, hits, rays, "another answer through the planes alone", findings);
  cpu::any_hit(executor, planes.view(), triangles, rays, occluded);
  compare_any(occluded, hits, rays, findings);
}

void check_oracle(const Case& which, const Tree& tree, std::span<const Ray> rays,
                  std::span<const Hit> hits, const cpu::Executor& executor, Findings& findings) {
  const std::uint64_t triangles = std::max<std::size_t>(which.mesh.faces.size(), 1);
  const bool many = triangles * rays.size() > most_oracle_tests;
  const verify::Oracle oracle(which.mesh.view(), many ? verify::Oracle::Search::box_tree
                                                      : verify::Oracle::Search::automatic);
  const std::uint64_t most = which.oracle_rays == 0 ? rays.size() : which.oracle_rays;
  const std::vector<std::size_t> places = sample(rays.size(), most);
  const std::vector<Ray> some = at(rays, places);
  const std::vector<Hit> answers = at(hits, places);
  const verify::Summary summary =
      verify::check(oracle, which.mesh.view(), some, answers, executor.threads);
  findings.outside.missed += summary.missed - summary.in_band.missed;
  findings.outside.phantom += summary.phantom - summary.in_band.phantom;
  findings.outside.wrong_triangle += summary.wrong_triangle - summary.in_band.wrong_triangle;
  findings.in_band += summary.in_band.total();
  for (const std::uint64_t i : summary.first_offenders) {
    const verify::Verdict verdict = verify::judge(oracle, which.mesh.view(), some[i], answers[i]);
    findings.fail(std::string("oracle: ") + verify::to_string(verdict.kind) + ", " +
                  print(answers[i]) + ", ray " + print(some[i]));
  }
  check_exact_intersector(which, tree, oracle, some, executor, findings);
}

void check_hits(const Case& which, std::span<const Ray> rays, std::span<const Hit> hits,
                Findings& findings) {
  if (which.hits == Case::Hits::some) return;
  const bool want = which.hits == Case::Hits::all;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    findings.expect(
        is_hit(hits[i]) == want,
        (want ? "a leak: ray " : "a hit where there is none: " + print(hits[i]) + ", ray ") +
            print(rays[i]));
  }
}

// ---- Time and memory ----------------------------------------------------------------------------

// What is timed of one scene.
struct Timed {
  TriangleView triangles;
  std::span<const Ray> rays;
  Tree tree;
  Expense least{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                0};

  void build_once(const cpu::Executor& executor, const BuildOptions& options) {
    tree = {};
    least.build_ms =
        std::min(least.build_ms, ms_of([&] { tree = build(executor, triangles, options); }));
    least.bytes = tree.statistics().tree_bytes + tree.statistics().workspace_bytes;
  }
  void trace_once(const cpu::Executor& executor) {
    std::vector<Hit> hits(rays.size());
    least.trace_ms = std::min(
        least.trace_ms, ms_of([&] { closest_hit(executor, tree.view(), triangles, rays, hits); }));
  }
};

// Both in turn, so that what else the machine does falls on both; the least of a few times each,
// of fewer where one is long enough to be steady.
void measure(Timed& scene, Timed& even, const cpu::Executor& executor,
             const BuildOptions& options) {
  constexpr int repetitions = 7;
  constexpr double enough_ms = 500.0;
  double ms = 0.0;
  for (int i = 0; i < repetitions && ms < enough_ms; ++i) {
    ms += ms_of([&] {
      scene.build_once(executor, options);
      even.build_once(executor, options);
    });
  }
  ms = 0.0;
  for (int i = 0; i < repetitions && ms < enough_ms; ++i) {
    ms += ms_of([&] {
      scene.trace_once(executor);
      even.trace_once(executor);
    });
  }
}

RaySource random_rays_source() {
  return [](const scene::Mesh&, const TreeView& tree, std::uint32_t count, std::uint64_t seed) {
    return scene::random_rays(tree.bounds(), count, seed);
  };
}

void check_expense(const Case& which, const Tree& tree, std::span<const Ray> rays,
                   const Setting& setting, Findings& findings) {
  if (which.mesh.faces.empty() || rays.empty()) return;
  const cpu::Executor executor{.threads = setting.threads};
  const BuildOptions& options = which.options[0];
  const auto count = static_cast<std::uint32_t>(rays.size());
  std::vector<Ray> timed(rays.begin(), rays.end());
  if (which.timed_rays) timed = which.timed_rays(which.mesh, tree.view(), count, setting.seed);

  const auto triangles = static_cast<std::uint32_t>(which.mesh.faces.size());
  const scene::Mesh even = scene::soup(triangles, setting.seed);
  const Tree even_tree = build(executor, even.view(), options);
  const RaySource even_source =
      which.timed_even_rays ? which.timed_even_rays : random_rays_source();
  const std::vector<Ray> even_rays = even_source(even, even_tree.view(), count, setting.seed);

  Timed of_case{which.mesh.view(), timed, {}};
  Timed of_even{even.view(), even_rays, {}};
  measure(of_case, of_even, executor, options);
  const Expense& spent = of_case.least;
  const Expense& spent_even = of_even.least;
  findings.spent += spent;
  findings.spent_even += spent_even;
  const auto limit = [&](double ms, double even_ms, double factor, const char* what) {
    findings.expect(factor == 0.0 || ms <= factor * even_ms,
                    std::string(what) + " takes " + std::to_string(ms) + " ms, an even scene " +
                        std::to_string(even_ms) + ": more than " + std::to_string(factor) +
                        " times as long");
  };
  limit(spent.build_ms, spent_even.build_ms, which.build_limit, "the build");
  limit(spent.trace_ms, spent_even.trace_ms, which.trace_limit, "tracing");
}

void run_traced(const Case& which, const Setting& setting, Findings& findings) {
  std::vector<Built> built;
  std::vector<const Tree*> trees;
  std::vector<Ray> rays;
  built.reserve(which.options.size());
  for (const BuildOptions& options : which.options) {
    built.push_back(make_tree(which, options, setting, findings));
    trees.push_back(&built.back().tree);
    if (!which.rays) continue;
    const auto share = static_cast<std::uint32_t>(which.ray_count / which.options.size());
    const std::vector<Ray> more =
        which.rays(which.mesh, trees.back()->view(), share, setting.seed + built.size());
    rays.insert(rays.end(), more.begin(), more.end());
  }
  findings.rays += rays.size();

  const cpu::Executor executor{.threads = setting.threads};
  const TriangleView triangles = which.mesh.view();
  std::vector<Hit> hits(rays.size());
  std::vector<TraversalCost> costs(rays.size());
  for (std::size_t i = 0; i < trees.size(); ++i) {
    findings.about(which.name + ", " + describe(which.options[i]));
    const TreeView& tree = trees[i]->view();
    std::vector<std::uint8_t> occluded(rays.size());
    any_hit(executor, tree, triangles, rays, occluded);
    if (i == 0) {
      closest_hit(executor, tree, triangles, rays, hits, costs);
    } else {
      std::vector<Hit> others(rays.size());
      closest_hit(executor, tree, triangles, rays, others);
      compare(others, hits, rays, "another answer than through the first tree", findings);
    }
    compare_any(occluded, hits, rays, findings);
    check_forms(*trees[i], triangles, rays, hits, executor, findings);
  }
  findings.about(which.name);
  if (!rays.empty()) {
    check_brute_force(which, *trees[0], rays, hits, executor, setting.size, findings);
    check_hits_in_order(which, trees, rays, hits, executor, findings);
    check_oracle(which, *trees[0], rays, hits, executor, findings);
    check_hits(which, rays, hits, findings);
    check_expense(which, *trees[0], rays, setting, findings);
  }
  if (which.also) which.also({which, trees, rays, hits, costs, setting.threads}, findings);
}

}  // namespace

void run_case(const Case& which, const Setting& setting, Findings& findings) {
  ++findings.cases;
  findings.about(which.name);
  if (which.own) {
    which.own(setting, findings);
  } else {
    run_traced(which, setting, findings);
  }
  findings.about("");
}

Report run_row(const Row& row, const Setting& setting,
               const std::function<void(const std::string&)>& begins) {
  Report report{row.number, row.name, {}, 0.0};
  report.ms = ms_of([&] {
    row.cases(setting, [&](const Case& which) {
      begins(which.name);
      try {
        run_case(which, setting, report.findings);
      } catch (const std::exception& error) {
        report.findings.fail(std::string("an exception: ") + error.what());
      }
    });
  });
  return report;
}

}  // namespace zkd::stress
