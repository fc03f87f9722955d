// SPDX-License-Identifier: Apache-2.0
//
// What must hold for every ray through every tree. See check_query.hpp.
#include "fuzz/check_query.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <zkd/zkd.hpp>

#include "fuzz/fail.hpp"
#include "support/hits.hpp"
#include "support/random.hpp"
#include "verify/band.hpp"
#include "verify/oracle.hpp"

namespace zkd::fuzz {
namespace {

using test::is_hit;
using test::same_bits;

// One tree, its triangles, and the rays that are shot at it.
struct Scene {
  const scene::Mesh& mesh;
  const Tree& tree;
  std::span<const Ray> rays;
};

[[noreturn]] void fail_at(const char* what, const Ray& ray, const Hit& got, const Hit& want) {
  fail(std::string(what) + ": ray " + test::print(ray) + ": " + test::print(got) + " instead of " +
       test::print(want));
}

std::vector<Hit> closest(const Scene& scene, std::span<const Ray> rays) {
  return test::closest(scene.tree.view(), scene.mesh.view(), rays, {.threads = 1});
}

void check_against_brute_force(const Scene& scene, std::span<const Hit> want) {
  const TreeView& tree = scene.tree.view();
  const TriangleView triangles = scene.mesh.view();
  for (const auto set : {cpu::InstructionSet::portable, cpu::InstructionSet::avx2}) {
    const cpu::Executor executor{.threads = 1, .instructions = set};
    const std::vector<Hit> hits = test::closest(tree, triangles, scene.rays, executor);
    std::vector<std::uint8_t> occluded(scene.rays.size(), 7);
    any_hit(executor, tree, triangles, scene.rays, occluded);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (!same_bits(hits[i], want[i])) {
        fail_at("not as by brute force", scene.rays[i], hits[i], want[i]);
      }
      if (occluded[i] != (is_hit(want[i]) ? 1 : 0)) {
        fail_at("any hit is not closest hit", scene.rays[i], hits[i], want[i]);
      }
    }
  }
  for (std::size_t i = 0; i < want.size(); ++i) {
    const Hit hit = test::or_miss(closest_hit(tree, triangles, scene.rays[i]));
    if (!same_bits(hit, want[i])) fail_at("a single ray", scene.rays[i], hit, want[i]);
    if (any_hit(tree, triangles, scene.rays[i]) != is_hit(want[i])) {
      fail_at("any hit of a single ray", scene.rays[i], hit, want[i]);
    }
  }
}

// Cut at the hit, an ulp beside it, before and behind: the nearer part with a hit has the hit.
void check_intervals(const Scene& scene, std::span<const Hit> whole) {
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const Ray& ray = scene.rays[i];
    const float t = is_hit(whole[i]) ? whole[i].t : 0.25F;
    for (const float cut : {t, test::ulps(t, 1), test::ulps(t, -1), 0.5F * t, 2.0F * t}) {
      if (!(cut >= ray.t_min && cut <= ray.t_max)) continue;
      std::vector<Ray> parts(2, ray);
      parts[0].t_max = cut;
      parts[1].t_min = cut;
      const std::vector<Hit> hits = closest(scene, parts);
      const Hit& nearest = is_hit(hits[0]) ? hits[0] : hits[1];
      if (!same_bits(nearest, whole[i])) fail_at("split", parts[1], nearest, whole[i]);
    }
  }
}

// Zero area behind the others, with coordinates that would change the scene if they counted.
void check_invalid_triangle(const Scene& scene, std::span<const Hit> want) {
  scene::Mesh more = scene.mesh;
  const auto first = static_cast<std::uint32_t>(more.positions.size());
  more.positions.insert(more.positions.end(),
                        {{3e37F, -2e30F, 1}, {std::numeric_limits<float>::quiet_NaN(), 0, 0}});
  more.faces.emplace_back(first, first, 0);
  more.faces.emplace_back(first, first + 1, 0);
  const Tree tree = build(more.view(), scene.tree.options());
  const std::vector<Hit> hits = closest({more, tree, scene.rays}, scene.rays);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!same_bits(hits[i], want[i])) {
      fail_at("with invalid triangles added", scene.rays[i], hits[i], want[i]);
    }
  }
}

