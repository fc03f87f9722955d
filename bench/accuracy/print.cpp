// SPDX-License-Identifier: Apache-2.0
//
// Results for people, 100 columns.
#include <cstdarg>
#include <cstdio>
#include <ostream>

#include <zkd/config.hpp>

#include "report.hpp"

namespace zkd::bench::accuracy {
namespace {

[[gnu::format(printf, 2, 3)]] void line(std::ostream& out, const char* format, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  out << text << '\n';
}

unsigned long long ull(std::uint64_t value) { return value; }

// "12", or "< 3/400000" where nothing was seen: the upper bound at 95 %.
std::string seen(std::uint64_t count, std::uint64_t n) {
  if (count > 0 || n == 0) return std::to_string(count);
  return "< 3/" + std::to_string(n);
}

void print_errors(std::ostream& out, const Report& report) {
  if (report.errors.empty()) return;
  line(out, "\nE1, E2, E4 against exact arithmetic; benign: another id, t within 4 ulp");
  line(out, "%-29s%-12s%10s%9s%9s%9s%9s%9s", "", "rays", "number", "missed", "phantom", "benign",
       "wrong", "outside");
  for (const ErrorsOf& one : report.errors) {
    const Counts c = one.score.total();
    line(out, "%-29s%-12s%10llu%9llu%9llu%9llu%9llu%9s", one.name.c_str(), one.rays.c_str(),
         ull(c.rays), ull(c.missed), ull(c.phantom), ull(c.wrong_benign), ull(c.wrong_real),
         one.score.judged ? std::to_string(c.outside_band()).c_str() : "-");
  }
  line(out, "by class: errors of all kinds, of rays whose exact hit is");
  line(out, "%-29s%-12s%11s%11s%11s%11s%11s", "", "rays", "interior", "edge", "vertex", "duplicate",
       "miss");
  for (const ErrorsOf& one : report.errors) {
    std::string cells;
    for (const Counts& counts : one.score.of_class) {
      char cell[32];
      const std::string text = counts.rays == 0 ? "-" : seen(counts.errors(), counts.rays);
      std::snprintf(cell, sizeof cell, "%11s", text.c_str());
      cells += cell;
    }
    line(out, "%-29s%-12s%s", one.name.c_str(), one.rays.c_str(), cells.c_str());
  }
  line(out, "t, ulp of float; above: hits whose t, u or v is further off than promised");
  line(out, "%-29s%-12s%10s%10s%10s%10s%14s", "", "rays", "median", "p99", "p99.9", "max", "above");
  for (const ErrorsOf& one : report.errors) {
    const Quantiles q = one.score.all_t_ulps().quantiles();
    const std::string above = one.score.above_bound ? seen(*one.score.above_bound, q.n) : "-";
    line(out, "%-29s%-12s%10.3g%10.3g%10.3g%10.3g%14s", one.name.c_str(), one.rays.c_str(),
         q.median, q.p99, q.p999, q.max, above.c_str());
  }
}

void print_e3(std::ostream& out, const TreeAgainstLoops& e3) {
  line(out, "\nE3, tree against brute force, bit by bit: %llu trees", ull(e3.cases));
  for (const TreeAgainstLoop& one : e3.of_intersector) {
    if (one.rays == 0) continue;
    line(out, "%-29s%12llu rays%18s different%18s any hit", one.name.c_str(), ull(one.rays),
         seen(one.different, one.rays).c_str(), seen(one.any_hit_different, one.rays).c_str());
  }
  line(out, "%-29s%12llu rays%18s different", "the loop, of its definition", ull(e3.loop.rays),
       seen(e3.loop.different, e3.loop.rays).c_str());
}

void print_e5(std::ostream& out, const Leaks& e5) {
  line(out, "\nE5, leaks (and surfaces hit twice) from inside %zu closed meshes", e5.meshes.size());
  line(out, "%-29s%11s%15s%15s%15s%15s", "", "rays", "random", "edge", "vertex", "near vertex");
  for (const LeaksOf& one : e5.of) {
    std::string cells;
    for (const LeakCounts& counts : one.of_target) {
      const std::string text =
          std::to_string(counts.leaks) + " (" + std::to_string(counts.double_hits) + ")";
      char cell[64];
      std::snprintf(cell, sizeof cell, " %14s", text.c_str());
      cells += cell;
    }
    line(out, "%-29s%11llu%s", one.name.c_str(), ull(one.total().rays), cells.c_str());
  }
}

void print_e6(std::ostream& out, const std::vector<TreeQuality>& e6) {
  line(out, "\nE6, trees (over: SAH cost over that of the exact-SAH tree)");
  line(out, "%-27s%8s%6s%11s%11s%10s%8s%7s%7s", "", "SAH", "over", "nodes/ray", "tests/ray",
       "refs/tri", "MB", "depth", "stack");
  for (const TreeQuality& q : e6) {
    line(out, "%-27s%8.1f%6.2f%11.2f%11.2f%10.2f%8.1f%7u%7u", (q.scene + " " + q.tree).c_str(),
         q.sah_cost, q.sah_over_exact, q.node_visits_per_ray, q.triangle_tests_per_ray,
         q.references_per_triangle, 1e-6 * static_cast<double>(q.tree_bytes), q.depth,
         q.deepest_stack);
  }
}

void print_e7(std::ostream& out, const Determinism& e7) {
  std::string backends;
  for (const std::string& backend : e7.backends) {
    backends += (backends.empty() ? "" : ", ") + backend;
  }
  line(out, "\nE7, one tree: %llu cases, %llu builds (%s), %llu hashes too many", ull(e7.cases),
       ull(e7.builds), backends.c_str(), ull(e7.hashes_too_many));
}

// The curves are for plots: here the ends of the story only.
void print_curves(std::ostream& out, const Report& report) {
  if (report.points.empty()) return;
  line(out, "\nRun time against error: points that nothing beats in build + trace and in error");
  line(out, "%-19s%-12s%-28s%10s%10s%9s%11s", "scene", "rays", "setting", "build ms", "trace ms",
       "ns/ray", "error");
  for (const Point& point : report.points) {
    if (!point.pareto) continue;
    const Counts counts = point.score.total();
    char error[32];
    if (counts.errors() == 0) {
      std::snprintf(error, sizeof error, "<%.1e", 3.0 / static_cast<double>(counts.rays));
    } else {
      std::snprintf(error, sizeof error, "%.2e", point.error());
    }
    line(out, "%-19s%-12s%-28s%10.2f%10.2f%9.1f%11s", point.scene.c_str(), point.rays.c_str(),
         point.setting.c_str(), point.build_ms.median, point.trace_ms.median, point.ns_per_ray,
         error);
  }
}

void print_oracle(std::ostream& out, const Report& report) {
  double rays = 0.0;
  double seconds = 0.0;
  for (const OracleSpeed& speed : report.oracle) {
    rays += static_cast<double>(speed.count);
    seconds += speed.seconds;
  }
  if (seconds > 0.0) {
    line(out, "\noracle: %.0f rays a second and core, over all scenes", rays / seconds);
  }
}

}  // namespace

void print(std::ostream& out, const Report& report) {
  line(out, "zkd-accuracy " ZKD_VERSION ", %d threads, %s", report.machine.threads,
       report.machine.cpu.value_or("unknown processor").c_str());
  print_errors(out, report);
  if (report.e3) print_e3(out, *report.e3);
  if (report.e5) print_e5(out, *report.e5);
  if (!report.e6.empty()) print_e6(out, report.e6);
  if (report.e7) print_e7(out, *report.e7);
  print_curves(out, report);
  print_oracle(out, report);
  const std::vector<std::string> failures = report.failures();
  for (const std::string& failure : failures) out << "FAILED: " << failure << '\n';
  std::uint64_t rays = 0;
  for (const ErrorsOf& one : report.errors) {
    if (!one.peer) rays += one.score.total().rays;
  }
  if (report.e3) rays += report.e3->rays();
  if (report.e5) {
    for (const LeaksOf& one : report.e5->of) rays += one.peer ? 0 : one.total().rays;
  }
  line(out, "zkd-accuracy: %s, %zu scenes, %llu rays of ours", failures.empty() ? "ok" : "FAILED",
       report.scenes.size(), ull(rays));
}

}  // namespace zkd::bench::accuracy
