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

constexpr Intersector intersectors[] = {Intersector::watertight, Intersector::fast,
                                        Intersector::single_precision,
                                        Intersector::double_precision, Intersector::exact};

// Rays times triangles. Under the sanitizers a pair takes up to a millisecond, most of it for the
// integers of `exact`, and several times that on a busy machine.
constexpr std::size_t most_pairs = 512;

// One tree, its triangles, the rays that are shot at it, and how.
struct Scene {
  const scene::Mesh& mesh;
  const Tree& tree;
  std::span<const Ray> rays;
  Intersector intersector;

  [[nodiscard]] std::vector<Hit> closest(
      std::span<const Ray> other_rays,
      cpu::InstructionSet set = cpu::InstructionSet::automatic) const {
    return test::closest(tree.view(), mesh.view(), other_rays, {.threads = 1, .instructions = set},
                         intersector);
  }
};

[[noreturn]] void fail_at(const char* what, Intersector intersector, const Ray& ray, const Hit& got,
                          const Hit& want) {
  fail(std::string(what) + ", " + to_string(intersector) + ", ray " + test::print(ray) + ": " +
       test::print(got) + " instead of " + test::print(want));
}

void expect_same(const char* what, const Scene& scene, const std::vector<Hit>& got,
                 std::span<const Hit> want) {
  for (std::size_t i = 0; i < want.size(); ++i) {
    if (!same_bits(got[i], want[i])) {
      fail_at(what, scene.intersector, scene.rays[i], got[i], want[i]);
    }
  }
}

void check_against_brute_force(const Scene& scene, std::span<const Hit> want) {
  const TreeView& tree = scene.tree.view();
  const TriangleView triangles = scene.mesh.view();
  for (const auto set : {cpu::InstructionSet::portable, cpu::InstructionSet::avx2}) {
    expect_same("not as by brute force", scene, scene.closest(scene.rays, set), want);
    std::vector<std::uint8_t> occluded(scene.rays.size(), 7);
    any_hit({.threads = 1, .instructions = set}, tree, triangles, scene.rays, occluded, {},
            scene.intersector);
    for (std::size_t i = 0; i < want.size(); ++i) {
      if (occluded[i] != (is_hit(want[i]) ? 1 : 0)) {
        fail_at("any hit is not closest hit", scene.intersector, scene.rays[i], {}, want[i]);
      }
    }
  }
  for (std::size_t i = 0; i < want.size(); ++i) {
    const Ray& ray = scene.rays[i];
    const Hit hit = test::or_miss(closest_hit(tree, triangles, ray, scene.intersector));
    if (!same_bits(hit, want[i])) fail_at("a single ray", scene.intersector, ray, hit, want[i]);
    if (any_hit(tree, triangles, ray, scene.intersector) != is_hit(want[i])) {
      fail_at("any hit of a single ray", scene.intersector, ray, {}, want[i]);
    }
  }
}

// Cut at the hit, an ulp beside it, before and behind: the nearer part with a hit has the hit.
void check_intervals(const Scene& scene, std::span<const Hit> whole) {
  std::vector<Ray> parts;
  std::vector<std::size_t> of;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const Ray& ray = scene.rays[i];
    const float t = is_hit(whole[i]) ? whole[i].t : 0.25F;
    for (const float cut : {t, test::ulps(t, 1), test::ulps(t, -1), 0.5F * t, 2.0F * t}) {
      if (!(cut >= ray.t_min && cut <= ray.t_max)) continue;
      parts.insert(parts.end(), 2, ray);
      parts[parts.size() - 2].t_max = cut;
      parts.back().t_min = cut;
      of.push_back(i);
    }
  }
  const std::vector<Hit> hits = scene.closest(parts);
  for (std::size_t k = 0; k < of.size(); ++k) {
    const Hit& nearest = is_hit(hits[2 * k]) ? hits[2 * k] : hits[2 * k + 1];
    if (!same_bits(nearest, whole[of[k]])) {
      fail_at("split", scene.intersector, parts[2 * k + 1], nearest, whole[of[k]]);
    }
  }
}

// Zero area and NaN behind the others, with coordinates that would change the scene if they
// counted.
scene::Mesh with_invalid_triangles(scene::Mesh mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(),
                        {{3e37F, -2e30F, 1}, {std::numeric_limits<float>::quiet_NaN(), 0, 0}});
  mesh.faces.emplace_back(first, first, 0);
  mesh.faces.emplace_back(first, first + 1, 0);
  return mesh;
}

bool same_box(const Box& a, const Box& b) {
  return std::equal(a.lo, a.lo + 3, b.lo) && std::equal(a.hi, a.hi + 3, b.hi);
}

// `fewer` lacks the last triangle: the same hit where that was not the answer.
void check_unneeded_triangle(const Scene& fewer, std::span<const Hit> want) {
  const auto last = static_cast<std::uint32_t>(fewer.mesh.faces.size());
  const std::vector<Hit> hits = fewer.closest(fewer.rays);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (want[i].triangle == last) {
      if (is_hit(hits[i]) && hits[i].t < want[i].t) {
        fail_at("nearer without a triangle", fewer.intersector, fewer.rays[i], hits[i], want[i]);
      }
    } else if (!same_bits(hits[i], want[i])) {
      fail_at("without a triangle behind the hit", fewer.intersector, fewer.rays[i], hits[i],
              want[i]);
    }
  }
}

