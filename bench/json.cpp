// SPDX-License-Identifier: Apache-2.0
//
// Results for scripts. Names here are a contract: add, never change.
#include "json.hpp"

#include <charconv>
#include <nlohmann/json.hpp>

#include <zkd/config.hpp>

#include "skips.hpp"
#include "tree_stats.hpp"

namespace zkd::bench {
namespace {

using Json = nlohmann::ordered_json;

template <class Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

// 0 and "" stand for "not in the paper".
template <class Value>
Json unless_empty(const Value& value) {
  return value == Value{} ? Json(nullptr) : Json(value);
}

// 1.3F as 1.3, not as 1.2999999523162842.
double shortest(float value) {
  char text[32];
  const std::to_chars_result end = std::to_chars(text, text + sizeof text, value);
  double read = static_cast<double>(value);
  std::from_chars(text, end.ptr, read);
  return read;
}

Json json_of(const Spread& spread) {
  if (spread.n == 0) return nullptr;
  return {{"median", spread.median}, {"min", spread.min}, {"max", spread.max}, {"n", spread.n}};
}

Json json_of(const Trace& trace) {
  return {{"rays", trace.rays},
          {"hits", trace.hits},
          {"ms", json_of(trace.ms)},
          {"mrays_per_s", or_null(trace.mrays_per_s())},
          {"node_visits_per_ray", or_null(trace.node_visits_per_ray)},
          {"triangle_tests_per_ray", or_null(trace.triangle_tests_per_ray)}};
}

// Every kind has its key; one that was not asked for is null.
Json json_of(const Traces& traces) {
  Json json = Json::object();
  for (const RayKind kind : {RayKind::primary, RayKind::diffuse, RayKind::shadow}) {
    const auto found = traces.find(kind);
    json[to_string(kind)] = found == traces.end() ? Json(nullptr) : json_of(found->second);
  }
  return json;
}

Json json_of(const Differences& differences) {
  return {{"missed", differences.missed},
          {"phantom", differences.phantom},
          {"wrong_triangle", differences.wrong_triangle}};
}

Json json_of(const Check& check) {
  Json json = {{"rays", check.rays}};
  json.update(json_of(check.outside));
  json["in_band"] = json_of(check.in_band);
  json["t_ulp_p999"] = or_null(check.t_ulp_p999);
  json["leaks"] = or_null(check.leaks);
  return json;
}

Json json_of_options(const Result& result) {
  const BuildOptions& options = result.options;
  return {{"builder", zkd::to_string(options.builder)},
          {"quality", zkd::to_string(options.quality)},
          {"references", zkd::to_string(options.references)},
          {"budget", shortest(options.budget)},
          {"leaf_size", options.leaf_size},
          {"code_bits", options.code_bits},
          {"axis_order", zkd::to_string(options.axis_order)},
          {"recode", options.recode_crowded},
          {"invalid", zkd::to_string(options.invalid_triangles)},
          {"reference_capacity", options.reference_capacity},
          {"sah_areas", zkd::to_string(options.sah.areas)},
          {"sah_visit_cost", shortest(options.sah.visit_cost)},
          {"sah_test_cost", shortest(options.sah.test_cost)},
          {"sah_empty_bonus", shortest(options.sah.empty_bonus)},
          {"instructions", result.instructions},
          {"intersector", result.intersector},
          {"layout", to_string(result.layout)},
          {"seed", result.seed}};
}

Json json_of(const Peer& peer) {
  return {
      {"name", peer.name},
      {"build_ms", json_of(peer.build_ms)},
      {"allocated_bytes", {{"held", or_null(peer.held_bytes)}, {"peak", or_null(peer.peak_bytes)}}},
      {"trace", json_of(peer.traces)}};
}

// Medians under the names of the contract; the spreads behind them apart.
Json json_of(const Gpu& gpu) {
  const auto median = [](const Spread& spread) {
    return spread.n == 0 ? Json(nullptr) : Json(spread.median);
  };
  return {{"hash_equal", gpu.hash_equal},
          {"hits_equal", gpu.hits_equal},
          {"graph_replay_ms", median(gpu.graph_replay_ms)},
          {"graph_replay_chained_ms",
           gpu.graph_nodes == 0 ? Json(nullptr) : Json(gpu.graph_replay_chained_ms)},
          {"graph_nodes", gpu.graph_nodes == 0 ? Json(nullptr) : Json(gpu.graph_nodes)},
          {"cold_ms", or_null(gpu.cold_ms)},
          {"context_ms", or_null(gpu.context_ms)},
          {"h2d_ms", median(gpu.h2d_ms)},
          {"h2d_pageable_ms", median(gpu.h2d_pageable_ms)},
          {"d2h_ms", median(gpu.d2h_ms)},
          {"build_allocating_ms", median(gpu.build_allocating_ms)},
          {"submit_ms", median(gpu.submit_ms)},
          {"analyse_ms", or_null(gpu.analyse_ms)},
          {"spread",
           {{"graph_replay_ms", json_of(gpu.graph_replay_ms)},
            {"h2d_ms", json_of(gpu.h2d_ms)},
            {"h2d_pageable_ms", json_of(gpu.h2d_pageable_ms)},
            {"d2h_ms", json_of(gpu.d2h_ms)},
            {"build_allocating_ms", json_of(gpu.build_allocating_ms)},
            {"submit_ms", json_of(gpu.submit_ms)}}}};
}

Json json_of(const Result& result) {
  const Statistics& statistics = result.statistics;
  Json json = {{"scene", result.scene},
               {"triangles", result.triangles},
               {"label", result.setting},
               {"stand_in", result.stand_in},
               {"note", unless_empty(result.note)},
               {"paper",
                {{"scene", unless_empty(result.paper_scene)},
                 {"triangles", unless_empty(result.paper_triangles)},
                 {"gtx580_ms", unless_empty(result.paper_ms)}}},
               {"skipped_triangles", statistics.skipped_zero_area + statistics.skipped_non_finite},
               {"skipped_zero_area", statistics.skipped_zero_area},
               {"skipped_non_finite", statistics.skipped_non_finite},
               {"backend", zkd::to_string(result.options.backend)},
               {"threads", result.threads},
               {"options", json_of_options(result)},
               {"preempted_per_s", or_null(result.preempted_per_s)},
               {"build_ms", json_of(result.build_ms)}};

  Json& stages = json["stages_ms"] = Json::object();
  for (std::size_t i = 0; i < result.stages_ms.size(); ++i) {
    stages[zkd::to_string(static_cast<Stage>(i))] = result.stages_ms[i].median;
  }
  Json& bytes = json["stages_bytes"] = Json::object();
  for (std::size_t i = 0; i < statistics.stage_bytes.size(); ++i) {
    bytes[zkd::to_string(static_cast<Stage>(i))] = or_null(statistics.stage_bytes[i]);
  }
  json["allocated_bytes"] = {{"tree", result.allocated.tree},
                             {"workspace", result.allocated.workspace},
                             {"asked_beforehand", result.allocated.asked_beforehand}};
  json["tree"] = {
      {"nodes", statistics.nodes},
      {"leaves", statistics.leaves},
      {"references", statistics.references},
      {"depth", result.has_quality ? Json(statistics.depth) : Json(nullptr)},
      {"sah", result.has_quality ? Json(statistics.sah_cost) : Json(nullptr)},
      {"largest_leaf", result.has_quality ? Json(statistics.largest_leaf) : Json(nullptr)},
      {"code_bits", statistics.code_bits},
      {"crowded_trunks", statistics.crowded_trunks},
      {"crowded_triangles", statistics.crowded_triangles},
      {"crowded_leaves", statistics.crowded_leaves},
      {"crowded_references", statistics.crowded_references},
      {"hash", result.tree_hash}};
  if (result.tree_statistics) json["tree"]["statistics"] = tree_stats_json(*result.tree_statistics);
  json["trace"] = json_of(result.traces);
  if (result.gpu) json["gpu"] = json_of(*result.gpu);

  Json& check = json["check"] = nullptr;
  if (result.check) {
    check = json_of(*result.check);
    Json& kinds = check["kinds"] = Json::object();
    for (const auto& [kind, one] : result.checks) {
      kinds[to_string(kind)] = json_of(one);
      kinds[to_string(kind)]["first_offenders"] = one.first_offenders;
    }
  }

  Json& skipped = json["skipped"] = Json::array();
  Json& not_skipped = json["not_skipped"] = Json::array();
  for (const SkippedWork& work : skips_considered(statistics)) {
    if (!work.taken) {
      not_skipped.push_back({{"what", work.what}, {"why", work.why}});
      continue;
    }
    skipped.push_back({{"what", work.what},
                       {"amount", unless_empty(work.amount)},
                       {"why", work.why},
                       {"saved_ms", or_null(work.saved_ms)}});
  }
  Json& peers = json["peers"] = Json::array();
  for (const Peer& peer : result.peers) peers.push_back(json_of(peer));
  return json;
}

}  // namespace

std::string to_json(const Machine& machine, const std::vector<Result>& results) {
  Json json = {{"schema", 1},
               {"zkd", ZKD_VERSION},
               {"commit", or_null(machine.commit)},
               {"machine",
                {{"cpu", or_null(machine.cpu)},
                 {"threads", machine.threads},
                 {"gpu", or_null(machine.gpu)},
                 {"driver", or_null(machine.driver)},
                 {"cuda", or_null(machine.cuda)},
                 {"compute_capability", or_null(machine.compute_capability)},
                 {"multiprocessors", or_null(machine.multiprocessors)},
                 {"gpu_memory_bytes", or_null(machine.gpu_memory_bytes)},
                 {"compiler", or_null(machine.compiler)}}}};
  Json& list = json["results"] = Json::array();
  for (const Result& result : results) list.push_back(json_of(result));
  // A path may hold bytes that are no UTF-8: they are replaced, not refused.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string to_json(const ColdBuild& cold) {
  return Json{{"context_ms", cold.context_ms}, {"cold_ms", cold.build_ms}}.dump() + "\n";
}

}  // namespace zkd::bench
