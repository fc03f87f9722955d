// SPDX-License-Identifier: Apache-2.0
//
// The settings that run time and error are measured for.
#pragma once

#include <string>
#include <vector>

#include <zkd/options.hpp>
#include <zkd/query.hpp>

#include "walks.hpp"

namespace zkd::bench::accuracy {

/// The name of zkd as it comes.
inline constexpr const char* default_setting = "watertight";

struct Setting {
  std::string family;  ///< which line of the plots it belongs to: "bits", "cuda leaf", ...
  std::string name;    ///< unique: "bits 5", "leaf 8", "naive all", ...
  BuildOptions build;
  Walk walk = Walk::library;
  Intersector intersector = Intersector::watertight;  ///< of the library's walk
  bool cuda = false;                                  ///< on the device; the library's walk only
  bool wide = false;                                  ///< through cpu::WideTree; likewise
};

/// All of them, one family after another; the first is default_setting. With `cuda`, those that a
/// device has follow once more, their names and families beginning with "cuda ".
[[nodiscard]] std::vector<Setting> all_settings(bool cuda);

/// Whether it differs from default_setting, if at all, in intersector and backend alone.
[[nodiscard]] bool is_intersector_setting(const Setting& setting);

}  // namespace zkd::bench::accuracy
