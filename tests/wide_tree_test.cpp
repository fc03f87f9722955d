// SPDX-License-Identifier: Apache-2.0
//
// Wide trees: every answer has the bits of the tree's and of a loop over all triangles, whatever
// the mesh, the ray, the intersector and the instruction set; the same bytes from any number of
// threads; what cannot be made is one error.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <zkd/cpu/wide_tree.hpp>
#include <zkd/zkd.hpp>

#include "core/area.hpp"
#include "cpu/wide/collapse.hpp"
#include "scene/hard_rays.hpp"
#include "support/caught.hpp"
#include "support/hits.hpp"
#include "support/memory.hpp"
#include "support/meshes.hpp"
#include "support/rays.hpp"
#include "support/tree_forms.hpp"

namespace zkd {
namespace {

using cpu::WideTree;
using cpu::WideTreeView;
using test::Caught;
using test::same_bits;

BuildOptions options_for(References references, std::uint32_t leaf_size = 4) {
  BuildOptions options;
  options.references = references;
  options.leaf_size = leaf_size;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

std::vector<BuildOptions> many_options() {
  std::vector<BuildOptions> all = {options_for(References::once), options_for(References::all),
                                   options_for(References::once, 1),
                                   options_for(References::all, 1),
                                   options_for(References::all, 64)};
  // Only these trees have leaves that list nothing.
  BuildOptions sah = options_for(References::all);
  sah.builder = Builder::sah;
  all.push_back(sah);
  sah.sah.areas = SahAreas::cells;
  sah.sah.empty_bonus = 0.2F;
  all.push_back(sah);
  return all;
}

// ---- Answers ------------------------------------------------------------------------------------

class WideTreeAnswers : public testing::TestWithParam<test::MeshKind> {};

TEST_P(WideTreeAnswers, AreThoseOfTheTree) {
  for (std::uint64_t seed = 200; seed < 201; ++seed) {
    const test::NamedMesh m = test::small_mesh(GetParam().number, seed);
    for (const BuildOptions& options : many_options()) {
      SCOPED_TRACE(m.name + ", " + to_string(options.references) + ", leaves of " +
                   std::to_string(options.leaf_size));
      const Tree tree = build(cpu::Executor{}, m.mesh.view(), options);
      const WideTree wide = cpu::widen({.threads = 2}, tree.view(), m.mesh.view());
      // Random bits make large trees, and rays that meet most of their leaves.
      const std::uint32_t count = tree.view().reference_count() < 50000 ? 120 : 12;
      const std::vector<Ray> rays = scene::hard_rays(m.mesh, tree.view(), count, seed);
      for (const Intersector intersector : test::all_intersectors) {
        test::expect_same_answers(tree, test::WideForm{wide.view()}, m.mesh.view(), rays,
                                  intersector);
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EveryKindOfMesh, WideTreeAnswers,
                         testing::ValuesIn(test::every_mesh_kind()),
                         [](const auto& kind) { return kind.param.name(); });

// From outside, seen edge-on and from afar: where an intersector in single precision is least sure,
// and what is left out in its place must be left out by its own error.
TEST(WideTree, NothingIsLeftOutThatRoundingHits) {
  for (const int exponent : {0, -100, 100}) {
    const scene::Mesh mesh =
        scene::scaled(scene::joined(scene::slivers(400, 1e4F, 7), scene::sphere(2)), exponent);
    const Tree tree = build(mesh.view(), options_for(References::once));
    const WideTree wide = cpu::widen({}, tree.view(), mesh.view());
    test::RayMaker maker(mesh, tree.view(), 11);
    std::vector<Ray> rays;
    for (int i = 0; i < 300; ++i) {
      // In the plane of a triangle, but for rounding; and to its edges from near and far.
      const glm::vec3 on_face = maker.on_face();
      rays.push_back(scene::ray_between(maker.on_edge(), on_face));
      rays.push_back(scene::ray_between(maker.around(), maker.on_edge()));
      Ray far = rays.back();
      far.origin -= 1000.0F * far.direction;
      rays.push_back(far);
    }
    for (const Intersector intersector : test::all_intersectors) {
      test::expect_same_answers(tree, test::WideForm{wide.view()}, mesh.view(), rays, intersector);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
}

TEST(WideTree, OfNothingMissesEverything) {
  const scene::Mesh none;
  const Tree tree = build(none.view());
  const WideTree wide = cpu::widen({}, tree.view(), none.view());
  EXPECT_EQ(wide.bytes(), 0u);
  test::expect_misses(test::WideForm{wide.view()});
  test::expect_misses(test::WideForm{});
}

// A leaf that nothing can divide is a row of blocks: alone, and below nodes.
TEST(WideTree, HugeLeaves) {
  const scene::Mesh pile = scene::identical(20'000);
  for (const scene::Mesh& mesh : {pile, scene::joined(scene::soup(500, 5), pile)}) {
    const Tree tree = build(mesh.view(), options_for(References::once));
    const WideTree wide = cpu::widen({.threads = 2}, tree.view(), mesh.view());
    const std::vector<Ray> rays = scene::hard_rays(mesh, tree.view(), 12, 12);
    for (const Intersector intersector : test::all_intersectors) {
      test::expect_same_answers(tree, test::WideForm{wide.view()}, mesh.view(), rays, intersector);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
}

TEST(WideTree, ShorterSpansEndTheWork) {
  const scene::Mesh mesh = scene::sphere(2);
  const Tree tree = build(mesh.view());
  const WideTree wide = cpu::widen({}, tree.view(), mesh.view());
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 100, 74);
  test::expect_shorter_spans_end_the_work(test::WideForm{wide.view()}, rays,
                                          test::closest(tree.view(), mesh.view(), rays));
}

// ---- What it is made of -------------------------------------------------------------------------

// Every triangle that the tree lists below a link, once each.
std::set<std::uint32_t> listed(const Tree& tree) {
  return {tree.references().begin(), tree.references().end()};
}

// What a walk over all nodes and blocks comes to.
struct Contents {
  std::uint32_t nodes = 0;
  std::uint32_t blocks = 0;
  std::uint64_t lanes = 0;
  std::set<std::uint32_t> ids;
};

void look_at_leaf(const WideTreeView& view, const TriangleView& triangles, std::uint32_t first,
                  Contents& contents) {
  std::vector<std::uint32_t> in_leaf;
  for (std::uint32_t b = first;; ++b) {
    ASSERT_LT(b, view.block_count);
    ++contents.blocks;
    const cpu::TriangleBlock& block = view.blocks[b];
    for (std::uint32_t lane = 0; lane < 8; ++lane) {
      const std::uint32_t id = block.id(lane);
      if (id == cpu::TriangleBlock::unused) continue;
      ++contents.lanes;
      in_leaf.push_back(id);
      contents.ids.insert(id);
      for (int corner = 0; corner < 3; ++corner) {
        const float* p = triangles.position(triangles.index(id, corner));
        for (int a = 0; a < 3; ++a) ASSERT_EQ(block.positions[corner][a][lane], p[a]);
      }
    }
    if (block.is_last()) break;
  }
  std::sort(in_leaf.begin(), in_leaf.end());
  EXPECT_EQ(std::adjacent_find(in_leaf.begin(), in_leaf.end()), in_leaf.end())
      << "a leaf lists a triangle twice";
}

void look_at(const WideTreeView& view, const TriangleView& triangles, Link link,
             Contents& contents) {
  if (link.is_leaf()) {
    look_at_leaf(view, triangles, link.index(), contents);
    return;
  }
  ASSERT_LT(link.index(), view.node_count);
  ++contents.nodes;
  const cpu::WideNode& node = view.nodes[link.index()];
  bool ended = false;
  for (int i = 0; i < cpu::wide; ++i) {
    const bool used = node.bounds[0][0][i] <= node.bounds[0][1][i];
    EXPECT_EQ(used, !node.child[i].is_none());
    EXPECT_FALSE(used && ended) << "children that are unused stand at the end";
    ended = !used;
    if (used) look_at(view, triangles, node.child[i], contents);
  }
}

TEST(WideTree, HoldsEveryTriangleOfTheTree) {
  for (const scene::Mesh& mesh :
       {scene::soup(30'000, 3), scene::sphere(5), scene::small_in_large(3000, 1e5F, 4)}) {
    for (const BuildOptions& options : many_options()) {
      const Tree tree = build(mesh.view(), options);
      const WideTree wide = cpu::widen({.threads = 2}, tree.view(), mesh.view());
      const WideTreeView& view = wide.view();
      Contents contents;
      look_at(view, mesh.view(), view.root(), contents);
      if (testing::Test::HasFatalFailure()) return;
      EXPECT_EQ(contents.nodes, view.node_count) << "each is reached once";
      EXPECT_EQ(contents.blocks, view.block_count);
      EXPECT_EQ(contents.ids, listed(tree));
      EXPECT_GE(2 * contents.lanes, 8 * contents.blocks) << "blocks are half full";
      EXPECT_LE(2 * view.node_count, tree.view().node_count()) << "nodes are collapsed";
      EXPECT_LE(wide.bytes(),
                64 + 224u * view.node_count + 63 + std::size_t{320} * view.block_count + 63);
    }
  }
}

// ---- Which nodes are wide -----------------------------------------------------------------------

// Half of the surface of all nodes but the root, added up in no particular order.
double surface_of(const WideTreeView& view) {
  double sum = 0.0;
  for (std::uint32_t n = 0; n < view.node_count; ++n) {
    const cpu::WideNode& node = view.nodes[n];
    for (int i = 0; i < cpu::wide; ++i) {
      if (node.child[i].is_none() || node.child[i].is_leaf()) continue;
      Box box;
      for (int a = 0; a < 3; ++a) {
        box.lo[a] = node.bounds[a][0][i];
        box.hi[a] = node.bounds[a][1][i];
      }
      sum += core::half_area(box);
    }
  }
  return sum;
}

// The nodes of a tree above what one block holds, any of which may be wide.
struct Candidates {
  struct One {
    double area;
    int above;  // another of them; -1: the root
    int leaves = 0;
  };
  std::vector<One> all;

  void add(const Tree& tree, const cpu::Part& part, const Box& box, int above) {
    const cpu::Halves halves(tree.view(), part);
    const auto self = static_cast<int>(all.size());
    all.push_back({core::half_area(box), above});
    for (int i = 0; i < halves.count; ++i) {
      if (cpu::is_leaf(tree.view(), halves.part[i]))
        ++all[static_cast<std::size_t>(self)].leaves;
      else
        add(tree, halves.part[i], halves.box[i], self);
    }
  }

  // With the root and the others that `chosen` has a bit for as wide nodes; infinity: one of them
  // has more than eight children.
  [[nodiscard]] double surface(std::uint32_t chosen) const {
    std::vector<int> children(all.size(), 0);
    double sum = 0.0;
    for (std::size_t i = all.size(); i-- > 0;) {
      children[i] += all[i].leaves;
      const bool is_wide = i == 0 || (chosen >> (i - 1) & 1u) != 0;
      if (is_wide && children[i] > cpu::wide) return std::numeric_limits<double>::infinity();
      if (i == 0) break;
      children[static_cast<std::size_t>(all[i].above)] += is_wide ? 1 : children[i];
      if (is_wide) sum += all[i].area;
    }
    return sum;
  }
};

TEST(WideTree, HasTheLeastSurfaceOfAllChoices) {
  int trees = 0;
  for (int kind = 0; kind < scene::small_mesh_kinds; ++kind) {
    for (const BuildOptions& options : many_options()) {
      const test::NamedMesh m = test::small_mesh(kind, 210);
      scene::Mesh few = m.mesh;
      few.faces.resize(std::min<std::size_t>(few.faces.size(), 70));
      const Tree tree = build(few.view(), options);
      const cpu::Part whole{tree.view().root(), 0, tree.view().leaf_count()};
      if (tree.view().reference_count() == 0 || cpu::is_leaf(tree.view(), whole)) continue;
      Candidates candidates;
      candidates.add(tree, whole, {}, -1);
      if (candidates.all.size() < 8 || candidates.all.size() > 17) continue;
      double least = std::numeric_limits<double>::infinity();
      for (std::uint32_t chosen = 0; chosen < 1u << (candidates.all.size() - 1); ++chosen)
        least = std::min(least, candidates.surface(chosen));
      const WideTree wide = cpu::widen({}, tree.view(), few.view());
      EXPECT_LE(surface_of(wide.view()), least * (1.0 + 1e-12)) << m.name;
      EXPECT_GE(surface_of(wide.view()), least * (1.0 - 1e-12)) << m.name;
      ++trees;
    }
  }
  EXPECT_GT(trees, 20);
}

// A large tree is collapsed in branches: what each has found is what is used above them.
TEST(WideTree, BranchesAddUpToTheWhole) {
  const scene::Mesh mesh = scene::joined(scene::soup(30'000, 3), scene::sphere(5));
  for (const BuildOptions& options : many_options()) {
    const Tree tree = build(mesh.view(), options);
    const cpu::Part whole{tree.view().root(), 0, tree.view().leaf_count()};
    std::vector<std::uint32_t> shares(tree.view().node_count());
    const double least =
        cpu::Collapse(tree.view(), cpu::Shares(shares.data()))
            .solve(whole, 0.0, [](const cpu::Part&, double, cpu::Surfaces&) { return false; })
            .with[cpu::wide];
    ASSERT_GT(tree.view().leaf_count(), 1024u) << "one branch is enough";
    const WideTree wide = cpu::widen({.threads = 2}, tree.view(), mesh.view());
    EXPECT_NEAR(surface_of(wide.view()) / least, 1.0, 1e-9);
    test::expect_same_answers(tree, test::WideForm{wide.view()}, mesh.view(),
                              scene::hard_rays(mesh, tree.view(), 60, 3), Intersector::watertight);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(WideTree, SameBytesFromAnyThreads) {
  const scene::Mesh mesh =
      scene::joined(scene::soup(60'000, 9), scene::small_in_large(20'000, 1e4F, 4));
  for (const References references : {References::once, References::all}) {
    const Tree tree = build(mesh.view(), options_for(references));
    const WideTree want = cpu::widen({.threads = 1}, tree.view(), mesh.view());
    for (const int threads : {1, 2, 3, 7}) {
      for (const cpu::InstructionSet set :
           {cpu::InstructionSet::portable, cpu::InstructionSet::automatic}) {
        const cpu::Executor executor{.threads = threads, .instructions = set};
        const WideTree got = cpu::widen(executor, tree.view(), mesh.view());
        const WideTreeView& a = want.view();
        const WideTreeView& b = got.view();
        ASSERT_EQ(a.node_count, b.node_count);
        ASSERT_EQ(a.block_count, b.block_count);
        EXPECT_EQ(a.root(), b.root());
        EXPECT_EQ(std::memcmp(a.nodes, b.nodes, a.node_count * sizeof(*a.nodes)), 0);
        EXPECT_EQ(std::memcmp(a.blocks, b.blocks, a.block_count * sizeof(*a.blocks)), 0);
      }
    }
  }
}

TEST(WideTree, IsASnapshotAndMoves) {
  scene::Mesh mesh = scene::sphere(3);
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 300, 8);
  std::vector<Hit> want;
  WideTree wide;
  {
    const Tree tree = build(mesh.view());
    want = test::closest(tree.view(), mesh.view(), rays);
    wide = cpu::widen({}, tree.view(), mesh.view());
  }
  for (glm::vec3& p : mesh.positions) p = glm::vec3(0.0F);
  WideTree moved = std::move(wide);
  EXPECT_FALSE(cpu::any_hit(wide.view(), rays[0]));  // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(wide.bytes(), 0u);
  std::vector<Hit> hits(rays.size());
  cpu::closest_hit({}, moved.view(), rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_TRUE(same_bits(hits[i], want[i]));
}

// ---- Memory and errors --------------------------------------------------------------------------

TEST(WideTree, MemoryIsTheExecutorsAndGoesBack) {
  const scene::Mesh mesh = scene::soup(30'000, 6);
  const Tree tree = build(mesh.view(), options_for(References::all));
  std::size_t allocations = 0;
  {
    test::CountingResource memory;
    {
      const WideTree wide = cpu::widen({.threads = 2, .memory = &memory}, tree.view(), mesh.view());
      EXPECT_EQ(memory.live_bytes(), wide.bytes());
      EXPECT_LE(memory.peak_bytes(),
                wide.bytes() + 512 * 1024 + std::size_t{4} * tree.view().node_count());
      allocations = memory.allocations();
      EXPECT_GT(allocations, 0u);
    }
    EXPECT_EQ(memory.live_bytes(), 0u);
    EXPECT_FALSE(memory.misused());
  }
  for (std::size_t at = 1; at <= allocations; ++at) {
    test::CountingResource memory;
    memory.refuse_at = at;
    const Caught error = test::caught(
        [&] { (void)cpu::widen({.threads = 2, .memory = &memory}, tree.view(), mesh.view()); });
    ASSERT_TRUE(error.thrown) << at;
    EXPECT_EQ(error.code, ErrorCode::out_of_memory);
    EXPECT_EQ(memory.live_bytes(), 0u);
    EXPECT_EQ(memory.live_blocks(), 0u);
  }
}

TEST(WideTree, RefusesOtherTrianglesAndBadInput) {
  const scene::Mesh mesh = scene::soup(3000, 6);
  const Tree tree = build(mesh.view());
  scene::Mesh fewer = mesh;
  fewer.faces.resize(2000);
  test::CountingResource memory;
  const Caught other =
      test::caught([&] { (void)cpu::widen({.memory = &memory}, tree.view(), fewer.view()); });
  EXPECT_ERROR(other, ErrorCode::index_out_of_range, 2000);
  EXPECT_EQ(memory.live_bytes(), 0u);

  TriangleView odd = mesh.view();
  odd.position_stride = 7;
  const Caught view = test::caught([&] { (void)cpu::widen({}, tree.view(), odd); });
  EXPECT_TRUE(view.thrown && view.code == ErrorCode::invalid_view);

  const Caught threads =
      test::caught([&] { (void)cpu::widen({.threads = -1}, tree.view(), mesh.view()); });
  EXPECT_TRUE(threads.thrown && threads.code == ErrorCode::invalid_option);
}

}  // namespace
}  // namespace zkd
