// SPDX-License-Identifier: Apache-2.0
//
// Cases by number: each thread makes, builds and traces whole cases of its own.
#include "brute_force.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include <zkd/build.hpp>
#include <zkd/cpu/plane_tree.hpp>
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

int kind_of(std::uint64_t number) {
  return static_cast<int>(number / 2 % test::small_mesh_kinds);  // `once`, then `all`
}

// The rays of each case. Many rays a tree where many are asked for, many trees where few are; and
// fewer where a ray takes many times as long.
class RaysOf {
 public:
  explicit RaysOf(std::uint64_t asked)
      : most_(static_cast<std::uint32_t>(std::clamp<std::uint64_t>(asked / 1024, 256, 4096))) {}

  [[nodiscard]] std::uint32_t a_case(std::uint64_t number) const {
    return scene::is_slow_small_mesh(kind_of(number)) ? most_ / 8 : most_;
  }

  // Of those, how many are for `exact`: each mesh and setting meets it, with every kind of ray,
  // but it is slow.
  [[nodiscard]] static std::uint32_t exact(std::uint64_t number) {
    return (number + number / 64) % 4 == 0 ? 16 : 0;
  }

  // Cases until there are so many rays.
  [[nodiscard]] std::uint64_t cases(std::uint64_t rays) const {
    std::uint64_t number = 0;
    for (std::uint64_t sum = 0; sum < rays; ++number) sum += a_case(number);
    return number;
  }

 private:
  std::uint32_t most_;
};

// The others: the default gets half of the cases. Neighbours, `once` and `all`, get the same one;
// each mesh meets every one in sixteen variations.
std::size_t intersector_of(std::uint64_t number) {
  constexpr std::size_t turn[] = {0, 1, 0, 2, 0, 3, 0, 1, 0, 2, 0, 3, 0, 1, 0, 2};
  return turn[(number / 2 + number / (2 * test::small_mesh_kinds)) % 16];
}
constexpr std::size_t exact_one = 4;
static_assert(all_intersectors[exact_one] == Intersector::exact);

// Cases whose loop is itself held against the scalar one, which is its definition.
bool is_loop_checked(std::uint64_t number) {
  constexpr std::uint64_t of = 64;
  return (number + number / of) % of == 0;  // every kind of mesh, `once` and `all`, in turn
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
  constexpr References others[] = {References::once, References::budget, References::once,
                                   References::automatic};
  options.references = number % 2 == 0 ? others[random.below(4)] : References::all;
  options.budget = 1.0F + 0.5F * static_cast<float>(random.below(5));
  options.quality = random.below(3) == 0 ? Quality::balanced : Quality::fast;
  options.leaf_size = leaf_sizes[random.below(5)];
  options.code_bits = widths[random.below(5)];
  options.axis_order = random.below(4) == 0 ? AxisOrder::cyclic : AxisOrder::by_extent;
  options.recode_crowded = random.below(4) != 0;
  return options;
}

std::string describe(const std::string& mesh, std::uint64_t case_number,
                     const BuildOptions& options) {
  return mesh + ", case " + std::to_string(case_number) + ", references " +
         zkd::to_string(options.references) + " " + zkd::to_string(options.quality) + ", budget " +
         std::to_string(options.budget) + ", leaf size " + std::to_string(options.leaf_size) +
         ", code bits " + std::to_string(options.code_bits);
}

// What answered the rays, in the order of the rows of a report.
enum class Answerer : std::uint8_t { tree, wide_tree, plane_tree, cuda_tree };
constexpr std::array answerers{Answerer::tree, Answerer::wide_tree, Answerer::plane_tree,
                               Answerer::cuda_tree};
constexpr const char* prefix(Answerer answerer) {
  constexpr const char* prefixes[] = {"", "wide ", "planes ", "cuda "};
  return prefixes[static_cast<std::size_t>(answerer)];
}
std::size_t row_of(Answerer answerer, std::size_t intersector) {
  return static_cast<std::size_t>(answerer) * all_intersectors.size() + intersector;
}

struct CaseResult {
  std::array<TreeAgainstLoop, answerers.size() * all_intersectors.size()> of_row;
  TreeAgainstLoop loop;
  std::string first_difference;
};

/// One tree, and what answers through it.
class Case {
 public:
  Case(std::uint64_t number, std::uint64_t seed, std::uint32_t rays, bool cuda)
      : number_(number),
        cuda_(cuda),
        random_(seed ^ (number * 0x9E3779B97F4A7C15u)),
        named_(test::small_mesh(kind_of(number), seed + number / (2 * test::small_mesh_kinds))),
        triangles_(named_.mesh.view()),
        options_(options_of(number, random_)),
        tree_(zkd::build(executor_, triangles_, options_)),
        wide_(cpu::widen(executor_, tree_.view(), triangles_)),
        planes_(options_.references == References::all ? cpu::strip_boxes(executor_, tree_)
                                                       : cpu::PlaneTree()),
        rays_(test::RayMaker(named_.mesh, tree_.view(), random_.bits64()).all_kinds(rays)),
        by_loop_(rays),
        by_tree_(rays),
        occluded_(rays) {}

  CaseResult run() {
    const std::span<const Ray> rays = rays_;
    const std::uint32_t for_exact = RaysOf::exact(number_);
    if (for_exact > 0) compare(rays.first(for_exact), exact_one);
    compare(rays.subspan(for_exact), intersector_of(number_));
    return std::move(result_);
  }

