// SPDX-License-Identifier: Apache-2.0
//
// Trees that never change: hashes of generated scenes, pinned. They are the same on every machine,
// compiler and backend; the scenes are made of integers and correctly rounded operations alone
// (scene/generate.hpp). A change of the format or of the algorithm changes them knowingly: then a
// failing test prints what to put here, and the properties of the new trees say whether it may.
#include <gtest/gtest.h>

#include <cstdint>
#include <ostream>
#include <string>

#include <zkd/options.hpp>
#include <zkd/tree.hpp>

#include "scene/generate.hpp"
#include "support/platform_tree.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd {
namespace {

struct Golden {
  const char* name;
  scene::Mesh (*make)();
  const char* once;
  const char* all;
  const char* budget;
  const char* balanced;  ///< and budget
};

void PrintTo(const Golden& golden, std::ostream* out) { *out << golden.name; }

const Golden goldens[] = {
    {"Soup", [] { return scene::soup(20000, 1); }, "1fcb3efccc2f6161496505d512667edf",
     "7a29789f40e441558e74aeb2370ff988", "BUDGET", "BALANCED"},
    {"Sphere", [] { return scene::sphere(5); }, "8ee8c1074aff066bd88fbe96ea5a274e",
     "01bdca89848ada207f79c676992c0cc4", "BUDGET", "BALANCED"},
    {"Grid", [] { return scene::grid(12); }, "16e965475c54676b35351482cf0f633e",
     "02136f09163f94c592e6139ca66f52a3", "BUDGET", "BALANCED"},
    {"Slivers", [] { return scene::slivers(2000, 1e3F, 2); }, "fc4fea2410f571d213dd00ec9ccda4d5",
     "2a248748393a706d00e7f2390989b640", "BUDGET", "BALANCED"},
    {"Needles", [] { return scene::needles(300, 3); }, "e19a971e3cb5675ed3623388c8cf0411",
     "1f8cb4c08917c2a2d421a534bfbde26b", "BUDGET", "BALANCED"},
    {"Flat", [] { return scene::flat(3000, 1, 4); }, "5fcac21c8862eeb6691a4c0ff3673bc1",
     "461cf939dfdc2797fae95d0ce18e5883", "BUDGET", "BALANCED"},
    {"Fan", [] { return scene::fan(1000); }, "8e12dcbaa6d0c168cc9d3a8efd149a82",
     "5b9e91864bd24e929a7f045f3e702ac3", "BUDGET", "BALANCED"},
    {"Identical", [] { return scene::identical(1000); }, "2bbf14a0ef07af798b0fe443c92691ee",
     "2bbf14a0ef07af798b0fe443c92691ee", "BUDGET", "BALANCED"},
    {"SameCentre", [] { return scene::same_centre(2000, 5); }, "97ed6634d80b29c255b1b5650b948629",
     "97ed6634d80b29c255b1b5650b948629", "BUDGET", "BALANCED"},
    {"SmallInLarge", [] { return scene::small_in_large(10000, 1e6F, 6); },
     "eabfd2eabf1ce6d22a0ed8992ab49f4b", "b9c44c5bc2114d2520d4f4b92e59a59a", "BUDGET", "BALANCED"},
    {"Staircase", [] { return scene::staircase(300); }, "ddc4d7b4de252b7ad9d3664cf54b4521",
     "eff7bb6857d69e3ea57e9f08690c7087", "BUDGET", "BALANCED"},
    {"RandomBits", [] { return scene::random_bits(500, 7); }, "9a0a5dbdbd1486301c9275ef1cb00623",
     "5035a17d3ab44aaabce9dc8efc9c17db", "BUDGET", "BALANCED"},
    {"FarAway",
     [] {
       return scene::offset(scene::soup(3000, 8), {1e6F, -3e5F, 0.0F});
     },
     "74d0672c54e60267d5ba77f456543f35", "1a82282dd1879f2ce7f8477efa779f0d", "BUDGET", "BALANCED"},
    {"Tiny", [] { return scene::scaled(scene::sphere(3), -130); },
     "406b512e4ffc962a8b912900a08758cd", "6de3717672e2bb9ec39a730e916ae06a", "BUDGET", "BALANCED"},
};

class GoldenTrees : public testing::TestWithParam<Golden> {};

TEST_P(GoldenTrees, HaveTheirHash) {
  const Golden& golden = GetParam();
  const scene::Mesh mesh = golden.make();
  const auto expect = [&](const char* hash, References references, Quality quality) {
    const Tree tree = test::build(mesh.view(), {.quality = quality,
                                                .references = references,
                                                .invalid_triangles = InvalidTriangles::skip});
    EXPECT_EQ(verify::tree_hash(tree.view()), hash)
        << to_string(references) << ' ' << to_string(quality);
  };
  expect(golden.once, References::once, Quality::fast);
  expect(golden.all, References::all, Quality::fast);
  expect(golden.budget, References::budget, Quality::fast);
  expect(golden.balanced, References::budget, Quality::balanced);
}

INSTANTIATE_TEST_SUITE_P(Every, GoldenTrees, testing::ValuesIn(goldens),
                         [](const auto& golden) { return std::string(golden.param.name); });

// What a hash stands for is a right tree.
TEST(GoldenTree, TwoAreRight) {
  for (const scene::Mesh& mesh : {goldens[1].make(), goldens[9].make()}) {
    for (const References references : {References::once, References::all}) {
      const Tree tree = test::build(mesh.view(), {.references = references});
      for (const std::string& violation : verify::check_tree(tree, mesh.view()))
        ADD_FAILURE() << to_string(references) << ": " << violation;
    }
  }
}

}  // namespace
}  // namespace zkd
