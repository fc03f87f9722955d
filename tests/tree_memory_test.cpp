// SPDX-License-Identifier: Apache-2.0
//
// Memory: all of it from the caller's resource, never more than was asked for beforehand, all of it
// given back, and one clear error when it is refused.
#include <gtest/gtest.h>

#include <memory_resource>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <zkd/stages.hpp>
#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "support/hits.hpp"
#include "support/memory.hpp"
#include "support/meshes.hpp"
#include "support/refusing_new.hpp"
#include "support/tree_kinds.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

using test::CountingResource;
using test::news;
using verify::tree_hash;

std::vector<test::NamedMesh> meshes() {
  std::vector<test::NamedMesh> all;
  for (const int kind : {0, 2, 6, 8, 10, 12, 13, 14, 23, 28, 30, 31}) {
    all.push_back(test::small_mesh(kind, 30));
  }
  all.push_back({"nothing", {}});
  all.push_back({"large soup", scene::soup(20001, 31)});
  all.push_back({"stadium", scene::small_in_large(5000, 1e6F, 31)});
  return all;
}

BuildOptions options_for(References references, std::uint32_t code_bits = 0) {
  BuildOptions options;
  options.references = references;
  options.code_bits = code_bits;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

// Each way to build that takes its memory in another way.
std::vector<BuildOptions> ways() {
  std::vector<BuildOptions> all = test::tree_kinds();
  for (const Builder builder : {Builder::sah, Builder::wu2011}) {
    all.push_back(options_for(References::all));
    all.back().builder = builder;
  }
  return all;
}

std::string name(const BuildOptions& way) {
  return std::string(to_string(way.builder)) + " " + test::name_of(way);
}

// The default resource refuses everything while this lives.
class NoDefaultMemory {
 public:
  NoDefaultMemory() : before_(std::pmr::set_default_resource(std::pmr::null_memory_resource())) {}
  ~NoDefaultMemory() { std::pmr::set_default_resource(before_); }
  NoDefaultMemory(const NoDefaultMemory&) = delete;
  NoDefaultMemory& operator=(const NoDefaultMemory&) = delete;

 private:
  std::pmr::memory_resource* before_;
};

// What the two tests below rest on.
TEST(TreeMemory, OperatorNewIsCounted) {
  if (ZKD_COUNTS_NEW == 0) {
    GTEST_SKIP() << "a sanitizer has operator new for itself: calls of it are not counted";
  }
  const std::size_t before = news;
  ::operator delete(::operator new(1));
  ::operator delete (::operator new (64, std::align_val_t{64}), std::align_val_t{64});
  EXPECT_EQ(news - before, 2u);
}

TEST(TreeMemory, NothingIsAllocatedElsewhere) {
  for (const test::NamedMesh& m : meshes()) {
    for (const BuildOptions& way : ways()) {
      SCOPED_TRACE(m.name + ", " + name(way));
      CountingResource memory;
      const cpu::Executor executor{.threads = 3, .memory = &memory};
      const NoDefaultMemory none;
      const std::size_t before = news;
      {
        const Tree tree = build(executor, m.mesh.view(), way);
        EXPECT_EQ(news - before, 0u) << "operator new was called";
        EXPECT_LE(memory.live_blocks(), 2u) << "nodes with leaf offsets, references";
        EXPECT_EQ(memory.live_bytes(), tree.statistics().tree_bytes);
        EXPECT_LE(memory.peak_bytes(),
                  tree.statistics().tree_bytes + tree.statistics().workspace_bytes)
            << "statistics report less than was held";
      }
      EXPECT_EQ(memory.live_bytes(), 0u);
      EXPECT_EQ(memory.live_blocks(), 0u);
      EXPECT_FALSE(memory.misused());
    }
  }
}

TEST(TreeMemory, QueriesAllocateNothing) {
  const scene::Mesh mesh = scene::sphere(4);
  CountingResource memory;
  const Tree tree = build(mesh.view());
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 2000, 32);
  std::vector<Hit> hits(rays.size());
  std::vector<std::uint8_t> occluded(rays.size());
  std::vector<TraversalCost> costs(rays.size());
  const cpu::Executor executor{.threads = 2, .memory = &memory};
  const NoDefaultMemory none;
  const std::size_t before = news;
  closest_hit(executor, tree.view(), mesh.view(), rays, hits, costs);
  any_hit(executor, tree.view(), mesh.view(), rays, occluded, costs);
  for (const Ray& ray : rays) {
    (void)closest_hit(tree.view(), mesh.view(), ray);
    (void)any_hit(tree.view(), mesh.view(), ray);
  }
  closest_hit_brute_force(executor, tree.view(), mesh.view(), std::span(rays).first(50), hits);
  EXPECT_EQ(news - before, 0u);
  EXPECT_EQ(memory.allocations(), 0u);
}

