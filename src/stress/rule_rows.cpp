// SPDX-License-Identifier: Apache-2.0
//
// Rows 41 to 45 and 49: the documented rules of rays and their ends.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <zkd/build.hpp>
#include <zkd/query.hpp>

#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "scene/hard_rays.hpp"
#include "scene/random.hpp"
#include "stress/case.hpp"
#include "verify/hits.hpp"
#include "verify/oracle.hpp"

namespace zkd::stress {
namespace {

using scene::Mesh;
using scene::Random;
using scene::ray_between;
using scene::RayMaker;
using verify::is_hit;
using verify::print;
using verify::same_bits;

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
constexpr float smallest = std::numeric_limits<float>::denorm_min();

std::vector<BuildOptions> some_options(const Setting& setting) {
  return setting.size == Size::small ? many_options() : once_and_all();
}

std::vector<scene::NamedMesh> meshes(const Setting& setting) {
  const std::uint32_t count = setting.pick(300u, 20000u);
  std::vector<scene::NamedMesh> all;
  all.push_back({"soup", scene::soup(count, setting.seed)});
  all.push_back({"sphere", scene::sphere(setting.pick(2u, 6u))});
  all.push_back({"grid", scene::grid(setting.pick(3u, 16u))});
  all.push_back({"integers", scene::integer_mesh(count / 4, 4, setting.seed)});
  return all;
}

std::vector<Hit> trace(const Traced& traced, std::span<const Ray> rays) {
  std::vector<Hit> hits(rays.size());
  closest_hit(cpu::Executor{.threads = traced.threads}, traced.trees[0]->view(),
              traced.of.mesh.view(), rays, hits);
  return hits;
}

// ---- 41: origins on surfaces --------------------------------------------------------------------

// A point of a triangle, of a split plane, a corner of a cell.
glm::vec3 origin_on(RayMaker& maker) {
  switch (maker.random().below(4)) {
    case 0:
      return maker.vertex();
    case 1:
      return maker.on_edge();
    case 2:
      return maker.on_face();
    default:
      return maker.cell_corner();
  }
}

// In turn: t_min = 0, and just above it.
std::vector<Ray> from_surfaces(const Mesh& mesh, const TreeView& tree, std::uint32_t count,
                               std::uint64_t seed) {
  RayMaker maker(mesh, tree, seed);
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i + 1 < count; i += 2) {
    Ray ray =
        ray_between(origin_on(maker), maker.random().one_in(2) ? maker.inside() : maker.vertex());
    rays.push_back(ray);
    ray.t_min = smallest;
    rays.push_back(ray);
  }
  return rays;
}

void origins_on_surfaces(const Setting& setting, const Yield& yield) {
  for (scene::NamedMesh& mesh : meshes(setting)) {
    Case made = hard_case(mesh.name, std::move(mesh.mesh), some_options(setting),
                          setting.pick(1800u, 40000u));
    made.rays = from_surfaces;
    made.oracle_rays = setting.pick(0u, 3000u);
    made.also = [](const Traced& traced, Findings& findings) {
      std::uint64_t at_zero = 0;
      for (std::size_t i = 0; i + 1 < traced.rays.size(); i += 2) {
        const Hit& with_zero = traced.hits[i];
        const Hit& without_zero = traced.hits[i + 1];
        at_zero += is_hit(with_zero) && with_zero.t == 0.0F ? 1 : 0;
        findings.expect(without_zero.t > 0.0F,
                        "a hit before t_min, ray " + print(traced.rays[i + 1]));
        findings.expect(with_zero.t == 0.0F || same_bits(with_zero, without_zero),
                        "t_min = 0 and just above differ, ray " + print(traced.rays[i]));
      }
      findings.expect(at_zero > 0, "no hit at the origin: the row says nothing");
    };
    yield(std::move(made));
  }
}

// ---- 42: spawned rays ---------------------------------------------------------------------------

// Any direction; towards another vertex of the scene; along an axis; or nearly in the plane.
glm::vec3 spawned_direction(RayMaker& maker, const Mesh& mesh, const Hit& from,
                            const glm::vec3& origin) {
  Random& random = maker.random();
  const glm::uvec3& face = mesh.faces[from.triangle];
  const glm::vec3 e = mesh.positions[face.y] - mesh.positions[face.x];
  const glm::vec3 f = mesh.positions[face.z] - mesh.positions[face.x];
  glm::vec3 direction{0.0F};
  switch (random.below(4)) {
    case 0:
      direction = maker.size() * random.in_cube();
      break;
    case 1:
      direction = maker.vertex() - origin;
      break;
    case 2:
      direction[random.integer(0, 2)] = random.one_in(2) ? maker.size() : -maker.size();
      break;
    default:
      direction = random.signed_unit() * e + random.signed_unit() * f +
                  (1e-6F * maker.size()) * random.in_cube();
      break;
  }
  return direction;
}

// Rays that leave a surface do not meet the triangle they leave, by the same intersector. Each is
// shot at that triangle alone, so that nothing in front hides a hit; the tree lends its scale.
void spawn(const Traced& traced, Intersector intersector, std::size_t count, Findings& findings) {
  const Mesh& mesh = traced.of.mesh;
  const TreeView& tree = traced.trees[0]->view();
  const TriangleView triangles = mesh.view();
  std::vector<Hit> hits(traced.rays.size());
  closest_hit(cpu::Executor{.threads = traced.threads}, tree, triangles, traced.rays, hits, {},
              intersector);
  std::erase_if(hits, [](const Hit& hit) { return !is_hit(hit); });
  findings.expect(hits.size() > 20, "few hits to spawn rays from");
  if (hits.empty()) return;
  RayMaker maker(mesh, tree, 1);
  for (std::size_t i = 0; i < count; ++i) {
    const Hit& from = hits[i % hits.size()];
    const glm::vec3 at = mesh.positions[mesh.faces[from.triangle].x];
    Ray ray;
    ray.direction = spawned_direction(maker, mesh, from, at);
    ray.origin = offset_origin(triangles, from, ray.direction, intersector);
    TriangleView alone = triangles;
    alone.indices += std::size_t{3} * from.triangle;
    alone.triangle_count = 1;
    Hit again;
    closest_hit_brute_force(cpu::Executor{.threads = 1}, tree, alone, std::span(&ray, 1),
                            std::span(&again, 1), intersector);
    findings.expect(!is_hit(again), std::string(to_string(intersector)) + ": hits triangle " +
                                        std::to_string(from.triangle) + " again: " + print(again) +
                                        ", ray " + print(ray));
  }
  findings.rays += count;
}

void spawned_rays(const Setting& setting, const Yield& yield) {
  std::vector<scene::NamedMesh> all = meshes(setting);
  const std::uint32_t count = setting.pick(300u, 20000u);
  all.push_back({"slivers", scene::slivers(count, 1e4F, setting.seed)});
  all.push_back({"far soup", scene::offset(scene::soup(count, setting.seed), {148376, 1e6F, 0})});
  all.push_back({"tiny sphere", scene::scaled(scene::sphere(3), -100)});
  all.push_back({"huge sphere", scene::scaled(scene::sphere(3), 90)});
  all.push_back({"many scales", scene::many_scales(count, setting.seed)});
  for (scene::NamedMesh& mesh : all) {
    Case made =
        hard_case(mesh.name, std::move(mesh.mesh), once_and_all(), setting.pick(1200u, 20000u));
    made.oracle_rays = setting.pick(0u, 1000u);
    const std::size_t spawned = setting.pick(2000u, 120000u);
    made.also = [spawned](const Traced& traced, Findings& findings) {
      spawn(traced, Intersector::watertight, spawned, findings);
      for (const Intersector other : {Intersector::fast, Intersector::single_precision,
                                      Intersector::double_precision, Intersector::exact}) {
        spawn(traced, other, spawned / 8, findings);
      }
    };
    yield(std::move(made));
  }
}

// ---- 43: ends -----------------------------------------------------------------------------------

void ends(const Setting& setting, const Yield& yield) {
  for (scene::NamedMesh& mesh : meshes(setting)) {
    Case made = hard_case(mesh.name, std::move(mesh.mesh), some_options(setting),
                          setting.pick(1200u, 40000u));
    made.oracle_rays = setting.pick(0u, 3000u);
    made.also = [](const Traced& traced, Findings& findings) {
      enum End { max_at, max_before, min_at, min_behind, both_at, crossed, count };
      std::vector<Ray> cut;
      std::vector<std::size_t> of;
      for (std::size_t i = 0; i < traced.rays.size(); ++i) {
        if (!is_hit(traced.hits[i])) continue;
        const float t = traced.hits[i].t;
        std::vector<Ray> ends_of(count, traced.rays[i]);
        ends_of[max_at].t_max = t;
        ends_of[max_before].t_max = scene::ulps(t, -1);
        ends_of[min_at].t_min = t;
        ends_of[min_behind].t_min = scene::ulps(t, 1);
        ends_of[both_at].t_min = ends_of[both_at].t_max = t;
        ends_of[crossed].t_min = scene::ulps(t, 1);
        ends_of[crossed].t_max = t;
        cut.insert(cut.end(), ends_of.begin(), ends_of.end());
        of.push_back(i);
      }
      const std::vector<Hit> hits = trace(traced, cut);
      for (std::size_t k = 0; k < of.size(); ++k) {
        const Hit& whole = traced.hits[of[k]];
        const std::span<const Hit> got = std::span(hits).subspan(count * k, count);
        const std::string ray = ", ray " + print(traced.rays[of[k]]);
        findings.expect(same_bits(got[max_at], whole), "t_max at the hit loses it" + ray);
        findings.expect(same_bits(got[min_at], whole), "t_min at the hit loses it" + ray);
        findings.expect(same_bits(got[both_at], whole), "t_min = t_max at the hit loses it" + ray);
        findings.expect(!is_hit(got[max_before]), "a hit nearer than the nearest" + ray);
        findings.expect(!is_hit(got[min_behind]) || got[min_behind].t > whole.t,
                        "a hit before t_min" + ray);
        findings.expect(!is_hit(got[crossed]), "a hit though t_min > t_max" + ray);
      }
      // Near part and far part of an interval together give the nearest hit of the whole.
      Random random(1);
      std::vector<Ray> parts;
      for (const Ray& ray : traced.rays) {
        const float t = 2.0F * random.unit();
        parts.push_back(ray);
        parts.back().t_max = std::clamp(t, ray.t_min, ray.t_max);
        parts.push_back(ray);
        parts.back().t_min = std::clamp(t, ray.t_min, ray.t_max);
      }
      const std::vector<Hit> of_parts = trace(traced, parts);
      for (std::size_t i = 0; i < traced.rays.size(); ++i) {
        const Hit& nearest = is_hit(of_parts[2 * i]) ? of_parts[2 * i] : of_parts[2 * i + 1];
        findings.expect(same_bits(nearest, traced.hits[i]),
                        "another hit where the interval is split, ray " + print(traced.rays[i]));
      }
    };
    yield(std::move(made));
  }
}

// ---- 44: lengths of directions ------------------------------------------------------------------

// 2^-66 to 2^60: 1e-20 to 1e18. The first is the ray as it is.
constexpr int exponents[] = {0, -66, -40, -20, -1, 1, 20, 40, 60};
constexpr std::size_t lengths = std::size(exponents);

std::vector<Ray> of_all_lengths(const Mesh& mesh, const TreeView& tree, std::uint32_t count,
                                std::uint64_t seed) {
  RayMaker maker(mesh, tree, seed);
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i + lengths <= count; i += lengths) {
    Ray ray = maker.of_kind(maker.random().integer(0, 6));
    ray.direction *= 1.0F + maker.random().unit();
    for (const int exponent : exponents) {
      rays.push_back(ray);
      rays.back().direction *= std::ldexp(1.0F, exponent);
    }
  }
  return rays;
}

