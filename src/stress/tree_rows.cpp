// SPDX-License-Identifier: Apache-2.0
//
// Rows 30 to 32: the deepest tree, the order of the input, and counts past 32 bits.
#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include <zkd/build.hpp>

#include "core/status.hpp"
#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "stress/available_memory.hpp"
#include "stress/case.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::stress {
namespace {

using scene::Mesh;

// ---- 30 -----------------------------------------------------------------------------------------

void staircases(const Setting& setting, const Yield& yield) {
  std::vector<BuildOptions> options;
  for (const References references : {References::once, References::all}) {
    for (const std::uint32_t code_bits : {0u, 63u, 64u}) {
      options.push_back(with(references, 1, code_bits));
      options.back().axis_order = AxisOrder::cyclic;
      options.push_back(with(references, 1, code_bits));
    }
  }
  for (const std::uint32_t levels : {1u, 32u, 62u, 63u, 64u, 100u, 300u}) {
    Case made = hard_case(std::to_string(levels) + " levels", scene::staircase(levels), options,
                          setting.pick(1200u, 20000u));
    made.also = [levels](const Traced& traced, Findings& findings) {
      for (std::size_t i = 0; i < traced.trees.size(); ++i) {
        const BuildOptions& of = traced.of.options[i];
        const std::uint32_t depth = verify::tree_depth(traced.trees[i]->view());
        findings.expect(depth <= max_depth,
                        "depth " + std::to_string(depth) + " is above what a stack holds");
        if (levels >= 63 && of.code_bits == 63 && of.axis_order == AxisOrder::cyclic) {
          findings.expect(depth >= 63, "only " + std::to_string(depth) + " levels deep");
        }
      }
    };
    yield(std::move(made));
  }
}

// ---- 31 -----------------------------------------------------------------------------------------

// The faces in the order of `order`.
Mesh reordered(const Mesh& mesh, const std::vector<std::uint32_t>& order) {
  Mesh other = mesh;
  for (std::size_t i = 0; i < order.size(); ++i) other.faces[i] = mesh.faces[order[i]];
  return other;
}

void same_in_any_order(const Traced& traced, Findings& findings) {
  const Mesh& mesh = traced.of.mesh;
  std::vector<std::vector<std::uint32_t>> orders;
  std::vector<std::uint32_t> order(mesh.faces.size());
  std::iota(order.begin(), order.end(), 0u);
  for (int axis = 0; axis < 3; ++axis) {
    orders.push_back(order);
    std::stable_sort(
        orders.back().begin(), orders.back().end(), [&](std::uint32_t a, std::uint32_t b) {
          return mesh.positions[mesh.faces[a].x][axis] < mesh.positions[mesh.faces[b].x][axis];
        });
  }
  orders.emplace_back(order.rbegin(), order.rend());
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    (void)scene::shuffled(mesh, seed, &orders.emplace_back());
  }
  for (std::size_t i = 0; i < traced.trees.size(); ++i) {
    const std::string want = verify::tree_hash_mapped(traced.trees[i]->view(), {});
    for (const std::vector<std::uint32_t>& mapping : orders) {
      const Mesh other = reordered(mesh, mapping);
      const Tree tree = build(cpu::Executor{.threads = 1 + static_cast<int>(i % 3)}, other.view(),
                              traced.of.options[i]);
      findings.expect(verify::tree_hash_mapped(tree.view(), mapping) == want,
                      "another tree for another order of the triangles");
    }
  }
}

void orders(const Setting& setting, const Yield& yield) {
  const auto one = [&](const char* name, Mesh mesh, std::vector<BuildOptions> options) {
    Case made = hard_case(name, std::move(mesh), std::move(options), setting.pick(600u, 4000u));
    made.oracle_rays = setting.pick(0u, 500u);
    made.also = same_in_any_order;
    yield(std::move(made));
  };
  const bool small = setting.size == Size::small;
  one("soup", scene::soup(setting.pick(3000u, 1000000u), setting.seed),
      small ? many_options() : only_once());
  one("duplicates", scene::integer_mesh(setting.pick(1000u, 100000u), 4, setting.seed),
      small ? many_options() : only_once());
  one("crowded", scene::small_in_large(setting.pick(2000u, 100000u), 1e6F, setting.seed),
      small ? many_options() : once_and_all());
  if (small) return;
  one("sphere", scene::sphere(7), once_and_all());
}

// ---- 32 -----------------------------------------------------------------------------------------

