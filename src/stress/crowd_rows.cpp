// SPDX-License-Identifier: Apache-2.0
//
// Rows 10 to 15: many triangles in one place, in a plane, on a line; small ones far below a cell.
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

// Bounded time, for trees that have nothing to divide: a leaf of all triangles is found, written
// and boxed as others are.
constexpr double crowd_build_limit = 3.0;

// Tests of rays against every triangle of a crowd: few rays are enough.
std::uint32_t crowd_rays(const Setting& setting) { return setting.pick(600u, 100u); }

void identical(const Setting& setting, const Yield& yield) {
  Case made = hard_case("identical", scene::identical(setting.pick(4000u, 1000000u)),
                        once_and_all(), crowd_rays(setting));
  made.oracle_rays = setting.pick(60u, 10u);
  made.build_limit = setting.pick(0.0, crowd_build_limit);
  made.also = [](const Traced& traced, Findings& findings) {
    for (const Hit& hit : traced.hits) {
      findings.expect(!verify::is_hit(hit) || hit.triangle == 0,
                      "triangle " + std::to_string(hit.triangle) + " of equal ones");
    }
  };
  yield(std::move(made));
}

void same_centre(const Setting& setting, const Yield& yield) {
  Case made =
      hard_case("same centre", scene::same_centre(setting.pick(4000u, 1000000u), setting.seed),
                once_and_all(), crowd_rays(setting));
  made.oracle_rays = setting.pick(60u, 20u);
  made.build_limit = setting.pick(0.0, crowd_build_limit);
  yield(std::move(made));
}

void one_plane(const Setting& setting, const Yield& yield) {
  for (int axis = 0; axis < 3; ++axis) {
    Mesh mesh = scene::flat(setting.pick(500u, 200000u), axis, setting.seed);
    yield(hard_case("axis " + std::to_string(axis), std::move(mesh),
                    setting.size == Size::small ? many_options() : once_and_all(),
                    setting.pick(1800u, 4000u)));
  }
}

// Triangles whose centres lie on a line, and lines that are no triangles; and both at a point.
void one_line(const Setting& setting, const Yield& yield) {
  const std::uint32_t count = setting.pick(400u, 100000u);
  for (int axis = 0; axis < 3; ++axis) {
    Mesh line = scene::soup(count, setting.seed);
    for (glm::vec3& p : line.positions) p[axis] = p[(axis + 1) % 3] = 0.25F;
    Case none = hard_case("line along axis " + std::to_string((axis + 2) % 3), std::move(line),
                          once_and_all(), 600);
    none.hits = Case::Hits::none;
    yield(std::move(none));

    Mesh beads = scene::same_centre(count, setting.seed);
    Random random(setting.seed);
    for (const glm::uvec3& face : beads.faces) {
      const float along = static_cast<float>(random.below(4096)) / 16.0F;
      for (int corner = 0; corner < 3; ++corner) beads.positions[face[corner]][axis] += along;
    }
    yield(hard_case("centres along axis " + std::to_string(axis), std::move(beads),
                    setting.size == Size::small ? many_options() : once_and_all(), 1200));
  }
  Mesh point = scene::soup(count, setting.seed);
  for (glm::vec3& p : point.positions) p = glm::vec3(0.5F, -3.0F, 7.0F);
  Case none = hard_case("at a point", std::move(point), once_and_all(), 600);
  none.hits = Case::Hits::none;
  yield(std::move(none));
}

void few_ulps_wide(const Setting& setting, const Yield& yield) {
  for (const float at : {1e6F, -1e6F, 1.0F}) {
    for (int width = 1; width <= 4; ++width) {
      Mesh mesh = scene::few_ulps(setting.pick(200u, 20000u), at, width, setting.seed);
      Case made = hard_case(
          std::to_string(width) + " ulp at " + std::to_string(at), std::move(mesh),
          setting.size == Size::small ? many_options() : only_once(), setting.pick(900u, 600u));
      made.oracle_rays = setting.pick(0u, 100u);
      yield(std::move(made));
    }
  }
}

// The model keeps its place in the unit cube, where floats are fine, and the stadium is round it.
void teapot_in_a_stadium(const Setting& setting, const Yield& yield) {
  for (const float ratio : {1e3F, 1e4F, 1e5F, 1e6F, 1e7F}) {
    Mesh mesh = scene::joined(
        scene::offset(scene::small_in_large(0, ratio, setting.seed), glm::vec3(-0.375F * ratio)),
        scene::soup(setting.pick(2000u, 150000u), setting.seed));
    Case made = hard_case("ratio " + std::to_string(static_cast<int>(ratio)), std::move(mesh),
                          setting.size == Size::small ? once_and_all() : only_once(),
                          setting.pick(1200u, 2000u));
    const Box model{{0, 0, 0}, {1, 1, 1}};
    made.timed_rays = made.timed_even_rays = [model](const Mesh&, const TreeView&,
                                                     std::uint32_t count, std::uint64_t seed) {
      return scene::random_rays(model, count, seed);
    };
    made.build_limit = made.trace_limit = setting.pick(0.0, 2.0);
    yield(std::move(made));
  }
}

}  // namespace

std::vector<Row> crowd_rows() {
  return {{10, "identical triangles", identical},
          {11, "equal centres", same_centre},
          {12, "all in one plane", one_plane},
          {13, "all on a line, at a point", one_line},
          {14, "extent of 1 to 4 ulp", few_ulps_wide},
          {15, "teapot in a stadium", teapot_in_a_stadium}};
}

}  // namespace zkd::stress