TEST(TreeMemory, NoResourceMeansTheDefaultOne) {
  CountingResource memory;
  std::pmr::memory_resource* before = std::pmr::set_default_resource(&memory);
  const scene::Mesh mesh = scene::soup(1000, 33);
  {
    const Tree tree = build(mesh.view());
    std::pmr::set_default_resource(before);
    EXPECT_GT(memory.allocations(), 0u);
    EXPECT_EQ(memory.live_bytes(), tree.statistics().tree_bytes);
  }
  EXPECT_EQ(memory.live_bytes(), 0u);
}

TEST(TreeMemory, NeverMoreThanWasAskedForBeforehand) {
  for (const test::NamedMesh& m : meshes()) {
    for (BuildOptions options : test::tree_kinds()) {
      for (const std::uint32_t code_bits : {0u, 32u, 64u}) {
        for (int threads = 1; threads <= 4; ++threads) {
          SCOPED_TRACE(m.name + ", " + test::name_of(options) + ", " + std::to_string(code_bits) +
                       " bits, " + std::to_string(threads) + " threads");
          CountingResource memory;
          const cpu::Executor executor{.threads = threads, .memory = &memory};
          options.code_bits = code_bits;
          const Tree tree = build(executor, m.mesh.view(), options);
          const Statistics& s = tree.statistics();
          const MemoryRequirement need =
              memory_requirement(executor, m.mesh.faces.size(), options, s.references);
          EXPECT_LE(s.tree_bytes, need.tree_bytes);
          EXPECT_LE(s.workspace_bytes, need.workspace_bytes);
          EXPECT_LE(memory.peak_bytes(), need.tree_bytes + need.workspace_bytes);
          EXPECT_LE(memory.peak_bytes(), s.tree_bytes + s.workspace_bytes)
              << "statistics report less than was held";

          CountingResource exact;
          exact.limit = need.tree_bytes + need.workspace_bytes;
          EXPECT_NO_THROW(
              (void)build({.threads = threads, .memory = &exact}, m.mesh.view(), options));
          EXPECT_EQ(exact.live_bytes(), 0u);
        }
      }
    }
  }
}

TEST(TreeMemory, RequirementGrowsWithTheCount) {
  std::size_t before = 0;
  for (const std::uint64_t count : {0u, 1u, 2u, 100u, 10000u, 1000000u, 5000000u}) {
    const MemoryRequirement need = memory_requirement({.threads = 2}, count);
    EXPECT_GE(need.tree_bytes + need.workspace_bytes, before);
    before = need.tree_bytes + need.workspace_bytes;
  }
  EXPECT_THROW((void)memory_requirement({}, max_count + 1), Error);
  EXPECT_NO_THROW((void)memory_requirement({}, max_count));
}

// Found by fuzzing: room for a budget that no cuts could use was asked for.
TEST(TreeMemory, ABudgetTakesNoMoreThanCutsCanUse) {
  const scene::Mesh soup = scene::soup(100, 41);
  for (const References references : {References::budget, References::automatic}) {
    BuildOptions useful = options_for(references);
    useful.budget = 1024.0F;
    BuildOptions boundless = useful;
    boundless.budget = 1e30F;
    const cpu::Executor executor{.threads = 2};
    const MemoryRequirement need = memory_requirement(executor, soup.faces.size(), useful);
    const MemoryRequirement more = memory_requirement(executor, soup.faces.size(), boundless);
    EXPECT_EQ(more.tree_bytes, need.tree_bytes);
    EXPECT_EQ(more.workspace_bytes, need.workspace_bytes);
    EXPECT_EQ(tree_hash(build(executor, soup.view(), boundless).view()),
              tree_hash(build(executor, soup.view(), useful).view()));
  }
}

