// SPDX-License-Identifier: Apache-2.0
//
// What both builders by surface area (Builder::sah, Builder::wu2011) are tested with.
#pragma once

#include <vector>

#include <zkd/options.hpp>

#include "scene/generate.hpp"
#include "support/meshes.hpp"

namespace zkd::test {

inline BuildOptions sah_options(Builder builder, const SahOptions& sah = {}) {
  BuildOptions options;
  options.builder = builder;
  options.sah = sah;
  options.invalid_triangles = InvalidTriangles::skip;
  options.measure_quality = true;
  return options;
}

/// Costs and areas that make small and large leaves, and empty ones.
inline std::vector<SahOptions> sah_weights() {
  return {{},
          {.test_cost = 1.0F},
          {.test_cost = 0.25F},
          {.visit_cost = 0.5F, .test_cost = 3.0F},
          {.areas = SahAreas::cells},
          {.areas = SahAreas::cells, .empty_bonus = 0.5F}};
}

/// So large that passes over a level, or over a generation, are divided among threads.
inline std::vector<NamedMesh> large_sah_meshes() {
  std::vector<NamedMesh> all;
  all.push_back({"soup", scene::soup(10000, 3)});
  all.push_back({"sphere", scene::sphere(5)});
  all.push_back({"stadium", scene::small_in_large(10000, 1e4F, 3)});
  all.push_back({"grid", scene::grid(14)});
  return all;
}

}  // namespace zkd::test
