// SPDX-License-Identifier: Apache-2.0
//
// Rows 1 to 9: nothing, next to nothing, and what should not be there.
#include <algorithm>
#include <bit>
#include <limits>
#include <string>
#include <utility>

#include <zkd/build.hpp>
#include <zkd/query.hpp>

#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "scene/random.hpp"
#include "stress/case.hpp"
#include "verify/exact.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::stress {
namespace {

using scene::Mesh;
using scene::Random;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
constexpr float largest = std::numeric_limits<float>::max();

BuildOptions strict() { return {.invalid_triangles = InvalidTriangles::error}; }

// Every tree of the case is that of the other triangles alone, with their ids.
void same_without(const std::vector<bool>& left_out, const Traced& traced, Findings& findings) {
  std::vector<std::uint32_t> ids;
  const Mesh rest = without(traced.of.mesh, left_out, ids);
  for (std::size_t i = 0; i < traced.trees.size(); ++i) {
    const Tree alone = build(rest.view(), traced.of.options[i]);
    findings.expect(verify::tree_hash_mapped(traced.trees[i]->view(), {}) ==
                        verify::tree_hash_mapped(alone.view(), ids),
                    "not the tree of the valid triangles alone");
  }
}

std::vector<bool> invalid_triangles(const Mesh& mesh) {
  std::vector<bool> invalid(mesh.faces.size());
  for (std::size_t i = 0; i < invalid.size(); ++i) {
    invalid[i] = !verify::valid_triangle(mesh.view(), i);
  }
  return invalid;
}

std::uint64_t first_not_finite(const Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
    if (!verify::finite_corners(mesh.view(), i)) return i;
  }
  return mesh.faces.size();
}

// By default an error that names the first; on request skipped and counted, the others unchanged.
Case not_finite_case(std::string name, Mesh mesh, std::vector<BuildOptions> options,
                     std::uint32_t ray_count) {
  Case made = hard_case(std::move(name), std::move(mesh), std::move(options), ray_count);
  made.also = [](const Traced& traced, Findings& findings) {
    const Mesh& of = traced.of.mesh;
    const std::uint64_t first = first_not_finite(of);
    if (first < of.faces.size()) {
      expect_error(findings, "InvalidTriangles::error", ErrorCode::non_finite_vertex, first,
                   [&] { (void)build(of.view(), strict()); });
    }
    std::uint64_t not_finite = 0;
    for (std::size_t i = 0; i < of.faces.size(); ++i) {
      not_finite += verify::finite_corners(of.view(), i) ? 0 : 1;
    }
    for (const Tree* tree : traced.trees) {
      findings.expect(tree->statistics().skipped_non_finite == not_finite,
                      "invalid triangles are not all counted");
    }
    same_without(invalid_triangles(of), traced, findings);
  };
  return made;
}

void expect_empty(const Traced& traced, Findings& findings) {
  for (const Tree* tree : traced.trees) {
    findings.expect(tree->view().empty() && tree->view().leaf_count() == 0, "a tree of something");
  }
}

// ---- 1 to 3 -------------------------------------------------------------------------------------

void empty_mesh(const Setting& setting, const Yield& yield) {
  Mesh lonely;
  lonely.positions = {{0, 0, 0}, {1, 2, 3}};
  for (Mesh& mesh : std::vector<Mesh>{Mesh{}, lonely}) {
    Case made = hard_case(mesh.positions.empty() ? "nothing" : "positions, no triangle",
                          std::move(mesh), many_options(), setting.pick(3000u, 60000u));
    made.hits = Case::Hits::none;
    made.also = expect_empty;
    yield(std::move(made));
  }
}

void few_triangles(const Setting& setting, const Yield& yield, std::uint32_t count) {
  const std::uint64_t meshes = setting.pick(12u, 200u);
  for (std::uint64_t i = 0; i < meshes; ++i) {
    const std::uint64_t seed = 1000 * setting.seed + i;
    Random random(seed);
    Mesh mesh = i % 4 == 0   ? scene::soup(count, seed)
                : i % 4 == 1 ? scene::slivers(count, 1e4F, seed)
                : i % 4 == 2 ? scene::identical(count)
                             : scene::offset(scene::soup(count, seed), random.point(-1e5F, 1e5F));
    if (i % 8 == 0 && count == 2) {  // an edge in common
      mesh.faces[1].x = mesh.faces[0].y;
      mesh.faces[1].y = mesh.faces[0].x;
    }
    Case made = hard_case("mesh " + std::to_string(i), std::move(mesh), many_options(), 600);
    if (count == 1) {
      made.also = [](const Traced& traced, Findings& findings) {
        for (const Tree* tree : traced.trees) {
          findings.expect(tree->view().leaf_count() == 1 && tree->nodes().empty(), "not one leaf");
        }
      };
    }
    yield(std::move(made));
  }
}

