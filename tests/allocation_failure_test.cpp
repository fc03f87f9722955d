// SPDX-License-Identifier: Apache-2.0
//
// Allocation number 1, 2, 3, ... fails, alone or with all that follow, in what takes its memory
// from operator new: the loaders, the oracle, the tree's properties and hash. Each time one error,
// nothing is lost, and the next try succeeds. (Builds take theirs from a resource: see
// tree_memory_test.cpp. glTF is left out: the destructor of nlohmann::json takes memory, and ends
// the program where there is none.)
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <new>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "scene/generate.hpp"
#include "scene/load.hpp"
#include "scene_files.hpp"
#include "support/mesh_files.hpp"
#include "support/refusing_new.hpp"
#include "verify/band.hpp"
#include "verify/oracle.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::test {
namespace {

// Whether `work` throws nothing but what is allowed when memory fails.
enum class Outcome { done, refused, other };

Outcome outcome(const std::function<void()>& work) {
  try {
    work();
    return Outcome::done;
  } catch (const std::bad_alloc&) {
    return Outcome::refused;
  } catch (const scene::LoadError&) {
    return Outcome::refused;
  } catch (...) {
    return Outcome::other;
  }
}

// Refuses allocation 1, 2, ... of `work`, alone and with all that follow, until it takes no notice.
void expect_every_refusal_is_survived(const std::function<void()>& work) {
  if (ZKD_COUNTS_NEW == 0) GTEST_SKIP() << "a sanitizer has operator new for itself";
  work();  // what is made once stays
  std::size_t tries = 0;
  for (const bool and_all_that_follow : {false, true}) {
    for (std::size_t k = 1;; ++k) {
      ASSERT_LT(k, 100000U) << "so many allocations?";
      const std::size_t before = live_blocks;
      std::size_t calls = 0;
      Outcome result = Outcome::other;
      {
        RefuseNew refuse(k, and_all_that_follow ? RefuseNew::all : k);
        result = outcome(work);
        calls = refuse.calls();
      }
      ASSERT_NE(result, Outcome::other) << "allocation " << k << ": another kind of exception";
      if (calls < k) {
        ASSERT_EQ(result, Outcome::done) << "an error, although nothing was refused";
        break;
      }
      ASSERT_EQ(result, Outcome::refused) << "allocation " << k << " was not missed";
      ASSERT_EQ(live_blocks, before)
          << "lost when allocation " << k << (and_all_that_follow ? " and all that follow" : "")
          << " failed";
      ++tries;
      ASSERT_EQ(outcome(work), Outcome::done) << "the next try, after allocation " << k;
    }
  }
  EXPECT_GT(tries, 1U);
  testing::Test::RecordProperty("refusals", std::to_string(tries));
}

class AllocationFailure : public SceneFiles {
 protected:
  void expect_load_survives(const std::string& name, const std::string& bytes) {
    const std::filesystem::path file = write(name, bytes);
    expect_every_refusal_is_survived([&] { (void)scene::load_mesh(file); });
  }
};

TEST_F(AllocationFailure, NewIsCountedAndRefused) {
  if (ZKD_COUNTS_NEW == 0) GTEST_SKIP() << "a sanitizer has operator new for itself";
  const std::size_t before = live_blocks;
  const RefuseNew refuse(2, 2);
  void* const block = ::operator new(1);
  EXPECT_EQ(live_blocks, before + 1);
  EXPECT_THROW(::operator delete(::operator new(1)), std::bad_alloc);
  ::operator delete(::operator new(1));
  ::operator delete(block);
  EXPECT_EQ(live_blocks, before);
  EXPECT_EQ(refuse.calls(), 3U);
}

TEST_F(AllocationFailure, Obj) {
  expect_load_survives("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2 3/3 -1\nf 1 2 3\n");
}

TEST_F(AllocationFailure, Ply) {
  expect_load_survives("a.ply", ply_header("binary_little_endian", 4, 2) +
                                    ply_body<float, std::uint8_t, std::int32_t, false>());
}

TEST_F(AllocationFailure, Stl) {
  expect_load_survives("a.stl", binary_stl({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}));
}

TEST_F(AllocationFailure, Oracle) {
  const scene::Mesh mesh = scene::sphere(1);
  const std::vector<Ray> rays = scene::rays_at_features(mesh, 8, 1);
  for (const auto search :
       {verify::Oracle::Search::brute_force, verify::Oracle::Search::box_tree}) {
    expect_every_refusal_is_survived([&] {
      const verify::Oracle oracle(mesh.view(), search);
      for (const Ray& ray : rays) {
        (void)oracle.closest_hit(ray);
        (void)oracle.all_hits(ray);
        (void)verify::judge(oracle, mesh.view(), ray, Hit{});
      }
    });
  }
}

TEST_F(AllocationFailure, PropertiesAndHash) {
  const scene::Mesh mesh = scene::sphere(1);
  for (const References references : {References::once, References::all}) {
    const Tree tree = build(mesh.view(), {.references = references});
    expect_every_refusal_is_survived([&] {
      (void)verify::check_tree(tree, mesh.view());
      (void)verify::tree_hash(tree.view());
      (void)verify::tree_hash_mapped(tree.view(), {});
    });
  }
}

}  // namespace
}  // namespace zkd::test