float longest_component(const glm::vec3& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

// Rays that leave the hit forward, back and across: none hits the same triangle again.
// `scene_largest`: of the scene's coordinates.
void check_spawned_rays(const Scene& scene, double scene_largest, std::span<const Hit> hits) {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!is_hit(hits[i])) continue;
    const glm::uvec3 face = scene.mesh.faces[hits[i].triangle];
    float largest = 0.0F;
    for (int c = 0; c < 3; ++c) {
      largest = std::max(largest, longest_component(scene.mesh.positions[face[c]]));
    }
    if (scene.intersector == Intersector::single_precision &&
        static_cast<double>(largest) < 0x1p-100 * scene_largest) {
      continue;
    }
    const glm::vec3 d = scene.rays[i].direction;
    for (const glm::vec3& direction : {d, -d, glm::vec3(d.y, -d.z, d.x)}) {
      // What offset_origin is for, and far from where floats end.
      if (largest > 0x1p120F || longest_component(direction) > 0x1p100F * largest) continue;
      Ray ray;
      ray.origin = offset_origin(scene.mesh.view(), hits[i], direction, scene.intersector);
      ray.direction = direction;
      Hit again;
      closest_hit_brute_force({.threads = 1}, scene.tree.view(),
                              TriangleView(scene.mesh.positions, std::span(&face, 1)),
                              std::span(&ray, 1), std::span(&again, 1), scene.intersector);
      if (is_hit(again)) fail_at("a spawned ray", scene.intersector, ray, again, hits[i]);
    }
  }
}

// A hit whose t is too large for a float is none.
Ray within_float(Ray ray) {
  ray.t_max = std::min(ray.t_max, std::numeric_limits<float>::max());
  return ray;
}

Hit to_hit(const verify::ExactHit& exact) {
  if (!exact.hit) return {};
  return {static_cast<float>(exact.t), 0.0F, 0.0F, exact.ties.front()};
}

// The oracle's triangle, and its t rounded to nearest (by way of a double: either of two).
void check_exact(std::span<const Ray> rays, const verify::Oracle& oracle,
                 std::span<const Hit> hits) {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const verify::ExactHit exact = oracle.closest_hit(within_float(rays[i]));
    const Hit want = to_hit(exact);
    const double off = std::abs(static_cast<double>(hits[i].t) - exact.t);
    const bool same_t = !exact.hit || off <= std::abs(static_cast<double>(want.t) - exact.t);
    if (hits[i].triangle != want.triangle || !same_t) {
      fail_at("not the oracle's", Intersector::exact, rays[i], hits[i], want);
    }
  }
}

void check_against_oracle(const Scene& scene, const verify::Oracle& oracle,
                          std::span<const Hit> hits) {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Ray ray = within_float(scene.rays[i]);
    const verify::Verdict verdict =
        verify::judge(oracle, scene.mesh.view(), ray, hits[i], scene.intersector);
    if (!verdict.in_bound()) {
      fail_at(verdict.t_in_bound ? "u or v" : "t", scene.intersector, ray, hits[i],
              to_hit(oracle.closest_hit(ray)));
    }
    if (verdict.kind == verify::Verdict::correct || verdict.in_band) continue;
    fail_at(verify::to_string(verdict.kind), scene.intersector, ray, hits[i],
            to_hit(oracle.closest_hit(ray)));
  }
}

bool is_power_of_two(float x) {
  int exponent = 0;
  return std::abs(std::frexp(x, &exponent)) == 0.5F;
}

}  // namespace

void check_queries(const scene::Mesh& mesh, const BuildOptions& options,
                   std::span<const Ray> rays) {
  rays =
      rays.first(std::min(rays.size(), most_pairs / std::max<std::size_t>(mesh.faces.size(), 1)));
  const verify::Oracle oracle(mesh.view());
  const scene::Mesh more = with_invalid_triangles(mesh);
  scene::Mesh fewer = mesh;
  if (!fewer.faces.empty()) fewer.faces.pop_back();
  const Tree tree = build(mesh.view(), options);
  const Tree tree_of_more = build(more.view(), options);
  const Tree tree_of_fewer = build(fewer.view(), options);
  // Rays are made ready from the scene's box: only where that is the same, answers must be.
  const bool same_scene = same_box(tree_of_fewer.view().bounds(), tree.view().bounds());
  std::vector<Hit> watertight;
  for (const Intersector intersector : intersectors) {
    const Scene scene{mesh, tree, rays, intersector};
    const std::vector<Hit> want = test::brute_force(
        tree.view(), mesh.view(), rays,
        {.threads = 1, .instructions = cpu::InstructionSet::portable}, intersector);
    check_against_brute_force(scene, want);
    check_intervals(scene, want);
    expect_same("with invalid triangles added", scene,
                Scene{more, tree_of_more, rays, intersector}.closest(rays), want);
    if (same_scene) check_unneeded_triangle({fewer, tree_of_fewer, rays, intersector}, want);
    check_spawned_rays(scene, oracle.largest_coordinate(), want);
    if (intersector == Intersector::exact) check_exact(rays, oracle, want);
    check_against_oracle(scene, oracle, want);
    if (intersector == Intersector::watertight) watertight = want;
    if (intersector == Intersector::double_precision) {
      expect_same("not as watertight", scene, want, watertight);
    }
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
    const Hit want = to_hit(oracle.closest_hit(ray));
    if (hit.triangle != want.triangle || hit.t != want.t) {
      fail_at("not exact", Intersector::watertight, ray, hit, want);
    }
  }
}

}  // namespace zkd::fuzz
