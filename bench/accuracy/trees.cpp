// SPDX-License-Identifier: Apache-2.0
//
// Trees measured, and trees compared by their hashes.
#include "trees.hpp"

#include <algorithm>
#include <set>

#include <zkd/build.hpp>
#include <zkd/query.hpp>

#include "scene/generate.hpp"
#include "scene/progress.hpp"
#include "support/meshes.hpp"
#include "support/tree_kinds.hpp"
#include "verify/tree_hash.hpp"
#include "walks.hpp"

namespace zkd::bench::accuracy {
namespace {

constexpr int permutations = 2;

BuildOptions options_with(References references) {
  BuildOptions options;
  options.references = references;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

class HashComparison {
 public:
  HashComparison(std::uint64_t seed, bool cuda) : seed_(seed), cuda_(cuda) {
    result_.backends = {"cpu"};
    if (cuda) result_.backends.push_back("cuda");
  }

  void compare(const std::string& name, const scene::Mesh& mesh, const BuildOptions& options) {
    std::set<std::string> hashes;
    std::set<std::string> mapped;
    for (const int threads : {1, 2, 3, 8}) {
      for (const auto instructions : {cpu::InstructionSet::portable, cpu::InstructionSet::avx2}) {
        cpu::Executor executor;
        executor.threads = threads;
        executor.instructions = instructions;
        const Tree tree = zkd::build(executor, mesh.view(), options);
        hashes.insert(verify::tree_hash(tree.view()));
        if (hashes.size() == 1) mapped.insert(verify::tree_hash_mapped(tree.view(), {}));
        ++result_.builds;
      }
    }
    add_cuda(mesh, options, hashes);
    for (int i = 0; i < permutations; ++i) {
      std::vector<std::uint32_t> permutation;
      const scene::Mesh shuffled =
          scene::shuffled(mesh, seed_ + static_cast<std::uint64_t>(i), &permutation);
      const Tree tree = zkd::build(cpu::Executor{}, shuffled.view(), options);
      // Face i of the shuffled mesh is face permutation[i]: its id becomes that.
      mapped.insert(verify::tree_hash_mapped(tree.view(), permutation));
      ++result_.builds;
    }
    ++result_.cases;
    const std::uint64_t too_many = hashes.size() - 1 + mapped.size() - 1;
    if (too_many > 0 && result_.first_offender.empty()) {
      result_.first_offender = name + ", references " + test::name_of(options);
    }
    result_.hashes_too_many += too_many;
  }

  [[nodiscard]] const Determinism& result() const { return result_; }

 private:
  void add_cuda(const scene::Mesh& mesh, BuildOptions options, std::set<std::string>& hashes) {
    if (!cuda_) return;
    options.backend = Backend::cuda;
    hashes.insert(verify::tree_hash(zkd::build(mesh.view(), options).view()));
    ++result_.builds;
  }

  std::uint64_t seed_;
  bool cuda_;
  Determinism result_;
};

TreeQuality quality_of(const std::string& name, BuildOptions options, const TestScene& scene,
                       const std::vector<RaySet>& sets, const cpu::Executor& executor) {
  const TriangleView triangles = scene.mesh.view();
  options.measure_quality = true;
  const Tree tree = zkd::build(executor, triangles, options);
  TreeQuality quality;
  quality.scene = scene.name;
  quality.tree = name;
  quality.triangles = triangles.triangle_count;
  quality.sah_cost = tree.statistics().sah_cost;
  quality.references_per_triangle =
      static_cast<double>(tree.view().reference_count()) /
      static_cast<double>(std::max<std::size_t>(1, triangles.triangle_count));
  quality.tree_bytes = tree.statistics().tree_bytes;
  quality.depth = tree.statistics().depth;

  std::uint64_t rays = 0;
  std::uint64_t visits = 0;
  std::uint64_t tests = 0;
  for (const RaySet& set : sets) {
    if (set.group != "workload") continue;
    std::vector<Hit> hits(set.rays.size());
    std::vector<TraversalCost> costs(set.rays.size());
    zkd::closest_hit(executor, tree.view(), triangles, set.rays, hits, costs);
    for (const TraversalCost& cost : costs) {
      visits += cost.node_visits;
      tests += cost.triangle_tests;
    }
    rays += set.rays.size();
    quality.deepest_stack =
        std::max(quality.deepest_stack, deepest_stack(executor, tree.view(), triangles, set.rays));
  }
  if (rays > 0) {
    quality.node_visits_per_ray = static_cast<double>(visits) / static_cast<double>(rays);
    quality.triangle_tests_per_ray = static_cast<double>(tests) / static_cast<double>(rays);
  }
  return quality;
}

}  // namespace

std::vector<TreeQuality> measure_quality(const TestScene& scene, const std::vector<RaySet>& sets,
                                         const cpu::Executor& executor) {
  BuildOptions sah = options_with(References::all);
  sah.builder = Builder::sah;
  std::vector<TreeQuality> qualities;
  qualities.push_back(quality_of("exact SAH", sah, scene, sets, executor));
  for (const References references :
       {References::once, References::budget, References::automatic, References::all}) {
    qualities.push_back(
        quality_of(zkd::to_string(references), options_with(references), scene, sets, executor));
  }
  BuildOptions balanced = options_with(References::automatic);
  balanced.quality = Quality::balanced;
  qualities.push_back(quality_of("balanced", balanced, scene, sets, executor));
  const double exact = qualities.front().sah_cost;
  for (TreeQuality& quality : qualities) {
    quality.sah_over_exact = exact > 0.0 ? quality.sah_cost / exact : 0.0;
  }
  return qualities;
}

Determinism compare_hashes(const std::vector<TestScene>& scenes, std::uint64_t small_meshes,
                           std::uint64_t seed, bool cuda) {
  HashComparison comparison(seed, cuda);
  scene::Progress progress("hashes", small_meshes + scenes.size());
  const auto compare = [&](const std::string& name, const scene::Mesh& mesh) {
    for (const BuildOptions& options : test::tree_kinds()) comparison.compare(name, mesh, options);
    progress.advance(1);
  };
  for (const TestScene& scene : scenes) compare(scene.name, scene.mesh);
  for (std::uint64_t i = 0; i < small_meshes; ++i) {
    const test::NamedMesh named = test::small_mesh(static_cast<int>(i % test::small_mesh_kinds),
                                                   seed + i / test::small_mesh_kinds);
    compare(named.name, named.mesh);
  }
  return comparison.result();
}

}  // namespace zkd::bench::accuracy
