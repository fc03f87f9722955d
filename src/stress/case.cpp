// SPDX-License-Identifier: Apache-2.0
//
// What rows are made of, and the table of all.
#include "stress/case.hpp"

#include <algorithm>
#include <utility>

#include "scene/hard_rays.hpp"

namespace zkd::stress {

BuildOptions with(References references, std::uint32_t leaf_size, std::uint32_t code_bits) {
  BuildOptions options;
  options.references = references;
  options.leaf_size = leaf_size;
  options.code_bits = code_bits;
  options.invalid_triangles = InvalidTriangles::skip;
  return options;
}

std::vector<BuildOptions> only_once() { return {with(References::once)}; }

std::vector<BuildOptions> once_and_all() { return {with(References::once), with(References::all)}; }

std::vector<BuildOptions> many_options() {
  std::vector<BuildOptions> options = {with(References::once),         with(References::all),
                                       with(References::once, 1, 64),  with(References::all, 1, 12),
                                       with(References::once, 16, 21), with(References::all, 9),
                                       with(References::budget),       with(References::automatic),
                                       with(References::once, 2),      with(References::budget, 1)};
  options[8].quality = options[9].quality = Quality::balanced;
  options[2].axis_order = options[5].axis_order = AxisOrder::cyclic;
  options[3].recode_crowded = options[4].recode_crowded = false;
  return options;
}

Case hard_case(std::string name, scene::Mesh mesh, std::vector<BuildOptions> options,
               std::uint32_t ray_count) {
  Case made;
  made.name = std::move(name);
  made.mesh = std::move(mesh);
  made.options = std::move(options);
  made.ray_count = ray_count;
  made.rays = [](const scene::Mesh& of, const TreeView& tree, std::uint32_t count,
                 std::uint64_t seed) {
    std::vector<Ray> rays = scene::hard_rays(of, tree, count, seed);
    rays.resize(std::min<std::size_t>(rays.size(), count + count / 4));
    return rays;
  };
  return made;
}

Case own_case(std::string name, std::function<void(const Setting&, Findings&)> own) {
  Case made;
  made.name = std::move(name);
  made.own = std::move(own);
  return made;
}

void expect_error(Findings& findings, const std::string& what, ErrorCode code,
                  std::uint64_t offender, const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    findings.expect(error.code() == code, what + ": " + to_string(error.code()) + " instead of " +
                                              to_string(code) + ": " + error.what());
    findings.expect(error.offender() == offender, what + ": names " +
                                                      std::to_string(error.offender()) +
                                                      " instead of " + std::to_string(offender));
    findings.expect(
        std::string(error.what()).find(std::to_string(offender)) != std::string::npos,
        what + ": the message does not name " + std::to_string(offender) + ": " + error.what());
    return;
  }
  findings.fail(what + ": no error");
}

scene::Mesh without(const scene::Mesh& mesh, const std::vector<bool>& leave_out,
                    std::vector<std::uint32_t>& ids) {
  scene::Mesh rest;
  rest.positions = mesh.positions;
  ids.clear();
  for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) {
    if (leave_out[i]) continue;
    rest.faces.push_back(mesh.faces[i]);
    ids.push_back(i);
  }
  return rest;
}

std::span<const Row> rows() {
  static const std::vector<Row> all = [] {
    std::vector<Row> table;
    for (const auto& some : {input_rows(), crowd_rows(), place_rows(), plane_rows(), shape_rows(),
                             surface_rows(), tree_rows(), ray_rows(), rule_rows(), memory_rows()}) {
      table.insert(table.end(), some.begin(), some.end());
    }
    std::sort(table.begin(), table.end(),
              [](const Row& a, const Row& b) { return a.number < b.number; });
    return table;
  }();
  return all;
}

}  // namespace zkd::stress
