// SPDX-License-Identifier: Apache-2.0
//
// The list of settings.
#include "settings.hpp"

#include <utility>

#include "choices.hpp"

namespace zkd::bench::accuracy {

namespace {

// What a device has too: it knows neither other walks than the library's, nor wide trees, nor the
// exact intersector.
void add_cuda(std::vector<Setting>& settings) {
  const std::vector<Setting> of_cpu = settings;
  for (Setting setting : of_cpu) {
    if (setting.walk != Walk::library || setting.wide || setting.intersector == Intersector::exact)
      continue;
    setting.family = "cuda " + setting.family;
    setting.name = "cuda " + setting.name;
    setting.cuda = true;
    settings.push_back(std::move(setting));
  }
}

}  // namespace

std::vector<Setting> all_settings(bool cuda) {
  BuildOptions base;
  base.invalid_triangles = InvalidTriangles::skip;
  std::vector<Setting> settings;
  const auto add = [&](const char* family, const std::string& name, const BuildOptions& build,
                       Walk walk = Walk::library,
                       Intersector intersector = Intersector::watertight) {
    settings.push_back({family, name, build, walk, intersector});
  };
  const auto add_wide = [&](const std::string& name, const BuildOptions& build,
                            Intersector intersector) {
    settings.push_back({"wide", "wide " + name, build, Walk::library, intersector});
    settings.back().wide = true;
  };

  for (const Intersector intersector : all_intersectors) {
    add("intersector", zkd::to_string(intersector), base, Walk::library, intersector);
  }
  for (const Intersector intersector : all_intersectors) {
    add_wide(zkd::to_string(intersector), base, intersector);
  }
  for (const References references :
       {References::once, References::budget, References::automatic, References::all}) {
    BuildOptions build = base;
    build.references = references;
    add("references", zkd::to_string(references), build);
  }
  {
    BuildOptions build = base;
    build.quality = Quality::balanced;
    build.references = References::automatic;
    add("references", "balanced", build);
    add_wide("balanced", build, Intersector::watertight);
  }
  for (const std::uint32_t bits : {32u, 64u}) {
    BuildOptions build = base;
    build.code_bits = bits;
    add("codes", "codes " + std::to_string(bits), build);
  }
  // Three axes share the bits. Trunks are not coded again: that would hide how few bits there are.
  for (std::uint32_t bits = 5; bits <= 21; ++bits) {
    BuildOptions build = base;
    build.code_bits = 3 * bits;
    build.recode_crowded = false;
    add("bits", "bits " + std::to_string(bits), build);
  }
  for (const std::uint32_t leaf_size : {1u, 2u, 4u, 8u, 16u, 32u}) {
    BuildOptions build = base;
    build.leaf_size = leaf_size;
    add("leaf", "leaf " + std::to_string(leaf_size), build);
  }
  for (const References references : {References::once, References::all}) {
    BuildOptions build = base;
    build.references = references;
    for (const Walk walk : {Walk::naive, Walk::padded, Walk::slab}) {
      add("traversal", std::string(to_string(walk)) + " " + zkd::to_string(references), build,
          walk);
    }
  }
  add("literal", "literal", base, Walk::literal);
  if (cuda) add_cuda(settings);
  return settings;
}

bool is_intersector_setting(const Setting& setting) {
  return setting.family == "intersector" || setting.family == "cuda intersector";
}

}  // namespace zkd::bench::accuracy
