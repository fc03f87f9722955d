// SPDX-License-Identifier: Apache-2.0
//
// A row's line: fixed columns for people, the same words in each for scripts.
#include <cstdarg>
#include <cstdio>
#include <string>

#include "stress/run.hpp"

namespace zkd::stress {
namespace {

[[gnu::format(printf, 1, 2)]] std::string format(const char* text, ...) {
  char line[256];
  std::va_list values;
  va_start(values, text);
  std::vsnprintf(line, sizeof line, text, values);
  va_end(values);
  return line;
}

std::string ratio(double value, double even) {
  return even > 0.0 ? format("x%.2f", value / even) : "-";
}

}  // namespace

std::string to_line(const Report& report) {
  const Findings& f = report.findings;
  const std::string status = !f.ok()               ? "FAILED"
                             : f.skipped().empty() ? "ok"
                                                   : "skipped (" + f.skipped() + ")";
  const auto number = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
  std::string line = format(
      "%-2d  %-31s %-6s  cases %-4llu rays %-8llu missed %llu  phantom %llu  wrong %llu  "
      "in_band %-5llu ms %-8.0f ",
      report.number, report.name.c_str(), status.c_str(), number(f.cases), number(f.rays),
      number(f.outside.missed), number(f.outside.phantom), number(f.outside.wrong_triangle),
      number(f.in_band), report.ms);
  const Expense& a = f.spent;
  const Expense& b = f.spent_even;
  line += "time " + ratio(a.build_ms + a.trace_ms, b.build_ms + b.trace_ms);
  if (b.bytes > 0) {
    line += " (build " + ratio(a.build_ms, b.build_ms) + ", trace " +
            ratio(a.trace_ms, b.trace_ms) + ")  memory " +
            ratio(static_cast<double>(a.bytes), static_cast<double>(b.bytes));
  }
  return line;
}

}  // namespace zkd::stress
