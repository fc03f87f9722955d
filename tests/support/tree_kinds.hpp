// SPDX-License-Identifier: Apache-2.0
//
// The kinds of trees that the Morton builder makes.
#pragma once

#include <string>
#include <vector>

#include <zkd/options.hpp>

namespace zkd::test {

/// Options for one tree of every kind, invalid triangles skipped.
inline std::vector<BuildOptions> tree_kinds() {
  std::vector<BuildOptions> kinds;
  for (const Quality quality : {Quality::fast, Quality::balanced}) {
    for (const References references :
         {References::once, References::budget, References::automatic, References::all}) {
      if (quality == Quality::balanced && references == References::automatic) continue;
      BuildOptions options;
      options.quality = quality;
      options.references = references;
      options.invalid_triangles = InvalidTriangles::skip;
      kinds.push_back(options);
    }
  }
  return kinds;
}

inline std::string name_of(const BuildOptions& options) {
  return std::string(to_string(options.references)) + " " + to_string(options.quality);
}

}  // namespace zkd::test
