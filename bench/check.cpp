// SPDX-License-Identifier: Apache-2.0
//
// Answers held against the exact oracle, kind by kind.
#include "check.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include <zkd/query.hpp>

#include "rays.hpp"
#include "scene/progress.hpp"
#include "verify/check.hpp"

namespace zkd::bench {
namespace {

// `count` primary rays, spread evenly over an image that has at least so many.
std::vector<Ray> primary_sample(const CheckedScene& scene) {
  auto size = scene.size;
  while (std::uint64_t{size} * size < scene.count) ++size;
  const std::vector<Ray> rays = tiled_primary_rays(scene.camera, size).rays;
  std::vector<Ray> sample;
  sample.reserve(scene.count);
  for (std::uint64_t i = 0; i < scene.count; ++i) {
    sample.push_back(rays[i * rays.size() / scene.count]);
  }
  return sample;
}

std::vector<Hit> trace(const CheckedScene& scene, const Tree& tree, const cpu::Executor& executor,
                       const std::vector<Ray>& rays) {
  std::vector<Hit> hits(rays.size());
  closest_hit(executor, tree.view(), scene.mesh.view(), rays, hits);
  return hits;
}

verify::Summary judge(const CheckedScene& scene, const cpu::Executor& executor,
                      const std::vector<Ray>& rays, const std::vector<Hit>& hits,
                      const std::string& what) {
  scene::Progress progress("checking " + what, rays.size());
  std::uint64_t shown = 0;
  return verify::check(scene.oracle, scene.mesh.view(), rays, hits, executor.threads,
                       [&](std::uint64_t done) {
                         progress.advance(done - shown);
                         shown = done;
                       });
}

Check as_check(const verify::Summary& summary) {
  Check check;
  check.rays = summary.rays;
  check.in_band = {summary.in_band.missed, summary.in_band.phantom, summary.in_band.wrong_triangle};
  check.outside = {summary.missed - check.in_band.missed, summary.phantom - check.in_band.phantom,
                   summary.wrong_triangle - check.in_band.wrong_triangle};
  check.first_offenders = summary.first_offenders;
  if (summary.correct > 0) check.t_ulp_p999 = summary.t_ulp_p999;
  return check;
}

// any_hit is true exactly when closest_hit finds something: anything else is an error of ours.
void count_any_hit_differences(const CheckedScene& scene, const Tree& tree,
                               const cpu::Executor& executor, const std::vector<Ray>& rays,
                               const std::vector<Hit>& hits, Check& check) {
  std::vector<std::uint8_t> occluded(rays.size());
  any_hit(executor, tree.view(), scene.mesh.view(), rays, occluded);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const bool nearest = hits[i].triangle != no_triangle;
    if (nearest && occluded[i] == 0) ++check.outside.missed;
    if (!nearest && occluded[i] != 0) ++check.outside.phantom;
  }
}

}  // namespace

std::map<RayKind, Check> check_tree(const CheckedScene& scene, const Tree& tree,
                                    const cpu::Executor& executor) {
  const std::vector<Ray> primary = primary_sample(scene);
  const std::vector<Hit> primary_hits = trace(scene, tree, executor, primary);
  const Box& box = tree.view().bounds();
  const std::vector<SurfacePoint> points =
      surface_points(scene.mesh.view(), box, primary, primary_hits);

  std::map<RayKind, Check> checks;
  for (const RayKind kind : scene.kinds) {
    if (kind == RayKind::primary) {
      checks[kind] = as_check(judge(scene, executor, primary, primary_hits, to_string(kind)));
      continue;
    }
    const bool shadow = kind == RayKind::shadow;
    const std::vector<Ray> rays =
        shadow ? shadow_rays(points, place_light(scene.camera, box), scene.count, scene.seed)
               : diffuse_rays(points, scene.count, scene.seed);
    const std::vector<Hit> hits = trace(scene, tree, executor, rays);
    Check& check = checks[kind];
    check = as_check(judge(scene, executor, rays, hits, to_string(kind)));
    if (shadow) count_any_hit_differences(scene, tree, executor, rays, hits, check);
  }
  return checks;
}

Check all_kinds(const std::map<RayKind, Check>& checks) {
  const auto add = [](Differences& sum, const Differences& more) {
    sum.missed += more.missed;
    sum.phantom += more.phantom;
    sum.wrong_triangle += more.wrong_triangle;
  };
  Check sum;
  for (const auto& [kind, check] : checks) {
    sum.rays += check.rays;
    add(sum.outside, check.outside);
    add(sum.in_band, check.in_band);
    if (check.t_ulp_p999) {
      sum.t_ulp_p999 = std::max(sum.t_ulp_p999.value_or(0.0), *check.t_ulp_p999);
    }
  }
  return sum;
}

bool is_closed(const scene::Mesh& mesh) {
  std::vector<std::tuple<std::uint32_t, std::uint32_t, bool>> edges;
  edges.reserve(3 * mesh.faces.size());
  for (const glm::uvec3& face : mesh.faces) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t from = face[corner];
      const std::uint32_t to = face[(corner + 1) % 3];
      if (from == to) return false;
      edges.emplace_back(std::min(from, to), std::max(from, to), from < to);
    }
  }
  if (edges.empty() || edges.size() % 2 != 0) return false;
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    const auto& [low, high, forward] = edges[i];
    const auto& [next_low, next_high, next_forward] = edges[i + 1];
    if (low != next_low || high != next_high || forward == next_forward) return false;
    const bool third = i + 2 < edges.size() && std::get<0>(edges[i + 2]) == low &&
                       std::get<1>(edges[i + 2]) == high;
    if (third) return false;
  }
  return true;
}

std::uint64_t count_leaks(const CheckedScene& scene, const Tree& tree,
                          const cpu::Executor& executor) {
  std::vector<Ray> rays = primary_sample(scene);
  std::vector<Hit> hits = trace(scene, tree, executor, rays);
  const std::vector<SurfacePoint> points =
      surface_points(scene.mesh.view(), tree.view().bounds(), rays, hits, Side::back);
  rays = diffuse_rays(points, scene.count, scene.seed);
  hits = trace(scene, tree, executor, rays);
  return judge(scene, executor, rays, hits, "leaks").missed;
}

}  // namespace zkd::bench
