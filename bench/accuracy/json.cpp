// SPDX-License-Identifier: Apache-2.0
//
// Results for scripts. Names here are a contract: add, never change.
#include <cmath>
#include <nlohmann/json.hpp>

#include <zkd/config.hpp>

#include "report.hpp"

namespace zkd::bench::accuracy {
namespace {

using Json = nlohmann::ordered_json;

template <class Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

// JSON has no infinity.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json("infinity"); }

Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

// An upper bound at 95 % on a rate of which nothing was seen in n trials (the rule of three).
Json rate(std::uint64_t seen, std::uint64_t n) {
  if (n == 0) return nullptr;
  const auto trials = static_cast<double>(n);
  return {{"seen", seen},
          {"rays", n},
          {"rate", static_cast<double>(seen) / trials},
          {"below_at_95", seen == 0 ? Json(3.0 / trials) : Json(nullptr)}};
}

Json json_of(const Quantiles& q) {
  if (q.n == 0) return nullptr;
  return {{"n", q.n},
          {"median", number(q.median)},
          {"p99", number(q.p99)},
          {"p999", number(q.p999)},
          {"max", number(q.max)}};
}

Json json_of(const Spread& spread) {
  if (spread.n == 0) return nullptr;
  return {{"median", spread.median}, {"min", spread.min}, {"max", spread.max}, {"n", spread.n}};
}

Json in_band(const Score& score, std::uint64_t count) {
  return score.judged ? Json(count) : Json(nullptr);
}

const Score* default_score(const Report& report, Score& sum) {
  bool any = false;
  for (const ErrorsOf& one : report.errors) {
    if (one.name != default_setting) continue;
    sum.add(one.score);
    any = true;
  }
  return any ? &sum : nullptr;
}

Json e1_rows(const Report& report) {
  Json rows = Json::array();
  for (const ErrorsOf& one : report.errors) {
    Json classes = Json::object();
    for (std::size_t i = 0; i < ray_classes; ++i) {
      const Counts& counts = one.score.of_class[i];
      classes[to_string(static_cast<RayClass>(i))] = {
          {"rays", counts.rays},
          {"missed", rate(counts.missed, counts.rays)},
          {"phantom", rate(counts.phantom, counts.rays)}};
    }
    const Counts total = one.score.total();
    rows.push_back({{"name", one.name},
                    {"rays_kind", one.rays},
                    {"rays", total.rays},
                    {"missed", total.missed},
                    {"phantom", total.phantom},
                    {"in_band_missed", in_band(one.score, total.in_band_missed)},
                    {"in_band_phantom", in_band(one.score, total.in_band_phantom)},
                    {"first_offender", text_or_null(one.first_offender)},
                    {"phantom_outside_units", json_of(one.score.phantom_units.quantiles())},
                    {"classes", classes}});
  }
  return rows;
}

Json e2_rows(const Report& report) {
  Json rows = Json::array();
  for (const ErrorsOf& one : report.errors) {
    Json classes = Json::object();
    for (std::size_t i = 0; i + 1 < ray_classes; ++i) {
      const Counts& counts = one.score.of_class[i];
      classes[to_string(static_cast<RayClass>(i))] = {
          {"rays", counts.rays},
          {"benign", rate(counts.wrong_benign, counts.rays)},
          {"real", rate(counts.wrong_real, counts.rays)}};
    }
    const Counts total = one.score.total();
    rows.push_back({{"name", one.name},
                    {"rays_kind", one.rays},
                    {"rays", total.rays},
                    {"benign", total.wrong_benign},
                    {"real", total.wrong_real},
                    {"in_band", in_band(one.score, total.in_band_wrong)},
                    {"classes", classes}});
  }
  return rows;
}

Json e4_rows(const Report& report) {
  Json rows = Json::array();
  for (const ErrorsOf& one : report.errors) {
    Json bins = Json::array();
    for (std::size_t i = 0; i < condition_bins; ++i) {
      bins.push_back(
          {{"condition_below", i < condition_ends.size() ? Json(condition_ends[i]) : Json(nullptr)},
           {"t_ulp", json_of(one.score.t_ulps[i].quantiles())},
           {"uv_units", json_of(one.score.uv_units[i].quantiles())}});
    }
    rows.push_back({{"name", one.name},
                    {"rays_kind", one.rays},
                    {"t_ulp", json_of(one.score.all_t_ulps().quantiles())},
                    {"first_above_bound", text_or_null(one.first_above_bound)},
                    {"above_bound", one.score.above_bound ? rate(*one.score.above_bound,
                                                                 one.score.all_t_ulps().count())
                                                          : Json(nullptr)},
                    {"bins", bins}});
  }
  return rows;
}

void add_errors(Json& json, const Report& report) {
  Score sum;
  const Score* const ours = default_score(report, sum);
  if (ours == nullptr) {
    json["e1"] = json["e2"] = json["e4"] = nullptr;
    return;
  }
  const Counts total = ours->total();
  json["e1"] = {{"rays", total.rays},
                {"missed", total.missed - total.in_band_missed},
                {"phantom", total.phantom - total.in_band_phantom},
                {"in_band", total.in_band_missed + total.in_band_phantom},
                {"rows", e1_rows(report)}};
  json["e2"] = {{"rays", total.rays},
                {"wrong_triangle", total.wrong() - total.in_band_wrong},
                {"in_band", total.in_band_wrong},
                {"benign", total.wrong_benign},
                {"real", total.wrong_real},
                {"rows", e2_rows(report)}};
  const Histogram all = ours->all_t_ulps();
  json["e4"] = {{"rays", all.count()},
                {"t_ulp", json_of(all.quantiles())},
                {"above_bound", or_null(ours->above_bound)},
                {"uv_unit", "2^-24"},
                {"rows", e4_rows(report)}};
}

Json json_of(const TreeAgainstLoops& e3) {
  Json rows = Json::array();
  for (const TreeAgainstLoop& one : e3.of_intersector) {
    rows.push_back({{"name", one.name},
                    {"rays", one.rays},
                    {"different", rate(one.different, one.rays)},
                    {"any_hit_different", rate(one.any_hit_different, one.rays)}});
  }
  return {{"rays", e3.rays()},
          {"different", e3.different()},
          {"cases", e3.cases},
          {"first_difference", text_or_null(e3.first_difference)},
          {"loop", {{"rays", e3.loop.rays}, {"different", rate(e3.loop.different, e3.loop.rays)}}},
          {"rows", rows}};
}

Json json_of(const Leaks& e5) {
  Json rows = Json::array();
  LeakCounts ours;
  for (const LeaksOf& one : e5.of) {
    const LeakCounts total = one.total();
    if (one.name == default_setting) ours = total;
    Json targets = Json::object();
    for (std::size_t i = 0; i < target_kinds; ++i) {
      const LeakCounts& counts = one.of_target[i];
      targets[target_names[i]] = {{"leaks", rate(counts.leaks, counts.rays)},
                                  {"double_hits", rate(counts.double_hits, counts.rays)}};
    }
    rows.push_back({{"name", one.name},
                    {"rays", total.rays},
                    {"leaks", total.leaks},
                    {"double_hits", total.double_hits},
                    {"first_leak", text_or_null(one.first_leak)},
                    {"targets", targets}});
  }
  return {{"rays", ours.rays},
          {"leaks", ours.leaks},
          {"double_hits", ours.double_hits},
          {"meshes", e5.meshes},
          {"rows", rows}};
}

Json json_of(const TreeQuality& quality) {
  return {{"scene", quality.scene},
          {"tree", quality.tree},
          {"triangles", quality.triangles},
          {"sah", quality.sah_cost},
          {"sah_over_exact_sah", quality.sah_over_exact},
          {"node_visits_per_ray", quality.node_visits_per_ray},
          {"triangle_tests_per_ray", quality.triangle_tests_per_ray},
          {"references_per_triangle", quality.references_per_triangle},
          {"tree_bytes", quality.tree_bytes},
          {"depth", quality.depth},
          {"deepest_stack", quality.deepest_stack}};
}

Json json_of(const Determinism& e7) {
  return {{"cases", e7.cases},
          {"hashes_too_many", e7.hashes_too_many},
          {"builds", e7.builds},
          {"backends", e7.backends},
          {"first_offender", text_or_null(e7.first_offender)}};
}

Json json_of(const Point& point) {
  const Counts total = point.score.total();
  return {
      {"scene", point.scene},
      {"setting", point.setting},
      {"family", point.family},
      {"backend", point.peer ? Json(nullptr) : Json(point.cuda ? "cuda" : "cpu")},
      {"rays_kind", point.rays},
      {"stand_in", point.stand_in},
      {"triangles", point.triangles},
      {"rays", total.rays},
      {"ns_per_ray", point.ns_per_ray},
      {"build_ms", point.build_ms.median},
      {"trace_ms", point.trace_ms.median},
      {"build_trace_ms", point.build_and_trace_ms()},
      {"build_ms_spread", json_of(point.build_ms)},
      {"trace_ms_spread", json_of(point.trace_ms)},
      {"error", point.error()},
      {"error_below_at_95", total.errors() == 0 && total.rays > 0
                                ? Json(3.0 / static_cast<double>(total.rays))
                                : Json(nullptr)},
      {"missed", total.missed},
      {"phantom", total.phantom},
      {"wrong_benign", total.wrong_benign},
      {"wrong_real", total.wrong_real},
      {"in_band", in_band(point.score, total.errors() - total.outside_band())},
      {"t_ulp", json_of(point.score.all_t_ulps().quantiles())},
      {"references_per_triangle", point.peer ? Json(nullptr) : Json(point.references_per_triangle)},
      {"pareto", point.pareto}};
}

}  // namespace

std::string to_json(const Report& report, const Options& options) {
  Json json = {{"schema", 1},
               {"zkd", ZKD_VERSION},
               {"commit", or_null(report.machine.commit)},
               {"machine",
                {{"cpu", or_null(report.machine.cpu)},
                 {"gpu", or_null(report.machine.gpu)},
                 {"driver", or_null(report.machine.driver)},
                 {"cuda", or_null(report.machine.cuda)},
                 {"threads", report.machine.threads},
                 {"compiler", or_null(report.machine.compiler)}}},
               {"seed", options.seed},
               {"size", options.size},
               {"scenes", report.scenes}};
  add_errors(json, report);
  json["e3"] = report.e3 ? json_of(*report.e3) : Json(nullptr);
  json["e5"] = report.e5 ? json_of(*report.e5) : Json(nullptr);
  Json& e6 = json["e6"] = Json::array();
  for (const TreeQuality& quality : report.e6) e6.push_back(json_of(quality));
  json["e7"] = report.e7 ? json_of(*report.e7) : Json(nullptr);
  Json& oracle = json["oracle"] = Json::array();
  for (const OracleSpeed& speed : report.oracle) {
    oracle.push_back({{"scene", speed.scene},
                      {"rays_kind", speed.rays},
                      {"rays", speed.count},
                      {"rays_per_s_per_core",
                       speed.seconds > 0.0 ? Json(static_cast<double>(speed.count) / speed.seconds)
                                           : Json(nullptr)}});
  }
  Json& curves = json["curves"] = Json::array();
  for (const Point& point : report.points) curves.push_back(json_of(point));
  json["failures"] = report.failures();
  // A path may hold bytes that are no UTF-8: they are replaced, not refused.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace zkd::bench::accuracy
