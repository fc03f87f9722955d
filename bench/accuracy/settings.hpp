// SPDX-License-Identifier: Apache-2.0
//
// The settings that run time and error are measured for.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <zkd/options.hpp>
#include <zkd/query.hpp>

#include "walks.hpp"

namespace zkd::bench::accuracy {

/// The name of zkd as it comes.
inline constexpr const char* default_setting = "watertight";

struct Setting {
  std::string family;  ///< which line of the plots it belongs to: "bits", "codes", "leaf", ...
  std::string name;    ///< unique: "bits 5", "leaf 8", "naive all", ...
  BuildOptions build;
  Walk walk = Walk::library;
  Intersector intersector = Intersector::watertight;  ///< of the library's walk
};

inline constexpr std::array all_intersectors{Intersector::watertight, Intersector::fast,
                                             Intersector::single_precision,
                                             Intersector::double_precision, Intersector::exact};

/// All of them, one family after another; the first is default_setting.
[[nodiscard]] std::vector<Setting> all_settings();

}  // namespace zkd::bench::accuracy
