// SPDX-License-Identifier: Apache-2.0
//
// Rows 25 to 29: surfaces that meet in many triangles, coincide, or nearly do.
#include <algorithm>
#include <string>
#include <utility>

#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "scene/hard_rays.hpp"
#include "scene/random.hpp"
#include "stress/case.hpp"
#include "verify/hits.hpp"

namespace zkd::stress {
namespace {

using scene::Mesh;
using scene::Random;

std::vector<BuildOptions> some_options(const Setting& setting) {
  return setting.size == Size::small ? many_options() : once_and_all();
}

// A ray through the top of a cone meets all of its triangles, exactly: that takes the oracle long.
std::uint32_t few_where_many(std::uint32_t triangles) {
  return triangles > 100 ? 10000 / std::min(triangles, 1000u) : 0;
}

// Through the top of the cone, from inside it or from above: from points round the axis, which are
// within the cone of any number of triangles.
Case top_of_fan(std::uint32_t triangles, const Setting& setting) {
  Case made = hard_case("the top of " + std::to_string(triangles), scene::fan(triangles),
                        triangles > 100000 ? only_once() : once_and_all(),
                        setting.pick(triangles > 1000 ? 100u : 400u, 1000u));
  made.rays = [](const Mesh& mesh, const TreeView&, std::uint32_t count, std::uint64_t seed) {
    Random random(seed);
    std::vector<Ray> rays;
    for (std::uint32_t i = 0; i < count; ++i) {
      glm::vec3 from = 0.0625F * random.in_cube();
      from.z = (i % 2 == 0 ? 0.0F : 1.0F) + 0.0625F * random.unit();
      rays.push_back(scene::ray_between(from, mesh.positions[0]));
    }
    return rays;
  };
  made.hits = Case::Hits::all;
  made.oracle_rays = few_where_many(triangles);
  return made;
}

void fans(const Setting& setting, const Yield& yield) {
  for (const std::uint32_t triangles :
       {4u, 5u, 64u, setting.pick(300u, 1000u), setting.pick(1000u, 30000u),
        setting.pick(2500u, 1000000u)}) {
    yield(top_of_fan(triangles, setting));
    Case made =
        hard_case("all of " + std::to_string(triangles), scene::fan(triangles),
                  triangles > 100000 ? only_once() : some_options(setting),
                  triangles > 10000 ? 100 : setting.pick(triangles > 1000 ? 150u : 600u, 1000u));
    made.oracle_rays = few_where_many(triangles);
    yield(std::move(made));
  }
}

void many_on_an_edge(const Setting& setting, const Yield& yield) {
  for (const std::uint32_t pages : {3u, 4u, 23u, setting.pick(300u, 5000u)}) {
    Mesh mesh = scene::book(pages);
    Case made = hard_case(std::to_string(pages) + " triangles", mesh, some_options(setting), 900);
    yield(std::move(made));

    Case spine = hard_case("the edge of " + std::to_string(pages), std::move(mesh), once_and_all(),
                           setting.pick(600u, 4000u));
    spine.rays = [](const Mesh&, const TreeView&, std::uint32_t count, std::uint64_t seed) {
      Random random(seed);
      std::vector<Ray> rays;
      for (std::uint32_t i = 0; i < count; ++i) {
        const glm::vec3 to = {0.0F, 0.0F, random.between(-1.0F, 1.0F)};
        rays.push_back(scene::ray_between(3.0F * random.in_cube(), to));
      }
      return rays;
    };
    yield(std::move(spine));
  }
}

// Pairs in one plane that overlap without being equal, and the same once more an ulp away.
Mesh fighting_pairs(std::uint32_t count, int ulps_apart, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto at = [&](int most) { return static_cast<float>(random.integer(-most, most)); };
    const glm::vec3 corner = {at(8), at(8), at(8)};
    const glm::vec3 e = {at(2), at(2), at(2)};
    const glm::vec3 f = {at(2), at(2), at(2)};
    const glm::vec3 places[] = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {2, 2, 0}};
    for (const glm::uvec3& of : {glm::uvec3(0, 1, 2), glm::uvec3(1, 3, 0)}) {
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (int c = 0; c < 3; ++c) {
        const glm::vec3& place = places[of[c]];
        glm::vec3 p = corner + place.x * e + place.y * f;
        if (of.x == 1) p.z = scene::ulps(p.z, ulps_apart);
        mesh.positions.push_back(p);
      }
      mesh.faces.emplace_back(first, first + 1, first + 2);
    }
  }
  return mesh;
}

void duplicates(const Setting& setting, const Yield& yield) {
  const std::uint32_t count = setting.pick(100u, 20000u);
  const Mesh once = scene::soup(count, setting.seed);
  Mesh thrice = scene::joined(scene::joined(once, once), once);
  Case equal = hard_case("duplicates", std::move(thrice), some_options(setting),
                         setting.pick(1800u, 10000u));
  equal.also = [count](const Traced& traced, Findings& findings) {
    for (const Hit& hit : traced.hits) {
      findings.expect(!verify::is_hit(hit) || hit.triangle < count,
                      "a copy was taken instead of the lowest id");
    }
  };
  yield(std::move(equal));
  for (const int apart : {0, 1, 2}) {
    yield(hard_case("pairs in a plane, " + std::to_string(apart) + " ulp apart",
                    fighting_pairs(count, apart, setting.seed), some_options(setting),
                    setting.pick(1800u, 10000u)));
  }
}

void nested_shells(const Setting& setting, const Yield& yield) {
  for (const int steps : {1, 2, 3, 10, 30, 100}) {
    yield(hard_case(std::to_string(steps) + " ulp apart",
                    scene::nested_shells(setting.pick(4, 40), steps), some_options(setting),
                    setting.pick(1200u, 10000u)));
  }
}

// Cells whose right neighbours have a vertex in the middle of the edge they share, rounded onto it.
Mesh t_junctions(std::uint32_t side, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  const auto add = [&](const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.faces.emplace_back(first, first + 1, first + 2);
  };
  std::vector<glm::vec3> corners((side + 1) * (side + 1));
  for (std::uint32_t y = 0; y <= side; ++y) {
    for (std::uint32_t x = 0; x <= side; ++x) {
      corners[y * (side + 1) + x] =
          glm::vec3(static_cast<float>(x), static_cast<float>(y), 0.0F) + 0.3F * random.in_cube();
    }
  }
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      const glm::vec3& a = corners[y * (side + 1) + x];
      const glm::vec3& b = corners[y * (side + 1) + x + 1];
      const glm::vec3& c = corners[(y + 1) * (side + 1) + x];
      const glm::vec3& d = corners[(y + 1) * (side + 1) + x + 1];
      const glm::vec3 middle =
          a + random.unit() * (c - a);  // the cell to the left has no vertex there
      add(a, b, middle);
      add(middle, b, d);
      add(middle, d, c);
    }
  }
  return mesh;
}

void junctions(const Setting& setting, const Yield& yield) {
  for (std::uint64_t i = 0; i < setting.pick(3u, 10u); ++i) {
    yield(hard_case("sheet " + std::to_string(i),
                    t_junctions(setting.pick(10u, 60u), 1000 * setting.seed + i),
                    some_options(setting), setting.pick(1800u, 10000u)));
  }
}

}  // namespace

std::vector<Row> surface_rows() {
  return {{25, "closed fan round a vertex", fans},
          {26, "many triangles on an edge", many_on_an_edge},
          {27, "duplicates and z-fighting pairs", duplicates},
          {28, "nested shells", nested_shells},
          {29, "T-junctions", junctions}};
}

}  // namespace zkd::stress
