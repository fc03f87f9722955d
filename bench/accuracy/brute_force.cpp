// SPDX-License-Identifier: Apache-2.0
//
// Cases by number: each thread makes, builds and traces whole cases of its own.
#include "brute_force.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>

#include <zkd/build.hpp>
#include <zkd/cpu/wide_tree.hpp>
#include <zkd/query.hpp>

#include "choices.hpp"
#include "cuda.hpp"
#include "scene/progress.hpp"
#include "scene/random.hpp"
#include "support/meshes.hpp"
#include "support/rays.hpp"

namespace zkd::bench::accuracy {
namespace {

constexpr std::uint32_t rays_a_case = 1024;

// The default gets half of the cases, the others what is left, `exact` few: it is slow. Neighbours,
// `once` and `all`, get the same one; each mesh meets every one in sixteen variations.
std::size_t intersector_of(std::uint64_t number) {
  constexpr std::size_t turn[] = {0, 1, 0, 2, 0, 3, 0, 1, 0, 2, 0, 3, 0, 1, 0, 4};
  return turn[(number / 2 + number / (2 * test::small_mesh_kinds)) % 16];
}

bool same_bits(const Hit& a, const Hit& b) {
  return std::bit_cast<std::uint32_t>(a.t) == std::bit_cast<std::uint32_t>(b.t) &&
         std::bit_cast<std::uint32_t>(a.u) == std::bit_cast<std::uint32_t>(b.u) &&
         std::bit_cast<std::uint32_t>(a.v) == std::bit_cast<std::uint32_t>(b.v) &&
         a.triangle == b.triangle;
}

// Options that decide the tree, by the dice of the case; every other case is `all`.
BuildOptions options_of(std::uint64_t number, scene::Random& random) {
  constexpr std::uint32_t leaf_sizes[] = {1, 2, 4, 8, 16};
  constexpr std::uint32_t widths[] = {0, 15, 32, 48, 64};
  BuildOptions options;
  options.invalid_triangles = InvalidTriangles::skip;
  options.references = number % 2 == 0 ? References::once : References::all;
  options.leaf_size = leaf_sizes[random.below(5)];
  options.code_bits = widths[random.below(5)];
  options.axis_order = random.below(4) == 0 ? AxisOrder::cyclic : AxisOrder::by_extent;
  options.recode_crowded = random.below(4) != 0;
  return options;
}

std::string describe(const std::string& mesh, std::uint64_t case_number,
                     const BuildOptions& options) {
  return mesh + ", case " + std::to_string(case_number) + ", references " +
         zkd::to_string(options.references) + ", leaf size " + std::to_string(options.leaf_size) +
         ", code bits " + std::to_string(options.code_bits);
}

struct CaseResult {
  std::size_t intersector;  // which of all_intersectors
  TreeAgainstLoop counts;
  TreeAgainstLoop wide_counts;
  TreeAgainstLoop cuda_counts;
  std::string first_difference;
};

// Answers to the rays of a case, held against the loop's.
TreeAgainstLoop compare(const std::vector<Hit>& by_tree, const std::vector<std::uint8_t>& occluded,
                        const std::vector<Hit>& by_loop, const std::string& what,
                        std::string& first_difference) {
  TreeAgainstLoop counts;
  counts.rays = by_loop.size();
  for (std::size_t i = 0; i < by_loop.size(); ++i) {
    const bool different = !same_bits(by_tree[i], by_loop[i]);
    const bool any_different = (occluded[i] != 0) != (by_loop[i].triangle != no_triangle);
    if ((different || any_different) && first_difference.empty()) {
      first_difference = what + ", ray " + std::to_string(i);
    }
    counts.different += different ? 1 : 0;
    counts.any_hit_different += any_different ? 1 : 0;
  }
  return counts;
}

CaseResult compare_case(std::uint64_t number, std::uint64_t seed, bool cuda) {
  const auto kind = static_cast<int>(number / 2 % test::small_mesh_kinds);
  const std::uint64_t variation = number / (2 * test::small_mesh_kinds);
  scene::Random random(seed ^ (number * 0x9E3779B97F4A7C15u));
  const test::NamedMesh named = test::small_mesh(kind, seed + variation);
  const TriangleView triangles = named.mesh.view();
  const BuildOptions options = options_of(number, random);

  cpu::Executor executor;
  executor.threads = 1;
  const Tree tree = zkd::build(executor, triangles, options);
  const std::vector<Ray> rays =
      test::RayMaker(named.mesh, tree.view(), random.bits64()).all_kinds(rays_a_case);
  std::vector<Hit> by_tree(rays.size());
  std::vector<Hit> by_loop(rays.size());
  std::vector<std::uint8_t> occluded(rays.size());
  const Intersector intersector = all_intersectors[intersector_of(number)];
  zkd::closest_hit(executor, tree.view(), triangles, rays, by_tree, {}, intersector);
  zkd::closest_hit_brute_force(executor, tree.view(), triangles, rays, by_loop, intersector);
  zkd::any_hit(executor, tree.view(), triangles, rays, occluded, {}, intersector);

  CaseResult result{intersector_of(number), {}, {}, {}, {}};
  const std::string what =
      std::string(zkd::to_string(intersector)) + " on " + describe(named.name, number, options);
  result.counts = compare(by_tree, occluded, by_loop, what, result.first_difference);
  const cpu::WideTree wide = cpu::widen(executor, tree.view(), triangles);
  cpu::closest_hit(executor, wide.view(), rays, by_tree, {}, intersector);
  cpu::any_hit(executor, wide.view(), rays, occluded, {}, intersector);
  result.wide_counts = compare(by_tree, occluded, by_loop, "wide " + what, result.first_difference);
  if (cuda && intersector != Intersector::exact && !tree.view().empty()) {
    // The loop is the host's: the device has to come to its bits.
    const auto contender =
        std::move(cuda_contenders(triangles, std::span(&options, 1), intersector).front());
    Result unused;
    contender->describe(unused);
    contender->closest_hit(rays, by_tree);
    contender->any_hit(rays, occluded);
    result.cuda_counts =
        compare(by_tree, occluded, by_loop, "cuda " + what, result.first_difference);
  }
  return result;
}

}  // namespace

TreeAgainstLoop& TreeAgainstLoop::operator+=(const TreeAgainstLoop& other) {
  rays += other.rays;
  different += other.different;
  any_hit_different += other.any_hit_different;
  return *this;
}

std::uint64_t TreeAgainstLoops::rays() const {
  std::uint64_t sum = 0;
  for (const TreeAgainstLoop& one : of_intersector) sum += one.rays;
  return sum;
}

std::uint64_t TreeAgainstLoops::different() const {
  std::uint64_t sum = 0;
  for (const TreeAgainstLoop& one : of_intersector) sum += one.different + one.any_hit_different;
  return sum;
}

TreeAgainstLoops compare_with_brute_force(std::uint64_t rays, std::uint64_t seed, int threads,
                                          bool cuda) {
  TreeAgainstLoops all;
  for (const std::string prefix : {"", "wide ", "cuda "}) {
    if (prefix == "cuda " && !cuda) break;
    for (const Intersector intersector : all_intersectors) {
      all.of_intersector.push_back({prefix + zkd::to_string(intersector)});
    }
  }
  all.cases = (rays + rays_a_case - 1) / rays_a_case;
  scene::Progress progress("tree against brute force", all.cases);
  std::uint64_t first_case = all.cases;
#pragma omp parallel for num_threads(threads) schedule(dynamic)
  for (std::uint64_t number = 0; number < all.cases; ++number) {
    const CaseResult result = compare_case(number, seed, cuda);
#pragma omp critical(zkd_accuracy_brute_force)
    {
      all.of_intersector[result.intersector] += result.counts;
      all.of_intersector[all_intersectors.size() + result.intersector] += result.wide_counts;
      if (cuda)
        all.of_intersector[2 * all_intersectors.size() + result.intersector] += result.cuda_counts;
      if (!result.first_difference.empty() && number < first_case) {
        first_case = number;
        all.first_difference = result.first_difference;
      }
    }
    progress.advance(1);
  }
  return all;
}

}  // namespace zkd::bench::accuracy