void direction_lengths(const Setting& setting, const Yield& yield) {
  for (scene::NamedMesh& mesh : meshes(setting)) {
    Case made = hard_case(mesh.name, std::move(mesh.mesh), some_options(setting),
                          setting.pick(5400u, 90000u));
    made.rays = of_all_lengths;
    made.oracle_rays = setting.pick(0u, 3000u);
    made.also = [](const Traced& traced, Findings& findings) {
      for (std::size_t i = 0; i < traced.rays.size(); ++i) {
        const std::size_t first = i / lengths * lengths;
        const int exponent = exponents[i % lengths];
        // A direction that lost bits is another direction.
        const glm::vec3 back = traced.rays[i].direction * std::ldexp(1.0F, -exponent);
        if (back != traced.rays[first].direction) continue;
        Hit want = traced.hits[first];
        want.t = std::ldexp(want.t, -exponent);
        if (is_hit(want) && std::ldexp(want.t, exponent) != traced.hits[first].t) continue;
        findings.expect(same_bits(traced.hits[i], want),
                        print(traced.hits[i]) + " instead of " + print(want) + " for 2^" +
                            std::to_string(exponent) + " times the direction, ray " +
                            print(traced.rays[i]));
      }
    };
    yield(std::move(made));
  }
}

// ---- 45: what is no ray -------------------------------------------------------------------------

