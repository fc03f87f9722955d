// SPDX-License-Identifier: Apache-2.0
//
// Stages 10 and 11, references and tight boxes, on what the stages before them made: the bytes of a
// build on the CPU, whatever the platform.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include <zkd/build.hpp>
#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "support/composition.hpp"
#include "support/meshes.hpp"
#include "support/platform.hpp"

namespace zkd {
namespace {

std::vector<test::NamedMesh> meshes() {
  std::vector<test::NamedMesh> all = {
      {"nothing", {}},
      {"one triangle", test::many_scales(1, 1)},
      {"two triangles", test::many_scales(2, 1)},
      {"integers", test::integer_mesh(300, 2, 1)},
      {"many scales", test::many_scales(300, 2)},
      {"few ulps", test::few_ulps(300, 1e6F, 3, 3)},
      {"denormals", test::denormals(300, 4, 4)},
      {"book", test::book(300)},
      {"many", test::many_scales(6000, 5)},
  };
  test::NamedMesh far = {"scaled up", test::many_scales(300, 6)};
  for (glm::vec3& p : far.mesh.positions) p *= 0x1p100F;
  all.push_back(std::move(far));
  return all;
}

void expect_like_build(const TriangleView& triangles, const BuildOptions& options,
                       const test::Executor& executor) {
  const Tree want = build(cpu::Executor{}, triangles, options);
  const test::Composition got = test::compose(executor, triangles, options);
  EXPECT_EQ(got.crowded, want.statistics().crowded_trunks);
  EXPECT_TRUE(got.root == want.view().root());
  ASSERT_EQ(got.leaf_offsets.size(), want.view().leaf_count() + std::size_t{1});
  for (std::size_t leaf = 0; leaf < want.view().leaf_count(); ++leaf) {
    ASSERT_EQ(got.leaf_offsets[leaf], want.view().leaf_offsets[leaf]) << "leaf " << leaf;
  }
  ASSERT_EQ(got.leaf_offsets.back(), want.references().size());
  ASSERT_EQ(got.references.size(), want.references().size());
  for (std::size_t i = 0; i < got.references.size(); ++i) {
    ASSERT_EQ(got.references[i], want.references()[i]) << "reference " << i;
  }
  ASSERT_EQ(got.nodes.size(), want.nodes().size());
  for (std::size_t j = 0; j < got.nodes.size(); ++j) {
    ASSERT_EQ(std::memcmp(&got.nodes[j], &want.nodes()[j], sizeof(Node)), 0) << "node " << j;
    if (got.first.size() != want.view().leaf_count()) {
      ASSERT_EQ(options.references, References::all);
      continue;
    }
    ASSERT_TRUE(got.children[2 * j] == want.nodes()[j].child[0]) << "node " << j;
    ASSERT_TRUE(got.children[2 * j + 1] == want.nodes()[j].child[1]) << "node " << j;
    ASSERT_EQ(got.axes[j], want.nodes()[j].axis) << "node " << j;
    ASSERT_EQ(got.planes[j] * want.view().scale(), want.nodes()[j].plane) << "node " << j;
  }
}

TEST(StageFinish, GivesTheBytesOfABuild) {
  for (const test::NamedMesh& m : meshes()) {
    for (const References references : {References::once, References::budget, References::all}) {
      for (const std::uint32_t code_bits : {0u, 6u, 64u}) {
        if (references == References::budget && code_bits != 0) continue;  // as `once`
        for (const test::Executor& executor : test::executors(2)) {
          SCOPED_TRACE(m.name + ", " + to_string(references) + ", " + std::to_string(code_bits) +
                       " bits, " + test::name(executor));
          expect_like_build(m.mesh.view(),
                            {.references = references,
                             .leaf_size = code_bits == 0 ? 1u : 4u,
                             .code_bits = code_bits,
                             .invalid_triangles = InvalidTriangles::skip},
                            executor);
          if (testing::Test::HasFailure()) return;
        }
      }
    }
  }
}

// Two triangles, a leaf each.
struct Small {
  scene::Mesh mesh = test::integer_mesh(2, 4, 7);
  std::vector<Box> boxes = std::vector<Box>(2, Box{{-1, -1, -1}, {1, 1, 1}});
  std::vector<std::uint32_t> ids = {0, 1};
  std::vector<std::uint32_t> first = {0, 1};
  std::vector<std::uint8_t> levels = {0};
  std::vector<Link> children = {Link::leaf(0), Link::leaf(1)};
  Link root = Link::node(0);
  std::vector<std::uint32_t> axes = {0};
  std::vector<float> planes = {0.0F};
  std::vector<std::uint32_t> leaf_offsets = {0, 1, 2};
  std::vector<std::uint32_t> references = {0, 1};