void one_triangle(const Setting& setting, const Yield& yield) { few_triangles(setting, yield, 1); }
void two_triangles(const Setting& setting, const Yield& yield) { few_triangles(setting, yield, 2); }

// ---- 4 to 7 -------------------------------------------------------------------------------------

void all_nan(const Setting& setting, const Yield& yield) {
  for (const std::uint32_t count : {1u, 2u, 300u, setting.pick(5000u, 1000000u)}) {
    Mesh mesh = scene::soup(count, setting.seed);
    for (glm::vec3& p : mesh.positions) p = glm::vec3(nan_value);
    Case made = not_finite_case(std::to_string(count) + " triangles", std::move(mesh),
                                once_and_all(), setting.pick(400u, 20000u));
    made.hits = Case::Hits::none;
    made.also = [rest = made.also](const Traced& traced, Findings& findings) {
      rest(traced, findings);
      expect_empty(traced, findings);
    };
    yield(std::move(made));
  }
}

void one_nan(const Setting& setting, const Yield& yield) {
  const std::uint32_t count = setting.pick(3000u, 1000000u);
  Random random(setting.seed);
  for (const std::uint32_t which : {0u, count - 1, random.below(count)}) {
    Mesh mesh = scene::soup(count, setting.seed);
    mesh.positions[mesh.faces[which][random.integer(0, 2)]][random.integer(0, 2)] = nan_value;
    yield(not_finite_case("triangle " + std::to_string(which), std::move(mesh),
                          setting.size == Size::small ? many_options() : only_once(),
                          setting.pick(1500u, 20000u)));
  }
}

void large_values(const Setting& setting, const Yield& yield) {
  const std::uint32_t count = setting.pick(400u, 20000u);
  for (const float value : {infinity, -infinity, 1e30F, -1e30F, largest, -largest}) {
    for (const std::uint32_t every : {7u, 1u}) {  // 1: nothing but
      Random random(setting.seed);
      Mesh mesh = scene::soup(every == 1 ? count / 4 : count, setting.seed);
      for (std::uint32_t i = 0; i < mesh.faces.size(); i += every) {
        for (int corner = 0; corner < 3; ++corner) {
          if (every != 1 && random.one_in(2)) continue;
          const float sign = random.one_in(2) ? 1.0F : -1.0F;
          mesh.positions[mesh.faces[i][corner]][random.integer(0, 2)] = sign * value;
        }
      }
      yield(not_finite_case(std::to_string(value) + " in one of " + std::to_string(every),
                            std::move(mesh),
                            setting.size == Size::small ? once_and_all() : only_once(), 1500));
    }
  }
}

void random_bits(const Setting& setting, const Yield& yield) {
  for (std::uint64_t i = 0; i < setting.pick(6u, 60u); ++i) {
    const std::uint64_t seed = 1000 * setting.seed + i;
    yield(not_finite_case("floats " + std::to_string(i), scene::random_bits(300, seed),
                          many_options(), 900));
  }
  yield(not_finite_case("many floats",
                        scene::random_bits(setting.pick(3000u, 300000u), setting.seed), only_once(),
                        300));
  yield(own_case("indices", [](const Setting& of, Findings& findings) {
    for (std::uint64_t i = 0; i < of.pick(200u, 5000u); ++i) {
      Random random(1000 * of.seed + i);
      Mesh mesh = scene::random_bits(1 + random.below(400), random.bits64());
      std::uint64_t first = mesh.faces.size();
      for (std::size_t k = mesh.faces.size(); k-- > 0;) {
        if (random.one_in(3)) {
          mesh.faces[k][random.integer(0, 2)] = random.bits32() >> random.below(32);
        }
        const glm::uvec3& face = mesh.faces[k];
        if (std::max({face.x, face.y, face.z}) >= mesh.positions.size()) first = k;
      }
      if (first == mesh.faces.size()) {
        (void)build(mesh.view(), with(References::once));
        continue;
      }
      for (const BuildOptions& options : {with(References::all), strict()}) {
        expect_error(findings, "indices " + std::to_string(i), ErrorCode::index_out_of_range, first,
                     [&] { (void)build(mesh.view(), options); });
      }
    }
  }));
}