// ---- Refusals -----------------------------------------------------------------------------------

// Refuses allocation 1, 2, 3, ..., alone and with all that follow, until `work` succeeds.
template <class Work>
void expect_every_refusal_is_survived(const Work& work) {
  for (const bool and_all_that_follow : {false, true}) {
    for (std::size_t refused = 1;; ++refused) {
      ASSERT_LT(refused, 1000u) << "so many allocations?";
      CountingResource memory;
      memory.refuse_at = refused;
      memory.refuse_all_from_there = and_all_that_follow;
      bool refusal = false;
      try {
        work(memory);
      } catch (const Error& error) {
        refusal = true;
        EXPECT_EQ(error.code(), ErrorCode::out_of_memory) << error.what();
        EXPECT_GT(error.offender(), 0u);
        EXPECT_NE(std::string(error.what()).find(std::to_string(error.offender())),
                  std::string::npos)
            << error.what();
      }
      EXPECT_EQ(memory.live_bytes(), 0u) << "leaked when allocation " << refused << " was refused";
      EXPECT_EQ(memory.live_blocks(), 0u);
      EXPECT_FALSE(memory.misused());
      if (!refusal) {
        EXPECT_LT(memory.allocations(), refused) << "a refusal went unnoticed";
        break;
      }
      memory.refuse_at = 0;
      EXPECT_NO_THROW(work(memory)) << "the next try in the same memory";
      EXPECT_EQ(memory.live_bytes(), 0u);
    }
  }
}

TEST(TreeMemory, EveryRefusalIsOneErrorAndNoLeak) {
  for (const test::NamedMesh& m : meshes()) {
    if (m.mesh.faces.size() > 10000) continue;  // takes its memory as one of 5000 does
    for (const BuildOptions& way : ways()) {
      // Takes memory on every level, hundreds of times: below.
      if (way.builder == Builder::wu2011) continue;
      SCOPED_TRACE(m.name + ", " + name(way));
      expect_every_refusal_is_survived([&](CountingResource& memory) {
        (void)build({.threads = 2, .memory = &memory}, m.mesh.view(), way);
      });
    }
  }
}

TEST(TreeMemory, EveryRefusalOnALevelIsOneErrorAndNoLeak) {
  const scene::Mesh mesh = scene::soup(24, 36);
  BuildOptions options = options_for(References::all);
  options.builder = Builder::wu2011;
  expect_every_refusal_is_survived([&](CountingResource& memory) {
    (void)build({.threads = 2, .memory = &memory}, mesh.view(), options);
  });
}

TEST(TreeMemory, EveryRefusalInAStageIsOneErrorAndNoLeak) {
  const scene::Mesh mesh = scene::small_in_large(2000, 1e6F, 34);
  expect_every_refusal_is_survived([&](CountingResource& memory) {
    const cpu::Executor executor{.threads = 2, .memory = &memory};
    std::vector<Box> boxes(mesh.faces.size());
    const stages::SceneSummary scene =
        stages::triangle_boxes(executor, mesh.view(), InvalidTriangles::skip, boxes);
    const Lattice lattice = stages::make_lattice(scene.bounds, 32);
    std::vector<std::uint64_t> codes(scene.valid);
    std::vector<std::uint32_t> ids(scene.valid);
    stages::morton_encode(executor, boxes, lattice, std::span(codes), ids);
    (void)stages::radix_sort(executor, std::span(codes), ids, 32);
    std::vector<stages::TrunkKey> keys(scene.valid);
    std::vector<std::uint32_t> crowd(scene.valid);
    std::vector<Lattice> lattices(scene.valid);
    (void)stages::recode_crowded(executor, boxes, lattice, codes, ids, 4, AxisOrder::by_extent,
                                 true, keys, crowd, lattices);
    std::vector<std::uint32_t> first(scene.valid);
    (void)stages::find_trunks(executor, keys, 4, first);
  });
}

