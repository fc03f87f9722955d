// SPDX-License-Identifier: Apache-2.0
#include "tree_stats.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <string>

#include "skips.hpp"

namespace zkd::bench {
namespace {

void line(std::ostream& out, const char* format, ...) {
  char text[256];
  std::va_list values;
  va_start(values, format);
  std::vsnprintf(text, sizeof text, format, values);
  va_end(values);
  out << text << '\n';
}

// A bar per entry, the longest of them as wide as the room there is.
struct Bar {
  std::string name;
  std::uint64_t leaves;
};

std::string bar_of(std::size_t width) {
  return width == 0 ? std::string() : " " + std::string(width, '#');
}

void print_bars(std::ostream& out, const char* title, const std::vector<Bar>& bars,
                std::uint64_t all) {
  constexpr double room = 56.0;
  line(out, "  %-20s%12s%7s", title, "leaves", "%");
  std::uint64_t most = 1;
  for (const Bar& bar : bars) most = std::max(most, bar.leaves);
  for (const Bar& bar : bars) {
    const double of_most = static_cast<double>(bar.leaves) / static_cast<double>(most);
    const auto width = static_cast<std::size_t>(of_most * room + 0.5);
    line(out, "  %-20s%12llu%7.2f%s", bar.name.c_str(), static_cast<unsigned long long>(bar.leaves),
         100.0 * static_cast<double>(bar.leaves) / static_cast<double>(all), bar_of(width).c_str());
  }
}

std::string size_name(std::size_t bin) {
  const std::uint64_t first = LeafSizeBins::first(bin);
  const std::uint64_t last = LeafSizeBins::last(bin);
  return first == last ? std::to_string(first)
                       : std::to_string(first) + " to " + std::to_string(last);
}

// What the build took, stage by stage. Times are medians of the timed builds.
void print_stages(std::ostream& out, const Result& result) {
  line(out, "  %-20s%12s%12s", "stage", "ms", "MB held");
  for (std::size_t i = 0; i < result.stages_ms.size(); ++i) {
    char held[32] = "-";
    if (const auto bytes = result.statistics.stage_bytes[i])
      std::snprintf(held, sizeof held, "%.2f", 1e-6 * static_cast<double>(*bytes));
    line(out, "  %-20s%12.3f%12s", to_string(static_cast<Stage>(i)), result.stages_ms[i].median,
         held);
  }
}

void print_skips(std::ostream& out, const Result& result) {
  line(out, "  %-20s%12s%12s  %s", "skip", "", "saved ms", "why");
  for (const SkippedWork& work : skips_considered(result.statistics)) {
    char saved[32] = "-";
    if (work.saved_ms) std::snprintf(saved, sizeof saved, "%.3f", *work.saved_ms);
    const char* const taken = work.taken ? "taken" : "not taken";
    line(out, "  %-20s%12s%12s  %s", work.what.c_str(),
         work.amount.empty() ? taken : work.amount.c_str(), saved, work.why.c_str());
  }
}

void print_one(std::ostream& out, const Result& result, const TreeStatistics& s) {
  const std::string name = result.scene + (result.setting.empty() ? "" : " " + result.setting);
  const auto ull = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
  const auto triangles = static_cast<double>(std::max<std::uint64_t>(1, result.triangles));
  line(out, "\nTree of %s", name.c_str());
  line(out, "  %llu inner nodes, %llu leaves (%llu empty), %llu references (%.3f a triangle)",
       ull(s.nodes), ull(s.leaves), ull(s.empty_leaves), ull(s.references),
       static_cast<double>(s.references) / triangles);
  line(out, "  %.2f MB, %.1f bytes a triangle; %.2f MB more while it is built",
       1e-6 * static_cast<double>(result.statistics.tree_bytes),
       static_cast<double>(result.statistics.tree_bytes) / triangles,
       1e-6 * static_cast<double>(result.statistics.workspace_bytes));
  line(out,
       "  a random line: %.2f node visits, %.2f leaves, %.2f triangle tests; SAH cost %.2f (1, 1)",
       s.expected_node_visits, s.expected_leaf_visits, s.expected_triangle_tests, s.sah_cost());
  line(out, "  depth %.2f in the mean, %u at most; %.2f triangles in a leaf, %llu at most",
       s.mean_depth, s.depth, s.mean_leaf, ull(s.largest_leaf));
  std::vector<Bar> depths;
  for (std::uint32_t depth = 0; depth <= s.depth; ++depth) {
    if (depths.empty() && s.leaves_at_depth[depth] == 0) continue;
    depths.push_back({std::to_string(depth), s.leaves_at_depth[depth]});
  }
  print_bars(out, "depth", depths, s.leaves);
  std::vector<Bar> sizes;
  for (std::size_t bin = 0; bin < LeafSizeBins::count; ++bin) {
    if (s.leaves_of_size[bin] > 0) sizes.push_back({size_name(bin), s.leaves_of_size[bin]});
  }
  print_bars(out, "triangles in a leaf", sizes, s.leaves);
  print_stages(out, result);
  print_skips(out, result);
}

}  // namespace

void print_tree_stats(std::ostream& out, const std::vector<Result>& results) {
  for (const Result& result : results) {
    if (result.tree_statistics && result.tree_statistics->leaves > 0) {
      print_one(out, result, *result.tree_statistics);
    }
  }
}

nlohmann::ordered_json tree_stats_json(const TreeStatistics& s) {
  nlohmann::ordered_json json = {{"nodes", s.nodes},
                                 {"leaves", s.leaves},
                                 {"empty_leaves", s.empty_leaves},
                                 {"references", s.references},
                                 {"largest_leaf", s.largest_leaf},
                                 {"mean_leaf", s.mean_leaf},
                                 {"depth", s.depth},
                                 {"mean_depth", s.mean_depth},
                                 {"expected_node_visits", s.expected_node_visits},
                                 {"expected_leaf_visits", s.expected_leaf_visits},
                                 {"expected_triangle_tests", s.expected_triangle_tests},
                                 {"sah_cost", s.sah_cost()}};
  auto& depths = json["leaves_at_depth"] = nlohmann::ordered_json::array();
  for (std::size_t depth = 0; depth < s.leaves_at_depth.size(); ++depth) {
    if (s.leaves_at_depth[depth] > 0) {
      depths.push_back({{"depth", depth}, {"leaves", s.leaves_at_depth[depth]}});
    }
  }
  auto& sizes = json["leaves_of_size"] = nlohmann::ordered_json::array();
  for (std::size_t bin = 0; bin < LeafSizeBins::count; ++bin) {
    if (s.leaves_of_size[bin] > 0) {
      sizes.push_back({{"from", LeafSizeBins::first(bin)},
                       {"to", LeafSizeBins::last(bin)},
                       {"leaves", s.leaves_of_size[bin]}});
    }
  }
  return json;
}

}  // namespace zkd::bench
