// SPDX-License-Identifier: Apache-2.0
//
// The command line of zkd-accuracy, parsed and checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <zkd/options.hpp>

#include "usage_error.hpp"

namespace zkd::bench::accuracy {

/// What can be measured. `errors` is E1, E2 and E4: the same answers, held against the same truth.
/// They come out of the curves, too; without those only the settings they are told for are
/// measured.
enum class Measure { curves, errors, e3, e5, e6, e7 };

struct Options {
  std::vector<std::string> scenes;  ///< names or files; empty: the scenes of the paper
  std::set<Measure> measures;
  std::uint32_t stress = 0;       ///< triangles of the generated scenes; 0: none of them
  unsigned size = 0;              ///< size * size primary rays; as many adversarial ones
  unsigned repeat = 0;            ///< of the curves
  std::uint64_t brute_force = 0;  ///< rays of E3
  std::uint64_t leaks = 0;        ///< rays of E5
  std::uint64_t meshes = 0;       ///< small meshes of E7
  std::uint64_t seed = 1;
  int threads = 0;                       ///< 0: all
  Backend backend = Backend::automatic;  ///< the CPU is always measured; cuda: the device as well
  bool peers = true;
  bool first_scene_only = false;  ///< of the paper's

  std::optional<std::filesystem::path> json;   ///< "-": standard output, and nothing else there
  std::optional<std::filesystem::path> plots;  ///< a folder
  std::optional<std::filesystem::path> table;  ///< Markdown
};

/// Reads the command line. --help and --version print to standard output and return nothing: the
/// program is done.
///
/// Throws UsageError.
[[nodiscard]] std::optional<Options> parse_options(int argc, const char* const* argv);

}  // namespace zkd::bench::accuracy
