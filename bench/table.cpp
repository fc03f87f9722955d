// SPDX-License-Identifier: Apache-2.0
//
// Results for people: tables of text.
#include "table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <optional>
#include <string>

#include <zkd/config.hpp>

#include "skips.hpp"
#include "tree_stats.hpp"

namespace zkd::bench {
namespace {

constexpr std::size_t label_width = 15;

// A cell of a table: text, and how wide its column is.
struct Cell {
  std::size_t width;
  std::string text;
};

// Three significant digits where they fit, no exponent; `-` for what is unknown.
std::string number(std::optional<double> value) {
  if (!value || !std::isfinite(*value)) return "-";
  const double size = std::abs(*value);
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", size < 9.995 ? 2 : size < 99.95 ? 1 : 0, *value);
  return text;
}

// The same with one digit more below 10: a build on a GPU takes fractions of a millisecond.
std::string fine(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", value < 9.995 ? 3 : value < 99.95 ? 1 : 0, value);
  return text;
}

std::string count(std::uint64_t value) { return std::to_string(value); }

std::string megabytes(std::uint64_t bytes) { return number(static_cast<double>(bytes) / 1e6); }

std::string right(const std::string& text, std::size_t width) {
  return text.size() >= width ? text : std::string(width - text.size(), ' ') + text;
}

std::string left(const std::string& text, std::size_t width) {
  return text.size() >= width ? text : text + std::string(width - text.size(), ' ');
}

// A label that is too long for its column gets a line of its own.
void print_row(std::ostream& out, const std::string& label, const std::vector<Cell>& cells) {
  std::string row = left(label, label_width);
  if (label.size() > label_width) row += '\n' + left("", label_width);
  for (const Cell& cell : cells) row += ' ' + right(cell.text, cell.width);
  row.erase(row.find_last_not_of(' ') + 1);
  out << row << '\n';
}

std::string label_of(const Result& result) {
  std::string label = result.scene + (result.stand_in ? "*" : "");
  if (!result.setting.empty()) label += " " + result.setting;
  return label;
}

std::string spread(const Spread& ms) {
  if (ms.n == 0) return "-";
  return number(ms.median) + " (" + number(ms.min) + "-" + number(ms.max) + ")";
}

const Trace* find(const Traces& traces, RayKind kind) {
  const auto found = traces.find(kind);
  return found == traces.end() ? nullptr : &found->second;
}

std::optional<double> speed(const Traces& traces, RayKind kind) {
  const Trace* const trace = find(traces, kind);
  return trace == nullptr ? std::nullopt : trace->mrays_per_s();
}

constexpr RayKind all_kinds_of_rays[] = {RayKind::primary, RayKind::diffuse, RayKind::shadow};

void print_main_table(std::ostream& out, const std::vector<Result>& results) {
  print_row(out, "",
            {{9, ""},
             {7, "GTX 580"},
             {8, "zkd"},
             {6, "zkd"},
             {23, "zkd Mrays/s       "},
             {13, "memory, MB "},
             {12, "primary ray "}});
  print_row(out, "scene",
            {{9, "triangles"},
             {7, "ms"},
             {8, "build ms"},
             {6, "Mtri/s"},
             {7, "primary"},
             {7, "diffuse"},
             {7, "shadow"},
             {6, "tree"},
             {6, "work"},
             {6, "visits"},
             {5, "tests"}});
  for (const Result& result : results) {
    const Trace* const primary = find(result.traces, RayKind::primary);
    std::vector<Cell> cells;
    cells.push_back({9, count(result.triangles)});
    cells.push_back({7, result.paper_ms > 0.0 ? number(result.paper_ms) : "-"});
    cells.push_back({8, number(result.build_ms.median)});
    cells.push_back(
        {6, result.build_ms.median > 0.0
                ? number(static_cast<double>(result.triangles) / (1000.0 * result.build_ms.median))
                : "-"});
    for (const RayKind kind : all_kinds_of_rays) {
      cells.push_back({7, number(speed(result.traces, kind))});
    }
    cells.push_back({6, megabytes(result.allocated.tree)});
    cells.push_back({6, megabytes(result.allocated.workspace)});
    cells.push_back({6, number(primary ? primary->node_visits_per_ray : std::nullopt)});
    cells.push_back({5, number(primary ? primary->triangle_tests_per_ray : std::nullopt)});
    print_row(out, label_of(result), cells);
  }
}

// The paper's column is another machine's; a stand-in is another mesh. Both must be said.
void print_footnotes(std::ostream& out, const std::vector<Result>& results) {
  std::vector<std::string> lines;
  for (const Result& result : results) {
    std::string line;
    if (result.stand_in) {
      line = "* " + result.scene + ": ";
      if (result.note.find("stand-in") == std::string::npos) line += "stand-in, ";
      line += result.note.empty() ? "not the mesh of the paper" : result.note;
    } else if (result.paper_triangles != 0 && result.paper_triangles != result.triangles) {
      line = result.scene + ": the paper has " + count(result.paper_triangles) +
             " triangles, this mesh " + count(result.triangles);
    }
    if (!line.empty() && std::find(lines.begin(), lines.end(), line) == lines.end()) {
      lines.push_back(line);
    }
    const std::uint64_t zero_area = result.statistics.skipped_zero_area;
    const std::uint64_t non_finite = result.statistics.skipped_non_finite;
    if (zero_area + non_finite > 0) {
      line = result.scene + ": left out of the tree: " + count(zero_area) + " of zero area";
      if (non_finite > 0) line += ", " + count(non_finite) + " not finite";
      if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(line);
    }
  }
  const bool paper = std::any_of(results.begin(), results.end(),
                                 [](const Result& result) { return result.paper_ms > 0.0; });
  if (paper) lines.insert(lines.begin(), "GTX 580: build times of the paper, on that GPU");
  for (const std::string& line : lines) out << line << '\n';

  constexpr double busy = 30.0;  // an idle machine shows a few
  double preempted = 0.0;
  for (const Result& result : results) {
    preempted = std::max(preempted, result.preempted_per_s.value_or(0.0));
  }
  if (preempted > busy) {
    out << "The machine was busy: other programs took a core up to " << number(preempted)
        << " times a second.\nThese times are too long; measure again when it is idle.\n";
  }
}

void print_spread(std::ostream& out, const std::vector<Result>& results) {
  out << "\nMilliseconds, median (least-most)\n";
  print_row(out, "scene", {{20, "build"}, {20, "primary"}, {20, "diffuse"}, {20, "shadow"}});
  for (const Result& result : results) {
    std::vector<Cell> cells{{20, spread(result.build_ms)}};
    for (const RayKind kind : all_kinds_of_rays) {
      const Trace* const trace = find(result.traces, kind);
      cells.push_back({20, trace == nullptr ? "-" : spread(trace->ms)});
    }
    print_row(out, label_of(result), cells);
  }
}

// What a build takes on the device, by the way it is asked for, and what its data takes there.
void print_gpu(std::ostream& out, const std::vector<Result>& results) {
  out << "\nCUDA, milliseconds (medians). rebuild and graph: no allocation. chained: replays one "
         "behind the\nother. host: until the call returns. cold: first build of a process\n";
  print_row(out, "",
            {{8, ""}, {8, "graph"}, {8, "graph"}, {8, "rebuild"}, {8, "build w."}, {8, ""}});
  print_row(out, "scene",
            {{8, "rebuild"},
             {8, "replay"},
             {8, "chained"},
             {8, "host"},
             {8, "alloc."},
             {8, "cold"},
             {7, "H2D"},
             {7, "D2H"},
             {6, "hash"},
             {6, "hits"}});
  for (const Result& result : results) {
    if (!result.gpu) continue;
    const Gpu& gpu = *result.gpu;
    print_row(out, label_of(result),
              {{8, fine(result.build_ms.median)},
               {8, fine(gpu.graph_replay_ms.median)},
               {8, fine(gpu.graph_replay_chained_ms)},
               {8, fine(gpu.submit_ms.median)},
               {8, fine(gpu.build_allocating_ms.median)},
               {8, number(gpu.cold_ms)},
               {7, fine(gpu.h2d_ms.median)},
               {7, fine(gpu.d2h_ms.median)},
               {6, gpu.hash_equal ? "equal" : "WRONG"},
               {6, gpu.hits_equal ? "equal" : "WRONG"}});
  }
}

// Whether any of the builds has such a stage: several are there only where they are asked for.
bool has_stage(const std::vector<Result>& results, std::size_t stage) {
  return std::any_of(results.begin(), results.end(), [stage](const Result& result) {
    return stage < result.stages_ms.size() && result.stages_ms[stage].max > 0.0;
  });
}

// A stage's name on two lines, broken at the underscore.
void print_stages(std::ostream& out, const std::vector<Result>& results) {
  out << "\nStages, milliseconds (medians)\n";
  std::vector<Cell> first;
  std::vector<Cell> second;
  std::vector<std::size_t> stages;
  for (std::size_t i = 0; i < static_cast<std::size_t>(Stage::count); ++i) {
    if (!has_stage(results, i)) continue;
    stages.push_back(i);
    const std::string name = to_string(static_cast<Stage>(i));
    const std::size_t gap = name.find_first_of("_ ");
    const std::string upper = gap == std::string::npos ? "" : name.substr(0, gap);
    const std::string lower = gap == std::string::npos ? name : name.substr(gap + 1);
    const std::size_t width = std::max({std::size_t{6}, upper.size(), lower.size()});
    first.push_back({width, upper});
    second.push_back({width, lower});
  }
  print_row(out, "", first);
  print_row(out, "scene", second);
  for (const Result& result : results) {
    std::vector<Cell> cells;
    for (std::size_t i = 0; i < first.size(); ++i) {
      const bool known = stages[i] < result.stages_ms.size();
      cells.push_back({first[i].width, known ? number(result.stages_ms[stages[i]].median) : "-"});
    }
    print_row(out, label_of(result), cells);
  }
}

// `lead` and a list with commas, broken so that no line is longer than a table.
void print_list(std::ostream& out, const std::string& lead, std::size_t indent,
                const std::vector<std::string>& items) {
  constexpr std::size_t columns = 100;
  std::string line = lead;
  for (std::size_t i = 0; i < items.size(); ++i) {
    std::string item = items[i];
    if (i + 1 < items.size()) item += ',';
    if (line.size() + 1 + item.size() > columns) {
      out << line << '\n';
      line = left("", indent);
    }
    line.append(1, ' ').append(item);
  }
  out << line << '\n';
}

void print_skips(std::ostream& out, const std::vector<Result>& results) {
  out << "\nSkipped, because the scene did not need it\n";
  for (const Result& result : results) {
    std::vector<std::string> items;
    for (const SkippedWork& work : skipped_work(result.statistics)) {
      items.push_back(work.what);
      if (!work.amount.empty()) items.back().append(" (").append(work.amount).append(")");
    }
    if (items.empty()) items.push_back("nothing");
    print_list(out, left(label_of(result), label_width), label_width, items);
  }
}

// `12.3  x1.25`: a figure and how it compares.
std::string compared(std::optional<double> value, std::optional<double> ratio) {
  if (!value) return "-";
  std::string factor;
  if (ratio) factor.append("x").append(number(ratio));
  return number(value) + right(factor, 7);
}

std::optional<double> ratio(std::optional<double> over, std::optional<double> under) {
  if (!over || !under || !(*under > 0.0)) return std::nullopt;
  return *over / *under;
}

constexpr std::size_t peer_width = 35;  // embree-3.13.5 medium robust packet8
constexpr std::size_t compared_width = 14;

void print_peer_row(std::ostream& out, const std::string& name, const Spread& build_ms,
                    const Traces& traces, const Result& ours) {
  out << "  " << left(name, peer_width) << ' '
      << right(compared(build_ms.median, ratio(build_ms.median, ours.build_ms.median)),
               compared_width);
  for (const RayKind kind : all_kinds_of_rays) {
    const std::optional<double> theirs = speed(traces, kind);
    out << ' ' << right(compared(theirs, ratio(speed(ours.traces, kind), theirs)), compared_width);
  }
  out << '\n';
}

void print_peers(std::ostream& out, const std::vector<Result>& results) {
  out << "\nPeers in the same run, on the same threads: build ms, Mrays/s. x2 means: zkd is twice "
      << "as fast\n"
      << left("scene", peer_width + 2);
  for (const char* column : {"build ms", "primary", "diffuse", "shadow"}) {
    out << ' ' << right(column, compared_width);
  }
  out << '\n';
  for (std::size_t begin = 0; begin < results.size();) {
    std::size_t end = begin;
    while (end < results.size() && results[end].scene == results[begin].scene) ++end;
    const Result& ours = results[begin];
    out << ours.scene << (ours.stand_in ? "*" : "") << '\n';
    for (std::size_t i = begin; i < end; ++i) {
      const Result& result = results[i];
      print_peer_row(out, result.setting.empty() ? "zkd" : "zkd " + result.setting, result.build_ms,
                     result.traces, ours);
    }
    for (const Peer& peer : ours.peers) {
      print_peer_row(out, peer.name, peer.build_ms, peer.traces, ours);
    }
    begin = end;
  }
}

void print_check_row(std::ostream& out, const std::string& label, const std::string& kind,
                     const Check& check) {
  print_row(out, label,
            {{8, kind},
             {9, count(check.rays)},
             {7, count(check.outside.missed)},
             {7, count(check.outside.phantom)},
             {6, count(check.outside.wrong_triangle)},
             {7, count(check.in_band.missed)},
             {7, count(check.in_band.phantom)},
             {6, count(check.in_band.wrong_triangle)},
             {10, number(check.t_ulp_p999)}});
}

// Which rays to look at: their numbers in the check's own order.
void print_offenders(std::ostream& out, const Check& check) {
  if (check.first_offenders.empty()) return;
  out << left("", label_width) << "  outside the band, first rays:";
  for (const std::uint64_t ray : check.first_offenders) out << ' ' << ray;
  out << '\n';
}

void print_check(std::ostream& out, const std::vector<Result>& results) {
  out << "\nAgainst the exact oracle: answers that differ\n";
  print_row(out, "",
            {{8, ""},
             {9, ""},
             {22, "outside the band    "},
             {22, "within the band     "},
             {10, "t, ulp"}});
  print_row(out, "scene",
            {{8, "rays"},
             {9, "number"},
             {7, "missed"},
             {7, "phantom"},
             {6, "wrong"},
             {7, "missed"},
             {7, "phantom"},
             {6, "wrong"},
             {10, "p99.9"}});
  for (const Result& result : results) {
    for (const auto& [kind, check] : result.checks) {
      const bool first = kind == result.checks.begin()->first;
      print_check_row(out, first ? label_of(result) : "", to_string(kind), check);
      print_offenders(out, check);
    }
    if (result.check && result.check->leaks) {
      out << left("", label_width) << " closed mesh: " << *result.check->leaks
          << " leaks from inside\n";
    }
  }
}

void print_images(std::ostream& out, const Options& options, const std::vector<Result>& results) {
  out << "\nImages in " << options.images->string() << '\n';
  std::vector<std::string> items;
  for (const Result& result : results) {
    if (result.visits_at_white) {
      items.push_back(label_of(result) + " " + number(result.visits_at_white));
    }
  }
  print_list(out, "node visits of a primary ray, from 0 (black) to the palest at", 0, items);
}

}  // namespace

void print_header(std::ostream& out, const Options& options, const Machine& machine,
                  Backend backend, const std::string& why_not_cuda) {
  out << "zkd-bench " ZKD_VERSION ", backend " << zkd::to_string(backend);
  if (options.settings.front().backend == Backend::automatic) {
    out << " (chosen by auto" << (why_not_cuda.empty() ? "" : ": ") << why_not_cuda << ')';
  }
  if (machine.gpu) {
    out << " on " << *machine.gpu << ", driver " << machine.driver.value_or("unknown");
  }
  out << ", " << machine.threads << (machine.threads == 1 ? " thread" : " threads") << ", "
      << machine.cpu.value_or("unknown processor") << '\n';
  out << "times: medians of " << options.repeat << " interleaved repetitions after a warm-up, on "
      << "this machine\n";
  out.flush();
}

void print_results(std::ostream& out, const Options& options, const std::vector<Result>& results) {
  out << '\n';
  print_main_table(out, results);
  print_footnotes(out, results);
  const bool gpu = std::any_of(results.begin(), results.end(),
                               [](const Result& result) { return result.gpu.has_value(); });
  if (gpu) print_gpu(out, results);
  print_spread(out, results);
  print_stages(out, results);
  print_skips(out, results);
  print_tree_stats(out, results);
  if (!options.peers.empty()) print_peers(out, results);
  if (options.check > 0) print_check(out, results);
  if (options.images) print_images(out, options, results);
  out.flush();
}

void print_scenes(std::ostream& out, const std::vector<scene::SceneInfo>& found,
                  const std::vector<std::string>& known) {
  for (const scene::SceneInfo& info : found) {
    out << left(info.name, 14) << ' ' << info.path.string();
    if (info.stand_in) out << "  (stand-in)";
    out << '\n';
    if (!info.note.empty()) out << left("", 15) << info.note << '\n';
  }
  for (const std::string& name : known) {
    const bool here = std::any_of(found.begin(), found.end(),
                                  [&](const scene::SceneInfo& info) { return info.name == name; });
    if (!here) out << left(name, 14) << " not found\n";
  }
  out.flush();
}

}  // namespace zkd::bench
