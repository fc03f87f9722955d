// SPDX-License-Identifier: Apache-2.0
//
// What a run of zkd-accuracy found out: plain data between measuring and telling.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "brute_force.hpp"
#include "curves.hpp"
#include "leaks.hpp"
#include "options.hpp"
#include "output_file.hpp"
#include "results.hpp"
#include "trees.hpp"

namespace zkd::bench::accuracy {

/// How fast the exact oracle answered one set of rays.
struct OracleSpeed {
  std::string scene;
  std::string rays;  ///< kind
  std::uint64_t count = 0;
  double seconds = 0.0;  ///< of all threads together
};

/// E1, E2 and E4 of one intersector or peer, over all scenes.
struct ErrorsOf {
  std::string name;
  std::string rays;  ///< "workload" or "adversarial"
  bool peer = false;
  Score score;
  std::string first_offender;     ///< scene and ray; empty if there is none
  std::string first_above_bound;  ///< likewise
};

struct Report {
  Machine machine;
  std::vector<std::string> scenes;
  std::vector<OracleSpeed> oracle;
  std::vector<Point> points;
  std::vector<ErrorsOf> errors;
  std::optional<TreeAgainstLoops> e3;
  std::optional<Leaks> e5;
  std::vector<TreeQuality> e6;
  std::optional<Determinism> e7;

  /// The scores of `points` that are zkd as it comes or a peer, added to `errors`.
  void add_errors(const std::vector<Point>& of_scene);

  /// Why this run is a failure, in words; empty if every target is met.
  [[nodiscard]] std::vector<std::string> failures() const;
};

/// The whole document, schema 1, indented, with a line end. What is unknown is null.
[[nodiscard]] std::string to_json(const Report& report, const Options& options);

/// For people: 100 columns, a summary line last.
void print(std::ostream& out, const Report& report);

/// The settings that no other beats in both run time and error, for each scene and group of rays;
/// zkd as it comes, the literal tree and Embree always. Markdown.
[[nodiscard]] std::string pareto_table(const Report& report);

/// A document with markers, `<!-- table: begin -->` and `<!-- table: end -->`, or a new file, which
/// gets them. As it was until write().
class TableFile {
 public:
  /// Throws UsageError for a file that cannot be written, or has no markers.
  explicit TableFile(const std::filesystem::path& file);
  /// Puts the table between the markers.
  void write(const std::string& table) const;

 private:
  OutputFile file_;
  std::string before_;
  std::string after_;
};

}  // namespace zkd::bench::accuracy