// ---- 8, 9 ---------------------------------------------------------------------------------------

void index_past_the_end(const Setting& setting, const Yield& yield) {
  yield(own_case("indices", [](const Setting& of, Findings& findings) {
    const std::uint32_t count = of.pick(5000u, 1000000u);
    const Mesh good = scene::soup(count, of.seed);
    const auto end = static_cast<std::uint32_t>(good.positions.size());
    Random random(of.seed);
    for (const std::uint32_t bad : {end, end + 1, 0x7FFFFFFFu, 0x80000000u, 0xFFFFFFFFu}) {
      for (int places = 1; places <= 3; ++places) {
        Mesh mesh = good;
        std::uint32_t first = count;
        for (int i = 0; i < places; ++i) {
          const std::uint32_t at = i == 0 && random.one_in(3) ? count - 1 : random.below(count);
          mesh.faces[at][random.integer(0, 2)] = bad;
          first = std::min(first, at);
        }
        for (const InvalidTriangles policy : {InvalidTriangles::error, InvalidTriangles::skip}) {
          for (const int threads : {1, 2, 3}) {
            expect_error(findings, "index " + std::to_string(bad), ErrorCode::index_out_of_range,
                         first, [&] {
                           (void)build(cpu::Executor{.threads = threads}, mesh.view(),
                                       {.invalid_triangles = policy});
                         });
          }
        }
      }
    }
  }));
  (void)setting;
}

// Repeated vertices, and corners on a line, exactly: a + k * step with whole k.
Mesh zero_area(std::uint32_t count, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::vec3 at = {0x1p-8F * static_cast<float>(random.below(256)),
                          0x1p-8F * static_cast<float>(random.below(256)),
                          0x1p-8F * static_cast<float>(random.below(256))};
    const glm::vec3 step = {0x1p-8F * static_cast<float>(random.integer(-4, 4)),
                            0x1p-8F * static_cast<float>(random.integer(-4, 4)),
                            0x1p-8F * static_cast<float>(random.integer(-4, 4))};
    mesh.positions.push_back(at);
    mesh.positions.push_back(at + step);
    mesh.positions.push_back(at + step * static_cast<float>(random.integer(-3, 3)));
    mesh.faces.emplace_back(3 * i, 3 * i + 1, 3 * i + (random.one_in(3) ? 1 : 2));
  }
  return mesh;
}

void no_area(const Setting& setting, const Yield& yield) {
  const std::uint32_t count = setting.pick(1000u, 500000u);
  const auto check = [](const Traced& traced, Findings& findings) {
    const std::vector<bool> invalid = invalid_triangles(traced.of.mesh);
    const auto left_out =
        static_cast<std::uint64_t>(std::count(invalid.begin(), invalid.end(), true));
    for (const Tree* tree : traced.trees) {
      findings.expect(tree->statistics().skipped_zero_area == left_out, "not all are counted");
    }
    same_without(invalid, traced, findings);
  };
  Case only = hard_case("nothing else", zero_area(count, setting.seed), once_and_all(), 2000);
  only.hits = Case::Hits::none;
  only.also = [check](const Traced& traced, Findings& findings) {
    check(traced, findings);
    expect_empty(traced, findings);
  };
  yield(std::move(only));
  Mesh mixed = scene::joined(scene::soup(count, setting.seed), zero_area(count, setting.seed));
  Case among = hard_case("among others", scene::shuffled(std::move(mixed), setting.seed),
                         once_and_all(), 2000);
  among.also = check;
  yield(std::move(among));
}

}  // namespace

std::vector<Row> input_rows() {
  return {{1, "empty mesh", empty_mesh},
          {2, "one triangle", one_triangle},
          {3, "two triangles", two_triangles},
          {4, "all vertices NaN", all_nan},
          {5, "one NaN among many", one_nan},
          {6, "Inf, 1e30, FLT_MAX", large_values},
          {7, "random bits", random_bits},
          {8, "index past the end", index_past_the_end},
          {9, "zero area", no_area}};
}

}  // namespace zkd::stress