Ray spoilt(Ray ray, Random& random) {
  const float bad[] = {nan_value, -nan_value, infinity, -infinity};
  const int axis = random.integer(0, 2);
  switch (random.below(6)) {
    case 0:
      ray.origin[axis] = bad[random.below(4)];
      break;
    case 1:
      ray.direction[axis] = bad[random.below(4)];
      break;
    case 2:
      ray.direction = {random.one_in(2) ? 0.0F : -0.0F, random.one_in(2) ? 0.0F : -0.0F, 0.0F};
      break;
    case 3:
      ray.t_min = nan_value;
      break;
    case 4:
      ray.t_max = bad[random.below(2)];
      break;
    default:
      ray.t_min = random.one_in(2) ? 1.0F : infinity;
      ray.t_max = random.one_in(2) ? 0.5F : -infinity;
      break;
  }
  return ray;
}

double ms_to_trace(const Traced& traced, std::span<const Ray> rays) {
  double least = infinity;
  for (int i = 0; i < 5; ++i) {
    const auto start = std::chrono::steady_clock::now();
    (void)trace(traced, rays);
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
    least = std::min(least, time.count());
  }
  return least;
}

void no_rays(const Setting& setting, const Yield& yield) {
  for (scene::NamedMesh& mesh : meshes(setting)) {
    Case made = hard_case(mesh.name, std::move(mesh.mesh), some_options(setting),
                          setting.pick(3000u, 60000u));
    made.hits = Case::Hits::none;
    made.rays = [](const Mesh& of, const TreeView& tree, std::uint32_t count, std::uint64_t seed) {
      RayMaker maker(of, tree, seed);
      std::vector<Ray> rays;
      for (std::uint32_t i = 0; i < count; ++i) {
        rays.push_back(spoilt(ray_between(maker.around(), maker.on_face()), maker.random()));
      }
      return rays;
    };
    made.also = [large = setting.size == Size::large](const Traced& traced, Findings& findings) {
      for (std::size_t i = 0; i < traced.rays.size(); ++i) {
        findings.expect(traced.costs[i].node_visits == 0 && traced.costs[i].triangle_tests == 0,
                        "not a miss at once: ray " + print(traced.rays[i]));
        findings.expect(same_bits(traced.hits[i], Hit{}), "a miss is not as documented");
      }
      if (!large) return;
      const Box box = traced.trees[0]->view().bounds();
      const std::vector<Ray> good =
          scene::random_rays(box, static_cast<std::uint32_t>(traced.rays.size()), 1);
      const double bad_ms = ms_to_trace(traced, traced.rays);
      const double good_ms = ms_to_trace(traced, good);
      findings.expect(bad_ms <= good_ms, "degenerate rays take " + std::to_string(bad_ms) +
                                             " ms, good ones " + std::to_string(good_ms));
    };
    yield(std::move(made));
  }
}