TEST(TreeMemory, TooLittleMemoryIsAnError) {
  const scene::Mesh mesh = scene::soup(5000, 35);
  for (const BuildOptions& way : ways()) {
    SCOPED_TRACE(name(way));
    CountingResource whole;
    (void)build({.threads = 2, .memory = &whole}, mesh.view(), way);
    const std::size_t need = whole.peak_bytes();
    std::vector<std::size_t> limits = {need - 1, need};
    for (std::size_t tenths = 0; tenths < 10; ++tenths) limits.push_back(need / 10 * tenths);
    for (const std::size_t limit : limits) {
      CountingResource memory;
      memory.limit = limit;
      try {
        (void)build({.threads = 2, .memory = &memory}, mesh.view(), way);
        EXPECT_EQ(limit, need) << "less was enough";
      } catch (const Error& error) {
        EXPECT_NE(limit, need) << "what was enough before";
        EXPECT_EQ(error.code(), ErrorCode::out_of_memory);
      }
      EXPECT_LE(memory.peak_bytes(), limit);
      EXPECT_EQ(memory.live_bytes(), 0u);
    }
  }
}

TEST(TreeMemory, BadInputLeaksNothing) {
  scene::Mesh mesh = scene::soup(5000, 36);
  mesh.faces[4000].y = 1000000;
  CountingResource memory;
  EXPECT_THROW((void)build({.memory = &memory}, mesh.view()), Error);
  EXPECT_EQ(memory.live_bytes(), 0u);
  mesh.faces[4000].y = 0;
  mesh.positions[mesh.faces[4000].z].x = std::numeric_limits<float>::infinity();
  EXPECT_THROW((void)build({.memory = &memory}, mesh.view()), Error);
  EXPECT_EQ(memory.live_bytes(), 0u);
}

// ---- Owners -------------------------------------------------------------------------------------

TEST(TreeMemory, CloneIsTheSameTreeInOtherMemory) {
  for (const test::NamedMesh& m : meshes()) {
    SCOPED_TRACE(m.name);
    CountingResource one;
    CountingResource other;
    {
      Tree copy;
      std::string hash;
      {
        const Tree tree = build({.memory = &one}, m.mesh.view(), options_for(References::once));
        hash = tree_hash(tree.view());
        copy = tree.clone(&other);
        EXPECT_EQ(copy.statistics().references, tree.statistics().references);
        EXPECT_EQ(copy.lattice().code_bits, tree.lattice().code_bits);
        if (!tree.view().empty()) {
          EXPECT_NE(copy.view().references, tree.view().references);
        }
      }
      EXPECT_EQ(one.live_bytes(), 0u);
      EXPECT_EQ(tree_hash(copy.view()), hash);
      if (!copy.view().empty()) {
        EXPECT_GT(other.live_bytes(), 0u);
      }
    }
    EXPECT_EQ(other.live_bytes(), 0u);
    EXPECT_FALSE(one.misused() || other.misused());
  }
  EXPECT_TRUE(Tree().clone().view().empty());
}

TEST(TreeMemory, RefusedCloneThrowsAndLeaksNothing) {
  const Tree tree = build(scene::soup(100, 37).view());
  expect_every_refusal_is_survived([&](CountingResource& memory) { (void)tree.clone(&memory); });
}

TEST(TreeMemory, MovesLeaveAnEmptyTreeAndFreeTheOldOne) {
  CountingResource memory;
  const scene::Mesh mesh = scene::soup(1000, 38);
  {
    Tree first = build({.memory = &memory}, mesh.view());
    const std::string hash = tree_hash(first.view());
    const Node* nodes = first.view().nodes;
    Tree second = std::move(first);
    EXPECT_EQ(second.view().nodes, nodes);
    EXPECT_TRUE(first.view().empty());  // NOLINT(bugprone-use-after-move): documented as empty
    EXPECT_FALSE(closest_hit(first.view(), mesh.view(), {{0, 0, -9}}).has_value());

    const std::size_t one_tree = memory.live_bytes();
    Tree third = build({.memory = &memory}, scene::soup(500, 39).view());
    third = std::move(second);
    EXPECT_EQ(tree_hash(third.view()), hash);
    EXPECT_EQ(memory.live_bytes(), one_tree) << "the tree that was there before";
    third = Tree();
    EXPECT_EQ(memory.live_blocks(), 0u);
    Tree& alias = third;
    third = std::move(alias);
    EXPECT_TRUE(third.view().empty());
  }
  EXPECT_EQ(memory.live_bytes(), 0u);
}

}  // namespace
}  // namespace zkd
