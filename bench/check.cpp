// SPDX-License-Identifier: Apache-2.0
//
// Answers held against the exact oracle, kind by kind.
#include "check.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "rays.hpp"
#include "scene/closed.hpp"
#include "scene/progress.hpp"
#include "verify/check.hpp"
#include "verify/oracle.hpp"

namespace zkd::bench {
namespace {

struct CheckedScene {
  const scene::Mesh& mesh;
  const verify::Oracle& oracle;
  const scene::Camera& camera;
  const std::vector<RayKind>& kinds;
  unsigned size;        // of the timed image: its rays are taken where they are enough
  std::uint64_t count;  // rays of each kind
  std::uint64_t seed;
  Intersector intersector;
  int threads;
};

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

std::vector<Hit> trace(ZkdContender& contender, const std::vector<Ray>& rays) {
  std::vector<Hit> hits(rays.size());
  contender.closest_hit(rays, hits);
  return hits;
}

verify::Summary judge(const CheckedScene& scene, const std::vector<Ray>& rays,
                      const std::vector<Hit>& hits, const std::string& what) {
  scene::Progress progress("checking " + what, rays.size());
  std::uint64_t shown = 0;
  return verify::check(
      scene.oracle, scene.mesh.view(), rays, hits, scene.threads,
      [&](std::uint64_t done) {
        progress.advance(done - shown);
        shown = done;
      },
      scene.intersector);
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
void count_any_hit_differences(ZkdContender& contender, const std::vector<Ray>& rays,
                               const std::vector<Hit>& hits, Check& check) {
  std::vector<std::uint8_t> occluded(rays.size());
  contender.any_hit(rays, occluded);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const bool nearest = hits[i].triangle != no_triangle;
    if (nearest && occluded[i] == 0) ++check.outside.missed;
    if (!nearest && occluded[i] != 0) ++check.outside.phantom;
  }
}

std::map<RayKind, Check> check_tree(const CheckedScene& scene, ZkdContender& contender) {
  const std::vector<Ray> primary = primary_sample(scene);
  const std::vector<Hit> primary_hits = trace(contender, primary);
  const Box box = contender.tree().view().bounds();
  const std::vector<SurfacePoint> points =
      surface_points(scene.mesh.view(), box, primary, primary_hits);

  std::map<RayKind, Check> checks;
  for (const RayKind kind : scene.kinds) {
    if (kind == RayKind::primary) {
      checks[kind] = as_check(judge(scene, primary, primary_hits, to_string(kind)));
      continue;
    }
    const bool shadow = kind == RayKind::shadow;
    const std::vector<Ray> rays =
        shadow ? shadow_rays(points, place_light(scene.camera, box), scene.count, scene.seed)
               : diffuse_rays(points, scene.count, scene.seed);
    const std::vector<Hit> hits = trace(contender, rays);
    Check& check = checks[kind];
    check = as_check(judge(scene, rays, hits, to_string(kind)));
    if (shadow) count_any_hit_differences(contender, rays, hits, check);
  }
  return checks;
}

// All kinds in one. t_ulp_p999 is the largest of theirs, which that of all rays together cannot
// exceed.
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

std::uint64_t count_leaks(const CheckedScene& scene, ZkdContender& contender) {
  std::vector<Ray> rays = primary_sample(scene);
  std::vector<Hit> hits = trace(contender, rays);
  const std::vector<SurfacePoint> points =
      surface_points(scene.mesh.view(), contender.tree().view().bounds(), rays, hits, Side::back);
  rays = diffuse_rays(points, scene.count, scene.seed);
  hits = trace(contender, rays);
  return judge(scene, rays, hits, "leaks").missed;
}

// A loop over all triangles is the oracle's own choice for small meshes; with many rays it is long.
verify::Oracle::Search search_for(const Options& options, std::size_t triangles) {
  const bool many = static_cast<double>(options.check) * static_cast<double>(triangles) > 1e8;
  return many ? verify::Oracle::Search::box_tree : verify::Oracle::Search::automatic;
}

class OracleChecker final : public Checker {
 public:
  OracleChecker(const scene::Mesh& mesh, const scene::Camera& camera, const Options& options,
                int threads)
      : oracle_(mesh.view(), search_for(options, mesh.faces.size())),
        scene_{mesh,         oracle_,       camera,       options.rays,
               options.size, options.check, options.seed, options.intersector,
               threads},
        closed_(scene::is_closed(mesh)) {}

  void check(ZkdContender& contender, Result& result) const override {
    result.checks = check_tree(scene_, contender);
    result.check = all_kinds(result.checks);
    if (closed_) result.check->leaks = count_leaks(scene_, contender);
  }

 private:
  verify::Oracle oracle_;
  CheckedScene scene_;
  bool closed_;
};

}  // namespace

std::unique_ptr<Checker> make_checker(const scene::Mesh& mesh, const scene::Camera& camera,
                                      const Options& options, int threads) {
  return std::make_unique<OracleChecker>(mesh, camera, options, threads);
}

}  // namespace zkd::bench
