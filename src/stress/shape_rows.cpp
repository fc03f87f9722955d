// SPDX-License-Identifier: Apache-2.0
//
// Rows 22 to 24: slivers, needles and triangles as large as the scene.
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <zkd/build.hpp>

#include "scene/generate.hpp"
#include "scene/random.hpp"
#include "stress/case.hpp"
#include "verify/counting_resource.hpp"

namespace zkd::stress {
namespace {

using scene::Mesh;
using scene::Random;

void slivers(const Setting& setting, const Yield& yield) {
  for (const float aspect : {1e2F, 1e3F, 1e4F, 1e5F, 1e6F, 1e7F}) {
    yield(hard_case("aspect " + std::to_string(static_cast<int>(aspect)),
                    scene::slivers(setting.pick(300u, 20000u), aspect, setting.seed),
                    setting.size == Size::small ? many_options() : only_once(),
                    setting.pick(1800u, 10000u)));
  }
}

// `budget` and `automatic` keep within the budget and report what they used; until they exist they
// say so.
void check_budget(const Traced& traced, Findings& findings) {
  for (const References policy : {References::budget, References::automatic}) {
    BuildOptions options = with(policy);
    const TriangleView triangles = traced.of.mesh.view();
    try {
      const Tree tree = build(triangles, options);
      const auto most =
          static_cast<double>(options.budget) * static_cast<double>(triangles.triangle_count);
      findings.expect(static_cast<double>(tree.statistics().references) <= most,
                      std::string(to_string(policy)) + " is above its budget");
      findings.expect(tree.statistics().references == tree.references().size(),
                      std::string(to_string(policy)) + " reports another number of references");
    } catch (const Error& error) {
      findings.expect(error.code() == ErrorCode::unsupported_option,
                      std::string(to_string(policy)) + ": " + error.what());
      findings.note("budget and auto are not in this version: they say so");
    }
  }
}

// `all` with little memory: the whole tree, or one error that says how much is needed.
void check_all_in(std::size_t bytes, const Mesh& mesh, Findings& findings) {
  verify::CountingResource memory;
  memory.limit = bytes;
  try {
    const Tree tree = build(cpu::Executor{.memory = &memory}, mesh.view(), with(References::all));
    findings.expect(tree.references().size() >= mesh.faces.size(), "references are cut off");
  } catch (const Error& error) {
    findings.expect(
        error.code() == ErrorCode::out_of_memory || error.code() == ErrorCode::too_many_references,
        std::string("all: ") + error.what());
    findings.expect(error.offender() > 0, "an error without the size that is needed");
  }
  findings.expect(memory.live_bytes() == 0, "memory is not given back");
}

Case large_case(std::string name, Mesh mesh, std::vector<BuildOptions> options,
                const Setting& setting) {
  Case made =
      hard_case(std::move(name), std::move(mesh), std::move(options), setting.pick(1200u, 2000u));
  made.oracle_rays = setting.pick(0u, 100u);
  made.also = check_budget;
  return made;
}

void needles(const Setting& setting, const Yield& yield) {
  const std::uint32_t few = setting.pick(300u, 3000u);
  Case both =
      large_case("once and all", scene::needles(few, setting.seed), once_and_all(), setting);
  both.also = [](const Traced& traced, Findings& findings) {
    check_budget(traced, findings);
    for (const std::size_t bytes : {std::size_t{1} << 16, std::size_t{1} << 20}) {
      check_all_in(bytes, traced.of.mesh, findings);
    }
  };
  yield(std::move(both));
  yield(large_case("once", scene::needles(setting.pick(2000u, 100000u), setting.seed), only_once(),
                   setting));
}

// Corners anywhere on the walls of a room.
Mesh room_sized(std::uint32_t count, std::uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (int corner = 0; corner < 3; ++corner) {
      glm::vec3 p = random.point();
      p[random.integer(0, 2)] = random.one_in(2) ? 0.0F : 1.0F;
      mesh.positions.push_back(p);
    }
    mesh.faces.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

void room_sized_triangles(const Setting& setting, const Yield& yield) {
  Case both = large_case("once and all", room_sized(setting.pick(300u, 3000u), setting.seed),
                         once_and_all(), setting);
  both.also = [](const Traced& traced, Findings& findings) {
    check_budget(traced, findings);
    for (const std::size_t bytes : {std::size_t{1} << 16, std::size_t{1} << 20}) {
      check_all_in(bytes, traced.of.mesh, findings);
    }
  };
  yield(std::move(both));
  yield(large_case("once", room_sized(setting.pick(2000u, 100000u), setting.seed), only_once(),
                   setting));
}

}  // namespace

std::vector<Row> shape_rows() {
  return {{22, "slivers", slivers},
          {23, "diagonal needles", needles},
          {24, "room-sized triangles", room_sized_triangles}};
}

}  // namespace zkd::stress