// Counts that no machine of ours holds, given to what decides on them.
void mocked_counts(const Setting&, Findings& findings) {
  constexpr std::uint64_t past_31 = max_count + 1;
  constexpr std::uint64_t past_32 = std::uint64_t{1} << 32;
  for (const std::uint64_t needed : {max_count, past_31, past_32 - 1, past_32, past_32 + 1,
                                     past_32 + max_count, std::uint64_t{1} << 62}) {
    core::BuildCounts counts;
    counts.references_needed = needed;
    core::AdmitReferences{&counts, &counts.references, max_count}(0);
    if (needed <= max_count) {
      findings.expect(counts.status.failed == 0 && counts.references == needed,
                      "2^31 - 1 references are refused");
    } else {
      expect_error(findings, "references", ErrorCode::too_many_references, needed,
                   [&] { core::raise(counts.status, TriangleView{}); });
    }
  }
  const glm::vec3 corners[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::uint32_t indices[3] = {0, 1, 2};
  for (const std::uint64_t count : {past_31, past_32 - 1, past_32, past_32 + 1}) {
    TriangleView view;  // build looks at the count before it looks at any triangle
    view.positions = &corners[0].x;
    view.position_count = 3;
    view.indices = indices;
    view.triangle_count = count;
    expect_error(findings, "triangles", ErrorCode::too_many_triangles, count,
                 [&] { (void)build(view); });
    expect_error(findings, "memory_requirement", ErrorCode::too_many_triangles, count,
                 [&] { (void)memory_requirement(cpu::Executor{}, count); });
  }
  const MemoryRequirement most =
      memory_requirement(cpu::Executor{.threads = 2}, max_count, with(References::all), max_count);
  findings.expect(most.tree_bytes > max_count * (sizeof(Node) + 2 * sizeof(std::uint32_t)),
                  "bytes of the largest tree do not fit");
  findings.expect(most.workspace_bytes > past_32, "bytes of its workspace do not fit");
}

// Triangles in one plane, all as large as the plane: each lies in nearly every cell, so references
// grow with the square of the count.
Mesh plane_sized(std::uint32_t count) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float d = static_cast<float>(i) * 0x1p-20F;
    mesh.positions.emplace_back(-16.0F + d, -16.0F, 0.0F);
    mesh.positions.emplace_back(16.0F + d, -16.0F + d, 0.0F);
    mesh.positions.emplace_back(d, 16.0F - d, 0.0F);
    mesh.faces.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

void real_run(std::uint32_t count, std::uint64_t bytes, const Setting& setting,
              Findings& findings) {
  const std::string what = std::to_string(count) + " triangles";
  if (const std::uint64_t there = available_memory(); there < bytes) {
    findings.note(what + " left out: it takes " + std::to_string(bytes >> 30) + " GB, and " +
                  std::to_string(there >> 30) + " are free");
    return;
  }
  const Mesh mesh = plane_sized(count);
  const cpu::Executor executor{.threads = setting.threads};
  try {
    const Tree tree = build(executor, mesh.view(), with(References::all));
    findings.note(what + ": " + std::to_string(tree.statistics().references) + " references");
    findings.expect(tree.statistics().references == tree.references().size(), what);
    if (tree.statistics().references > 10'000'000) return;  // the rest takes minutes
    for (const std::string& violation : verify::check_tree(tree, mesh.view())) {
      findings.fail(what + ": " + violation);
    }
  } catch (const Error& error) {
    findings.note(what + ": " + error.what());
    findings.expect(error.code() == ErrorCode::too_many_references && error.offender() > max_count,
                    what + ": " + error.what());
  }
}

void counts_past_32_bits(const Setting& setting, const Yield& yield) {
  yield(own_case("mocked counts", mocked_counts));
  for (const std::uint32_t count : {1000u, 20000u, 100000u}) {
    if (setting.size == Size::small && count > 1000) break;
    yield(own_case(std::to_string(count) + " triangles, each in every cell",
                   [count](const Setting& of, Findings& findings) {
                     // Seen: 0.28 of the square of the count.
                     const std::uint64_t references = std::uint64_t{count} * count * 3 / 10;
                     real_run(count, references <= max_count ? 16 * references : 1u << 30, of,
                              findings);
                   }));
  }
}

}  // namespace

std::vector<Row> tree_rows() {
  return {{30, "staircase codes", staircases},
          {31, "sorted, reversed, shuffled", orders},
          {32, "references past 2^31 and 2^32", counts_past_32_bits}};
}

}  // namespace zkd::stress