// ---- 49: any hit --------------------------------------------------------------------------------

// What every case of every row is asked, here for each kind of mesh and rays with ends of all
// kinds.
void any_hits(const Setting& setting, const Yield& yield) {
  for (int kind = 0; kind < scene::small_mesh_kinds; ++kind) {
    for (std::uint64_t i = 0; i < setting.pick(1u, 10u); ++i) {
      scene::NamedMesh mesh = scene::small_mesh(kind, 100 * setting.seed + i);
      Case made =
          hard_case(mesh.name, std::move(mesh.mesh), many_options(), setting.pick(480u, 12000u));
      made.also = [](const Traced& traced, Findings& findings) {
        for (std::size_t k = 0; k < traced.rays.size(); ++k) {
          const bool any = any_hit(traced.trees[0]->view(), traced.of.mesh.view(), traced.rays[k]);
          findings.expect(any == is_hit(traced.hits[k]),
                          "any hit of a single ray: " + print(traced.rays[k]));
        }
      };
      yield(std::move(made));
    }
  }
}

}  // namespace

std::vector<Row> rule_rows() {
  return {{41, "origin on a surface or plane", origins_on_surfaces},
          {42, "spawned rays", spawned_rays},
          {43, "t at t_min and t_max", ends},
          {44, "direction length 1e-20 to 1e18", direction_lengths},
          {45, "NaN, Inf, zero in a ray", no_rays},
          {49, "any hit = closest hit exists", any_hits}};
}

}  // namespace zkd::stress