bool same_box(const Box& a, const Box& b) {
  return std::equal(a.lo, a.lo + 3, b.lo) && std::equal(a.hi, a.hi + 3, b.hi);
}

// Without the last triangle: the same hit where that was not the answer. Only where the scene's
// box, from which rays are made ready, is the same.
void check_unneeded_triangle(const Scene& scene, std::span<const Hit> want) {
  scene::Mesh fewer = scene.mesh;
  if (fewer.faces.empty()) return;
  fewer.faces.pop_back();
  const auto last = static_cast<std::uint32_t>(fewer.faces.size());
  const Tree tree = build(fewer.view(), scene.tree.options());
  if (!same_box(tree.view().bounds(), scene.tree.view().bounds())) return;
  const std::vector<Hit> hits = closest({fewer, tree, scene.rays}, scene.rays);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (want[i].triangle == last) {
      if (is_hit(hits[i]) && hits[i].t < want[i].t) {
        fail_at("nearer without a triangle", scene.rays[i], hits[i], want[i]);
      }
    } else if (!same_bits(hits[i], want[i])) {
      fail_at("without a triangle behind the hit", scene.rays[i], hits[i], want[i]);
    }
  }
}

void check_against_oracle(const Scene& scene, const verify::Oracle& oracle,
                          std::span<const Hit> hits) {
  constexpr float largest = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    Ray ray = scene.rays[i];
    ray.t_max = std::min(ray.t_max, largest);  // a hit whose t is too large for a float is none
    const verify::Verdict verdict = verify::judge(oracle, scene.mesh.view(), ray, hits[i]);
    if (verdict.kind == verify::Verdict::correct || verdict.in_band) continue;
    const verify::ExactHit exact = oracle.closest_hit(ray);
    Hit want;
    if (exact.hit) want = {static_cast<float>(exact.t), 0.0F, 0.0F, exact.ties.front()};
    fail_at(verify::to_string(verdict.kind), ray, hits[i], want);
  }
}

bool is_power_of_two(float x) {
  int exponent = 0;
  return std::abs(std::frexp(x, &exponent)) == 0.5F;
}

float longest_component(const glm::vec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

}  // namespace

void check_queries(const scene::Mesh& mesh, const BuildOptions& options,
                   std::span<const Ray> rays) {
  const verify::Oracle oracle(mesh.view());
  for (const References references : {References::once, References::all}) {
    BuildOptions with = options;
    with.references = references;
    const Tree tree = build(mesh.view(), with);
    const Scene scene{mesh, tree, rays};
    const std::vector<Hit> want =
        test::brute_force(tree.view(), mesh.view(), rays,
                          {.threads = 1, .instructions = cpu::InstructionSet::portable});
    check_against_brute_force(scene, want);
    check_intervals(scene, want);
    check_invalid_triangle(scene, want);
    check_unneeded_triangle(scene, want);
    if (references == References::once) check_against_oracle(scene, oracle, want);
  }
}

void check_exactly(const scene::Mesh& mesh, const BuildOptions& options,
                   std::span<const Ray> rays) {
  const verify::Oracle oracle(mesh.view());
  const Tree tree = build(mesh.view(), options);
  if (tree.view().empty()) return;
  const Box box = tree.view().bounds();
  float near = 0.0F;  // within this of the scene an origin is not moved
  for (int a = 0; a < 3; ++a) {
    near = std::max({near, 4.0F * std::abs(box.lo[a]), 4.0F * std::abs(box.hi[a])});
  }
  for (const Ray& ray : rays) {
    if (!is_power_of_two(longest_component(ray.direction))) continue;
    if (longest_component(ray.origin) > near) continue;
    const Hit hit = test::or_miss(closest_hit(tree.view(), mesh.view(), ray));
    const verify::ExactHit exact = oracle.closest_hit(ray);
    Hit want;
    want.u = hit.u;
    want.v = hit.v;
    if (exact.hit) want = {static_cast<float>(exact.t), hit.u, hit.v, exact.ties.front()};
    if (hit.triangle != want.triangle || hit.t != want.t) fail_at("not exact", ray, hit, want);
  }
}

}  // namespace zkd::fuzz