 private:
  void compare(std::span<const Ray> rays, std::size_t which) {
    const Intersector intersector = all_intersectors[which];
    const TreeView& tree = tree_.view();
    what_ = std::string(zkd::to_string(intersector)) + " on " +
            describe(named_.name, number_, options_);
    zkd::closest_hit_brute_force(executor_, tree, triangles_, rays, by_loop_, intersector);
    if (is_loop_checked(number_)) {
      const cpu::Executor scalar{.threads = 1, .instructions = cpu::InstructionSet::portable};
      zkd::closest_hit_brute_force(scalar, tree, triangles_, rays, by_tree_, intersector);
      count_hits(rays.size(), "the loop itself, ", result_.loop);
    }
    zkd::closest_hit(executor_, tree, triangles_, rays, by_tree_, {}, intersector);
    zkd::any_hit(executor_, tree, triangles_, rays, occluded_, {}, intersector);
    count(rays.size(), Answerer::tree, which);
    cpu::closest_hit(executor_, wide_.view(), rays, by_tree_, {}, intersector);
    cpu::any_hit(executor_, wide_.view(), rays, occluded_, {}, intersector);
    count(rays.size(), Answerer::wide_tree, which);
    if (options_.references == References::all) {
      const cpu::PlaneTreeView& planes = planes_.view();
      cpu::closest_hit(executor_, planes, triangles_, rays, by_tree_, {}, intersector);
      cpu::any_hit(executor_, planes, triangles_, rays, occluded_, {}, intersector);
      count(rays.size(), Answerer::plane_tree, which);
    }
    if (cuda_ && intersector != Intersector::exact && !tree.empty()) {
      // The loop is the host's: the device has to come to its bits.
      const auto contender =
          std::move(cuda_contenders(triangles_, std::span(&options_, 1), intersector).front());
      Result unused;
      contender->describe(unused);
      contender->closest_hit(rays, std::span(by_tree_).first(rays.size()));
      contender->any_hit(rays, std::span(occluded_).first(rays.size()));
      count(rays.size(), Answerer::cuda_tree, which);
    }
  }

  // Answers of the first rays, held against the loop's.
  void count(std::size_t rays, Answerer answerer, std::size_t which) {
    TreeAgainstLoop& counts = result_.of_row[row_of(answerer, which)];
    count_hits(rays, prefix(answerer), counts);
    for (std::size_t i = 0; i < rays; ++i) {
      if ((occluded_[i] != 0) == (by_loop_[i].triangle != no_triangle)) continue;
      ++counts.any_hit_different;
      found(prefix(answerer), i);
    }
  }
  void count_hits(std::size_t rays, const char* answerer, TreeAgainstLoop& counts) {
    counts.rays += rays;
    for (std::size_t i = 0; i < rays; ++i) {
      if (same_bits(by_tree_[i], by_loop_[i])) continue;
      ++counts.different;
      found(answerer, i);
    }
  }
  void found(const char* answerer, std::size_t ray) {
    if (!result_.first_difference.empty()) return;
    result_.first_difference = answerer + what_ + ", ray " + std::to_string(ray);
  }

  std::uint64_t number_;
  bool cuda_;
  scene::Random random_;
  test::NamedMesh named_;
  TriangleView triangles_;
  BuildOptions options_;
  cpu::Executor executor_{.threads = 1};
  Tree tree_;
  cpu::WideTree wide_;
  cpu::PlaneTree planes_;  ///< of strict trees
  std::vector<Ray> rays_;
  std::vector<Hit> by_loop_;
  std::vector<Hit> by_tree_;
  std::vector<std::uint8_t> occluded_;
  std::string what_;
  CaseResult result_;
};

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
  std::uint64_t sum = loop.different;
  for (const TreeAgainstLoop& one : of_intersector) sum += one.different + one.any_hit_different;
  return sum;
}

TreeAgainstLoops compare_with_brute_force(std::uint64_t rays, std::uint64_t seed, int threads,
                                          bool cuda) {
  TreeAgainstLoops all;
  for (const Answerer answerer : answerers) {
    for (const Intersector intersector : all_intersectors) {
      all.of_intersector.push_back({prefix(answerer) + std::string(zkd::to_string(intersector))});
    }
  }
  const RaysOf rays_of(rays);
  all.cases = rays_of.cases(rays);
  scene::Progress progress("tree against brute force", all.cases);
  std::uint64_t first_case = all.cases;
#pragma omp parallel for num_threads(threads) schedule(dynamic)
  for (std::uint64_t number = 0; number < all.cases; ++number) {
    const CaseResult result = Case(number, seed, rays_of.a_case(number), cuda).run();
#pragma omp critical(zkd_accuracy_brute_force)
    {
      for (std::size_t row = 0; row < result.of_row.size(); ++row)
        all.of_intersector[row] += result.of_row[row];
      all.loop += result.loop;
      if (!result.first_difference.empty() && number < first_case) {
        first_case = number;
        all.first_difference = result.first_difference;
      }
    }
    progress.advance(1);
  }
  if (!cuda) all.of_intersector.resize(row_of(Answerer::cuda_tree, 0));
  return all;
}

}  // namespace zkd::bench::accuracy
