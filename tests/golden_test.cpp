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
     "78a9c7d718615a13f4f202c7b47d7db7", "4b350d68cc899908b46fed11f71e01ff",
     "60d26497548664a212a108f17bfc0d3c"},
    {"Sphere", [] { return scene::sphere(5); }, "8ee8c1074aff066bd88fbe96ea5a274e",
     "7d3199d2cef179ac58f8367f0d56a2f0", "fdaf716465ce870c16d9af47a12c3382",
     "1981dc4e64599a09fe77dcada0335505"},
    {"Grid", [] { return scene::grid(12); }, "16e965475c54676b35351482cf0f633e",
     "739649a3e73a03d0915a9849f16d085a", "16e965475c54676b35351482cf0f633e",
     "ef5f0cf5833432d01d18459330e2a88c"},
    {"Slivers", [] { return scene::slivers(2000, 1e3F, 2); }, "fc4fea2410f571d213dd00ec9ccda4d5",
     "eba0fd2bc1cb839f0b899a3a9875526e", "d8a074416d6d22e7cb055a35ec6c8a3b",
     "3cc129bfb0d51befe84633deb878f2e9"},
    {"Needles", [] { return scene::needles(300, 3); }, "e19a971e3cb5675ed3623388c8cf0411",
     "a89f8c2f9aec242e61b6660146cd0f5a", "664bf4e5c75304b03e9254fdae6703d2",
     "c04f1cce806195d94f2e2374c45b1776"},
    {"Flat", [] { return scene::flat(3000, 1, 4); }, "5fcac21c8862eeb6691a4c0ff3673bc1",
     "fd63c4d78c8a23ec5d0369ec1510bfa8", "820a2a1ed0a5de90a2e3c3908108f20c",
     "1ef2441d762874649ac1a3c971f5f1f7"},
    {"Fan", [] { return scene::fan(1000); }, "8e12dcbaa6d0c168cc9d3a8efd149a82",
     "fd40653c5c87191b3343df8352dd9daf", "09f8770c672ad846892d491d9c0367ff",
     "e68e89f8aceb54a32c3a474fbf6327c9"},
    {"Identical", [] { return scene::identical(1000); }, "2bbf14a0ef07af798b0fe443c92691ee",
     "2bbf14a0ef07af798b0fe443c92691ee", "2bbf14a0ef07af798b0fe443c92691ee",
     "2bbf14a0ef07af798b0fe443c92691ee"},
    {"SameCentre", [] { return scene::same_centre(2000, 5); }, "97ed6634d80b29c255b1b5650b948629",
     "23adddb9d63edc066b4658cb9fce2276", "3276f840a580df36f23dc342a1e32c1a",
     "aafa9bd3abbda71a3d0b156c87b016f0"},
    {"SmallInLarge", [] { return scene::small_in_large(10000, 1e6F, 6); },
     "eabfd2eabf1ce6d22a0ed8992ab49f4b", "5b60f8b8647a1e49725aed3912315df0",
     "1c08be63950018c1c70f3590b9c62fda", "b428e492e04ae9170b7a5e55b9400652"},
    {"Staircase", [] { return scene::staircase(300); }, "ddc4d7b4de252b7ad9d3664cf54b4521",
     "eff7bb6857d69e3ea57e9f08690c7087", "ddc4d7b4de252b7ad9d3664cf54b4521",
     "eed25e98f77856c07202695313129bcb"},
    {"RandomBits", [] { return scene::random_bits(500, 7); }, "9a0a5dbdbd1486301c9275ef1cb00623",
     "52fdd465feba16c8a30876a76e56c108", "cc3302e2c6b5d93d1c09f89e7da418e2",
     "66f9b07021b4765f6049a8041c2bcd1a"},
    {"FarAway",
     [] {
       return scene::offset(scene::soup(3000, 8), {1e6F, -3e5F, 0.0F});
     },
     "74d0672c54e60267d5ba77f456543f35", "ccb9b0315d1ab841076333a579d81cf9",
     "c17af1003a6f51df621a25c6a3b65b0c", "2df4f3430f10791da8fe8954983e9a2d"},
    {"Tiny", [] { return scene::scaled(scene::sphere(3), -130); },
     "406b512e4ffc962a8b912900a08758cd", "040e9d23aa5638da37e2a466ed7ee82f",
     "1eed376109db2d2ab427252954721124", "3a16dc8bcfc2d6e9b7bb31d30e2cd64f"},
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
    for (const References references : {References::once, References::budget, References::all}) {
      const Tree tree = test::build(mesh.view(), {.references = references});
      for (const std::string& violation : verify::check_tree(tree, mesh.view()))
        ADD_FAILURE() << to_string(references) << ": " << violation;
    }
  }
}

}  // namespace
}  // namespace zkd