  // Runs both stages.
  std::vector<std::uint32_t> finish(std::size_t room) const {
    const test::Array<Box> on_boxes = test::upload(boxes);
    const test::Array<std::uint32_t> on_ids = test::upload(ids);
    const test::Array<std::uint32_t> on_first = test::upload(first);
    const test::Array<std::uint8_t> on_levels = test::upload(levels);
    const test::Array<Link> on_children = test::upload(children);
    const test::Array<std::uint32_t> on_axes = test::upload(axes);
    const test::Array<float> on_planes = test::upload(planes);
    const stages::Skeleton skeleton{on_ids, on_first, on_levels, on_children,
                                    root,   on_axes,  on_planes};
    test::Array<std::uint32_t> offsets(first.size() + 1);
    test::Array<std::uint32_t> listed(room, 77);
    (void)stages::list_references(test::executor(), test::upload(mesh.view()), on_boxes, skeleton,
                                  {}, References::once, offsets, listed);
    test::Array<Node> nodes(levels.size());
    stages::tight_boxes(test::executor(), on_boxes, skeleton, test::upload(leaf_offsets),
                        test::upload(references), nodes);
    return listed.download();
  }
};

TEST(StageFinish, WritesAsManyReferencesAsFit) {
  const Small in;
  EXPECT_EQ(in.finish(1), std::vector<std::uint32_t>({0}));
  EXPECT_EQ(in.finish(3), std::vector<std::uint32_t>({0, 1, 77}));
}

TEST(StageFinish, IndicesOutOfRangeAreRefused) {
  struct Case {
    const char* what;
    std::function<void(Small&)> spoil;
  };
  const std::vector<Case> cases = {
      {"ids", [](Small& s) { s.ids[1] = 2; }},
      {"children", [](Small& s) { s.children[1] = Link::leaf(2); }},
      {"children", [](Small& s) { s.children[1] = Link::node(1); }},
      {"children", [](Small& s) { s.children[0] = Link{}; }},
      {"root", [](Small& s) { s.root = Link::node(1); }},
      {"root", [](Small& s) { s.root = Link::leaf(2); }},
      {"axes", [](Small& s) { s.axes[0] = 3; }},
      {"first", [](Small& s) { s.first[0] = 1; }},
      {"first", [](Small& s) { s.first[1] = 2; }},
      {"first", [](Small& s) { s.first[1] = 0; }},
      {"leaf_offsets",
       [](Small& s) {
         s.leaf_offsets = {0, 2, 1};
       }},
      {"leaf_offsets",
       [](Small& s) {
         s.leaf_offsets = {1, 1, 2};
       }},
      {"leaf_offsets",
       [](Small& s) {
         s.leaf_offsets = {0, 1, 3};
       }},
      {"references", [](Small& s) { s.references[0] = 2; }},
  };
  EXPECT_NO_THROW((void)Small{}.finish(2));
  for (const Case& c : cases) {
    Small spoiled;
    c.spoil(spoiled);
    try {
      (void)spoiled.finish(2);
      ADD_FAILURE() << c.what << ": taken, case " << &c - cases.data();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::invalid_view);
      EXPECT_EQ(std::string(error.what()).rfind(c.what, 0), 0u) << error.what();
    }
  }
}

TEST(StageFinish, LengthsThatDisagreeAreRefused) {
  for (const auto& spoil : std::vector<std::function<void(Small&)>>{
           [](Small& s) { s.boxes.pop_back(); }, [](Small& s) { s.levels.push_back(0); },
           [](Small& s) { s.children.pop_back(); }, [](Small& s) { s.axes.clear(); },
           [](Small& s) { s.planes.push_back(0); }, [](Small& s) { s.leaf_offsets.pop_back(); }}) {
    Small spoiled;
    spoil(spoiled);
    EXPECT_THROW((void)spoiled.finish(2), Error);
  }
}

}  // namespace
}  // namespace zkd
