// SPDX-License-Identifier: Apache-2.0
//
// The command line of zkd-bench, parsed and checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <zkd/cpu/executor.hpp>
#include <zkd/options.hpp>
#include <zkd/query.hpp>

#include "results.hpp"
#include "usage_error.hpp"

namespace zkd::bench {

/// Other libraries that can be timed in the same run.
enum class PeerLibrary { embree };

/// "embree". Static storage.
[[nodiscard]] const char* to_string(PeerLibrary value) noexcept;

struct Options {
  std::vector<std::string> scenes;  ///< names or files; empty: the scenes of the paper

  std::vector<BuildOptions> settings;  ///< every combination of the lists given; at least one
  std::vector<Layout> layouts;         ///< for each setting, what rays are traced through
  std::vector<std::string> labels;     ///< for each setting, what tells it from the others

  int threads = 0;  ///< 0: all
  cpu::InstructionSet instructions = cpu::InstructionSet::automatic;
  bool measure_quality = true;

  Intersector intersector = Intersector::watertight;
  std::vector<RayKind> rays;
  unsigned size = 1024;
  std::uint64_t seed = 1;
  unsigned repeat = 5;

  std::vector<PeerLibrary> peers;
  std::uint64_t check = 0;  ///< rays of each kind; 0: no check
  bool cold = false;        ///< time one build in this process, print it as JSON, and nothing else
  unsigned time_limit = 0;  ///< seconds after which no further scene is begun; 0: none

  std::optional<std::filesystem::path> json;  ///< "-": standard output, and no table
  std::optional<std::filesystem::path> images;
  bool stats = false;  ///< counts and histograms of the trees
  bool list = false;
};

/// The flags that give these build options on a command line (--backend aside).
[[nodiscard]] std::vector<std::string> flags_of(const BuildOptions& options);

/// Reads the command line. --help and --version print to standard output and return nothing: the
/// program is done.
///
/// Throws UsageError.
[[nodiscard]] std::optional<Options> parse_options(int argc, const char* const* argv);

}  // namespace zkd::bench
