// SPDX-License-Identifier: Apache-2.0
//
// Rows 50 to 52: memory that is refused, too little memory, and work at the same time.
#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include <zkd/build.hpp>
#include <zkd/query.hpp>

#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "scene/hard_rays.hpp"
#include "stress/case.hpp"
#include "verify/counting_resource.hpp"
#include "verify/hits.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::stress {
namespace {

using scene::Mesh;
using verify::CountingResource;

std::vector<scene::NamedMesh> meshes(const Setting& setting) {
  std::vector<scene::NamedMesh> all;
  for (const int kind : {0, 2, 6, 8, 10, 12, 13, 14, 23, 28, 30, 31}) {
    all.push_back(scene::small_mesh(kind, setting.seed));
  }
  all.push_back({"nothing", {}});
  all.push_back({"large soup", scene::soup(setting.pick(20000u, 1000000u), setting.seed)});
  all.push_back(
      {"stadium", scene::small_in_large(setting.pick(5000u, 300000u), 1e6F, setting.seed)});
  return all;
}

void expect_nothing_kept(const CountingResource& memory, Findings& findings) {
  findings.expect(memory.live_bytes() == 0 && memory.live_blocks() == 0,
                  std::to_string(memory.live_bytes()) + " bytes are not given back");
  findings.expect(!memory.misused(), "memory is given back as another size or elsewhere");
}

// Whether a build in this memory comes to a tree; else one error says what was refused.
bool builds_in(CountingResource& memory, const Mesh& mesh, const BuildOptions& options, int threads,
               const std::string& want, Findings& findings) {
  bool built = false;
  try {
    const Tree tree = build({.threads = threads, .memory = &memory}, mesh.view(), options);
    findings.expect(verify::tree_hash(tree.view()) == want, "another tree in little memory");
    built = true;
  } catch (const Error& error) {
    findings.expect(error.code() == ErrorCode::out_of_memory, error.what());
    findings.expect(error.offender() > 0, "an error that does not say what was refused");
  }
  expect_nothing_kept(memory, findings);
  return built;
}

void each_mesh(const Setting& setting, const Yield& yield,
               void (*work)(const Mesh&, const BuildOptions&, const std::string&, const Setting&,
                            Findings&)) {
  for (scene::NamedMesh& mesh : meshes(setting)) {
    auto shared = std::make_shared<Mesh>(std::move(mesh.mesh));
    yield(own_case(mesh.name, [shared, work](const Setting& of, Findings& findings) {
      for (const BuildOptions& options : once_and_all()) {
        const Tree tree = build(shared->view(), options);
        work(*shared, options, verify::tree_hash(tree.view()), of, findings);
      }
    }));
  }
}

void refuse_every_allocation(const Mesh& mesh, const BuildOptions& options, const std::string& want,
                             const Setting&, Findings& findings) {
  for (const int threads : {1, 2, 3}) {
    for (std::size_t refused = 1;; ++refused) {
      CountingResource memory;
      memory.refuse_at = refused;
      const bool built = builds_in(memory, mesh, options, threads, want, findings);
      findings.expect(!built || memory.allocations() < refused, "a refusal went unnoticed");
      if (built || refused == 1000) break;
    }
  }
}

void give_part_of_the_memory(const Mesh& mesh, const BuildOptions& options, const std::string& want,
                             const Setting& setting, Findings& findings) {
  CountingResource whole;
  const cpu::Executor executor{.threads = setting.threads, .memory = &whole};
  std::uint64_t references = 0;
  {
    const Tree tree = build(executor, mesh.view(), options);
    references = tree.statistics().references;
  }
  const std::size_t taken = whole.peak_bytes();
  for (std::size_t tenths = 1; tenths <= 10; ++tenths) {
    CountingResource memory;
    memory.limit = tenths == 10 ? taken : taken / 10 * tenths;
    const bool built = builds_in(memory, mesh, options, setting.threads, want, findings);
    findings.expect(built == (memory.limit >= taken), "built in " + std::to_string(tenths) +
                                                          " tenths of the memory it takes, or not "
                                                          "in all of it");
  }
  const MemoryRequirement need =
      memory_requirement(executor, mesh.faces.size(), options, references);
  CountingResource promised;
  promised.limit = need.tree_bytes + need.workspace_bytes;
  findings.expect(builds_in(promised, mesh, options, setting.threads, want, findings),
                  "no tree in the memory that was said to be enough");
}

void refusals(const Setting& setting, const Yield& yield) {
  each_mesh(setting, yield, refuse_every_allocation);
}

void little_memory(const Setting& setting, const Yield& yield) {
  each_mesh(setting, yield, give_part_of_the_memory);
}

// ---- 52 -----------------------------------------------------------------------------------------

// What one thread does while others do the same to the same trees and triangles.
struct Shared {
  Mesh mesh;
  BuildOptions options;
  Tree tree;
  std::string hash;
  std::vector<Ray> rays;
  std::vector<Hit> hits;
};

bool all_as_before(const Shared& shared, int threads) {
  const cpu::Executor executor{.threads = threads};
  const Tree again = build(executor, shared.mesh.view(), shared.options);
  if (verify::tree_hash(again.view()) != shared.hash) return false;
  for (const Tree* tree : {&shared.tree, &again}) {
    std::vector<Hit> hits(shared.rays.size());
    std::vector<std::uint8_t> occluded(shared.rays.size());
    closest_hit(executor, tree->view(), shared.mesh.view(), shared.rays, hits);
    any_hit(executor, tree->view(), shared.mesh.view(), shared.rays, occluded);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (!verify::same_bits(hits[i], shared.hits[i])) return false;
      if ((occluded[i] != 0) != verify::is_hit(hits[i])) return false;
    }
  }
  return true;
}

