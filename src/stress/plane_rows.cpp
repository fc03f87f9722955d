// SPDX-License-Identifier: Apache-2.0
//
// Rows 18 to 21: triangles on, beside and across the planes that a lattice would use.
#include <bit>
#include <limits>
#include <string>
#include <utility>

#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "scene/random.hpp"
#include "stress/case.hpp"

namespace zkd::stress {
namespace {

using scene::Mesh;
using scene::Random;

std::vector<BuildOptions> some_options(const Setting& setting) {
  return setting.size == Size::small ? many_options() : once_and_all();
}

void walls_on_planes(const Setting& setting, const Yield& yield) {
  for (const std::uint32_t cells : {1u, 2u, 4u, setting.pick(5u, 32u)}) {
    yield(hard_case(std::to_string(cells) + " cells a side", scene::grid(cells),
                    some_options(setting), setting.pick(1800u, 6000u)));
  }
}

// A grid whose walls lie at k * size + offset, rounded: near the planes of a lattice, on few.
void planes_off_by_rounding(const Setting& setting, const Yield& yield) {
  for (const float size : {0.1F, 1.0F / 3.0F, 0.7F, 1.0F + 0x1p-23F}) {
    for (const float by : {0.0F, -0.3F, 1000.1F}) {
      Mesh mesh = scene::grid(setting.pick(3u, 20u));
      for (glm::vec3& p : mesh.positions) {
        for (int a = 0; a < 3; ++a) p[a] = 8.0F * p[a] * size + by;
      }
      yield(hard_case("cells of " + std::to_string(size) + " from " + std::to_string(by),
                      std::move(mesh), some_options(setting), setting.pick(900u, 6000u)));
    }
  }
}

// Every coordinate a whole number of cells, and up to an ulp beside it.
void vertices_beside_planes(const Setting& setting, const Yield& yield) {
  for (const std::uint32_t cells : {2u, 8u, 64u}) {
    Random random(setting.seed + cells);
    Mesh mesh = scene::soup(setting.pick(300u, 20000u), setting.seed);
    const auto side = static_cast<float>(cells);
    for (glm::vec3& p : mesh.positions) {
      for (int a = 0; a < 3; ++a) {
        const auto cell = static_cast<float>(static_cast<int>(p[a] * side + 0.5F));
        p[a] = scene::ulps(cell / side, random.integer(-1, 1));
      }
    }
    Case made = hard_case(std::to_string(cells) + " cells a side", std::move(mesh),
                          some_options(setting), setting.pick(1800u, 4000u));
    made.oracle_rays = setting.pick(0u, 1000u);
    yield(std::move(made));
  }
}

// Coordinates that are 0, one smallest float off on either side, or far away.
void straddling_zero(const Setting& setting, const Yield& yield) {
  for (const std::uint32_t far : {1u, 2u, 4u}) {  // one coordinate in so many
    for (const float size : {1.0F, 0x1p-100F, 0x1p+60F}) {
      Random random(setting.seed + far);
      Mesh mesh = scene::soup(setting.pick(200u, 10000u), setting.seed);
      for (glm::vec3& p : mesh.positions) {
        for (int a = 0; a < 3; ++a) {
          p[a] = random.one_in(far) ? size * (2.0F * p[a] - 1.0F)
                                    : std::numeric_limits<float>::denorm_min() *
                                          static_cast<float>(random.integer(-1, 1));
        }
      }
      if (far == 1) {  // whole triangles between -1.4e-45 and 1.4e-45 on one axis
        for (const glm::uvec3& face : mesh.faces) {
          const int axis = random.integer(0, 2);
          for (int corner = 0; corner < 3; ++corner) {
            mesh.positions[face[corner]][axis] = std::numeric_limits<float>::denorm_min() *
                                                 static_cast<float>(random.integer(-1, 1));
          }
        }
      }
      Case made = hard_case("one far in " + std::to_string(far) + ", size " + std::to_string(size),
                            std::move(mesh), some_options(setting), setting.pick(900u, 2000u));
      made.oracle_rays = setting.pick(0u, 500u);
      yield(std::move(made));
    }
  }
}

}  // namespace

std::vector<Row> plane_rows() {
  return {{18, "walls on cell planes", walls_on_planes},
          {19, "planes off by rounding", planes_off_by_rounding},
          {20, "vertices at a plane +-1 ulp", vertices_beside_planes},
          {21, "straddling 0 by 1.4e-45", straddling_zero}};
}

}  // namespace zkd::stress
