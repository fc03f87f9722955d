// SPDX-License-Identifier: Apache-2.0
//
// zkd-stress: the stress matrix, a line a row, and an exit status.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <zkd/config.hpp>

#include "command_line.hpp"
#include "exit_status.hpp"
#include "scene/progress.hpp"
#include "stress/run.hpp"

namespace zkd::stress {
namespace {

using bench::UsageError;

struct Options {
  Setting setting;
  std::vector<const Row*> rows;
};

int number_in(std::string_view text, const std::string& list) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw UsageError("--rows: '" + list + "' is not a list such as 1,5-9");
  }
  return number;
}

// Rows named by a list such as 1,5-9.
std::vector<const Row*> rows_listed(const std::string& list) {
  std::vector<const Row*> chosen;
  for (std::string_view rest = list;;) {
    const std::size_t comma = rest.find(',');
    const std::string_view item = rest.substr(0, comma);
    const std::size_t dash = item.find('-');
    const int first = number_in(item.substr(0, dash), list);
    const int last =
        dash == std::string_view::npos ? first : number_in(item.substr(dash + 1), list);
    const std::size_t before = chosen.size();
    for (const Row& row : rows()) {
      if (row.number >= first && row.number <= last) chosen.push_back(&row);
    }
    if (chosen.size() == before) {
      throw UsageError("--rows: there is no row " + std::string(item) + ", only 1 to " +
                       std::to_string(rows().back().number));
    }
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  std::sort(chosen.begin(), chosen.end(),
            [](const Row* a, const Row* b) { return a->number < b->number; });
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

std::optional<Options> parse(int argc, char** argv) {
  CLI::App app{
      "Runs the stress matrix: scenes and rays that break tree builders and traversals, each held\n"
      "to brute force (bit by bit), to exact arithmetic, and to what every tree must fulfil.\n\n"
      "One line a row: its number and name; ok, FAILED or skipped (why); how many cases and rays;\n"
      "answers outside the error band that are missed, phantom or of a wrong triangle; answers in\n"
      "the band; milliseconds for all of it; and the time of the builds and rays (and the memory)\n"
      "against those of an even scene of the same size with random rays.",
      "zkd-stress"};
  bool quick = false;
  std::string list;
  std::int64_t seed = 1;
  std::int64_t threads = 0;
  Options options;
  app.add_flag("--quick", quick, "small scenes: all rows within a minute or two");
  app.add_option("--rows", list, "which rows, such as 1,5-9; all where nothing is said");
  bench::add_whole_number(app, "--seed", seed, "another one makes other scenes and rays", 0,
                          std::int64_t{0x7FFFFFFFFFFFFFFF});
  bench::add_whole_number(app, "--threads", threads, "threads; 0: all", 0, 4096);
  app.set_version_flag("--version", "zkd-stress " ZKD_VERSION);
  app.footer(bench::exit_status_help);
  if (!bench::parse(app, argc, argv)) return std::nullopt;
  options.setting.seed = static_cast<std::uint64_t>(seed);
  options.setting.threads = static_cast<int>(threads);
  options.setting.size = quick ? Size::small : Size::large;
  if (list.empty()) {
    for (const Row& row : rows()) options.rows.push_back(&row);
  } else {
    options.rows = rows_listed(list);
  }
  return options;
}

struct Totals {
  std::uint64_t rows = 0, ok = 0, failed = 0, skipped = 0;
  Findings sum;

  void add(const Report& report) {
    const Findings& f = report.findings;
    ++rows;
    ++(!f.ok() ? failed : f.skipped().empty() ? ok : skipped);
    sum.cases += f.cases;
    sum.rays += f.rays;
    sum.different += f.different;
    sum.in_band += f.in_band;
    sum.outside.missed += f.outside.missed;
    sum.outside.phantom += f.outside.phantom;
    sum.outside.wrong_triangle += f.outside.wrong_triangle;
  }
};

void print(const Report& report) {
  std::cout << to_line(report) << '\n';
  for (const std::string& note : report.findings.notes()) std::cout << "    note: " << note << '\n';
  for (const std::string& failure : report.findings.failures()) {
    std::cout << "    " << failure << '\n';
  }
  const std::uint64_t more = report.findings.failure_count() - report.findings.failures().size();
  if (more > 0) std::cout << "    and " << more << " failures more\n";
  std::cout << std::flush;
}

int run(const Options& options) {
  const auto start = std::chrono::steady_clock::now();
  Totals totals;
  for (const Row* row : options.rows) {
    Report report;
    {
      const std::string label = "row " + std::to_string(row->number) + ", " + row->name + ": ";
      std::optional<scene::Progress> progress;
      report = run_row(*row, options.setting,
                       [&](const std::string& name) { progress.emplace(label + name, 0); });
    }
    print(report);
    totals.add(report);
  }
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  char seconds[32];
  std::snprintf(seconds, sizeof seconds, "%.1f", time.count());
  const Findings& sum = totals.sum;
  std::cout << "in all: rows " << totals.rows << ", ok " << totals.ok << ", failed "
            << totals.failed << ", skipped " << totals.skipped << "; cases " << sum.cases
            << ", rays " << sum.rays << ", different from brute force " << sum.different
            << ", missed " << sum.outside.missed << ", phantom " << sum.outside.phantom
            << ", wrong " << sum.outside.wrong_triangle << ", in_band " << sum.in_band << "; "
            << seconds << " s, seed " << options.setting.seed << std::endl;
  return totals.failed > 0 ? bench::check_failed : bench::done;
}

}  // namespace
}  // namespace zkd::stress

int main(int argc, char** argv) {
  return zkd::bench::exit_status_of("zkd-stress", [&]() -> int {
    const std::optional<zkd::stress::Options> options = zkd::stress::parse(argc, argv);
    return options ? zkd::stress::run(*options) : zkd::bench::done;
  });
}