void at_the_same_time(const Setting& setting, Findings& findings) {
  std::vector<Shared> all;
  for (const References references : {References::once, References::all}) {
    for (Mesh mesh : {scene::soup(setting.pick(5000u, 100000u), setting.seed),
                      scene::small_in_large(setting.pick(2000u, 50000u), 1e6F, setting.seed),
                      scene::sphere(setting.pick(4u, 6u))}) {
      Shared shared;
      shared.mesh = std::move(mesh);
      shared.options = with(references);
      shared.tree = build(cpu::Executor{.threads = 1}, shared.mesh.view(), shared.options);
      shared.hash = verify::tree_hash(shared.tree.view());
      shared.rays = scene::hard_rays(shared.mesh, shared.tree.view(), setting.pick(1000u, 20000u),
                                     setting.seed);
      shared.hits.resize(shared.rays.size());
      closest_hit(cpu::Executor{.threads = 1}, shared.tree.view(), shared.mesh.view(), shared.rays,
                  shared.hits);
      findings.rays += shared.rays.size();
      all.push_back(std::move(shared));
    }
  }
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int number = 0; number < 6; ++number) {
    threads.emplace_back([&, number] {
      for (int round = 0; round < setting.pick(3, 12); ++round) {
        const auto which = static_cast<std::size_t>(number / 2 + round) % all.size();
        if (!all_as_before(all[which], 1 + number % 3)) ++wrong;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  findings.expect(wrong == 0, std::to_string(wrong) +
                                  " of the builds and queries at the same time "
                                  "came to something else");
}

void concurrent(const Setting& setting, const Yield& yield) {
  for (int i = 0; i < setting.pick(1, 4); ++i) {
    yield(own_case("six threads, run " + std::to_string(i), at_the_same_time));
  }
}

}  // namespace

std::vector<Row> memory_rows() {
  return {{50, "every allocation fails once", refusals},
          {51, "0.1 to 1 x of the memory", little_memory},
          {52, "concurrent builds and queries", concurrent}};
}

}  // namespace zkd::stress
