// SPDX-License-Identifier: Apache-2.0
//
// The Pareto table in Markdown, and its place in a document.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>

#include "report.hpp"
#include "usage_error.hpp"

namespace zkd::bench::accuracy {
namespace {

constexpr const char* begin_marker = "<!-- table: begin -->";
constexpr const char* end_marker = "<!-- table: end -->";

// What a reader looks for even where something beats it.
bool is_landmark(const Point& point) {
  const auto is_default = [&](const char* through) {
    return point.setting == std::string(through) + default_setting;
  };
  return point.peer || is_default("") || is_default("wide ") || is_default("cuda ") ||
         point.family == "literal";
}

std::string with(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string error_of(const Point& point) {
  const Counts counts = point.score.total();
  if (counts.errors() == 0) {
    return "< " + with("%.1e", 3.0 / static_cast<double>(counts.rays));
  }
  return with("%.1e", point.error());
}

void add_row(std::ostream& out, const Point& point) {
  const Counts counts = point.score.total();
  const Quantiles t = point.score.all_t_ulps().quantiles();
  out << "| " << point.scene << (point.stand_in ? " (stand-in)" : "") << " | " << point.rays
      << " | " << point.setting << " | " << (point.pareto ? "yes" : "") << " | "
      << with("%.1f", point.build_ms.median) << " | " << with("%.0f", point.ns_per_ray) << " | "
      << error_of(point) << " | " << counts.missed << " | " << counts.phantom << " | "
      << counts.wrong_benign << " | " << counts.wrong_real << " | "
      << (t.n > 0 ? with("%.2g", t.p999) : "") << " |\n";
}

}  // namespace

std::string pareto_table(const Report& report) {
  std::ostringstream out;
  out << "| scene | rays | setting | Pareto | build ms | ns/ray | E1 + E2 | missed | phantom | "
         "benign | wrong | t p99.9, ulp |\n"
         "|---|---|---|:-:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
  std::vector<const Point*> rows;
  for (const Point& point : report.points) {
    if (point.pareto || is_landmark(point)) rows.push_back(&point);
  }
  // Scenes in their order; within a scene and a group of rays the fastest first.
  for (auto begin = rows.begin(); begin != rows.end();) {
    const auto end = std::find_if(
        begin, rows.end(), [&](const Point* point) { return point->scene != (*begin)->scene; });
    std::stable_sort(begin, end, [](const Point* a, const Point* b) {
      if (a->rays != b->rays) return a->rays > b->rays;  // workload before adversarial
      return a->build_and_trace_ms() < b->build_and_trace_ms();
    });
    begin = end;
  }
  for (const Point* point : rows) add_row(out, *point);
  return out.str();
}

TableFile::TableFile(const std::filesystem::path& file) : file_("--table", file) {
  std::string document = std::string(begin_marker) + "\n" + end_marker + "\n";
  // What cannot be replaced, such as a pipe, might never end.
  if (file_.is_replaced() && std::filesystem::exists(file)) {
    std::ifstream in(file, std::ios::binary);
    document.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    if (!in) throw UsageError("--table: cannot read " + file.string());
  }
  const std::size_t begin = document.find(begin_marker);
  const std::size_t end = begin == std::string::npos ? begin : document.find(end_marker, begin);
  if (end == std::string::npos) {
    throw UsageError("--table: " + file.string() + " has no lines '" + begin_marker + "' and '" +
                     end_marker + "' to write between");
  }
  before_ = document.substr(0, begin + std::string(begin_marker).size());
  after_ = document.substr(end);
}

void TableFile::write(const std::string& table) const {
  file_.write(before_ + "\n\n" + table + "\n" + after_);
}

}  // namespace zkd::bench::accuracy
