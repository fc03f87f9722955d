// SPDX-License-Identifier: Apache-2.0
//
// Every setting in turn, again and again, under the clock.
#include "curves.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "contender.hpp"
#include "runner.hpp"
#include "scene/progress.hpp"
#include "spread.hpp"

namespace zkd::bench::accuracy {
namespace {

struct Entrant {
  std::string name;
  std::string family;
  bool peer = false;
  bool cuda = false;
  bool by_intersector = false;
  std::optional<Intersector> judged_as;  // by whose band; nothing for other walks and peers
  std::unique_ptr<Runner> runner;
  double references_per_triangle = 0.0;
  Samples build_ms;
  struct OfSet {
    std::size_t stride = 1;
    std::vector<Ray> rays;  // every stride-th; empty where the stride is 1
    Samples trace_ms;
    Score score;
  };
  std::vector<OfSet> of_set;
};

std::vector<Ray> every(std::span<const Ray> rays, std::size_t stride) {
  std::vector<Ray> some;
  for (std::size_t i = 0; i < rays.size(); i += stride) some.push_back(rays[i]);
  return some;
}

// How many rays to pass over so that the others take no longer than that.
std::size_t stride_for(Runner& runner, const RaySet& set, double longest_ms) {
  constexpr std::size_t sample_size = 256;
  const std::vector<Ray> sample =
      every(set.rays, std::max<std::size_t>(1, set.rays.size() / sample_size));
  std::vector<Hit> hits(sample.size());
  const double expected = runner.closest_hit(sample, hits) * static_cast<double>(set.rays.size()) /
                          static_cast<double>(sample.size());
  return static_cast<std::size_t>(std::max(1.0, std::ceil(expected / longest_ms)));
}

class Measurement {
 public:
  Measurement(const TestScene& scene, const std::vector<RaySet>& sets, const verify::Oracle& oracle,
              const cpu::Executor& executor, const CurveOptions& options)
      : scene_(scene), sets_(sets), oracle_(oracle), executor_(executor), options_(options) {}

  std::vector<Point> run() {
    std::vector<Entrant> entrants;
    for (const Setting& setting : all_settings(options_.beside.cuda)) {
      if (options_.intersectors_only && !is_intersector_setting(setting)) continue;
      Entrant entrant;
      entrant.name = setting.name;
      entrant.family = setting.family;
      entrant.cuda = setting.cuda;
      entrant.by_intersector = is_intersector_setting(setting);
      if (setting.walk == Walk::library) entrant.judged_as = setting.intersector;
      entrant.runner = make_runner(setting, scene_.mesh, executor_);
      entrants.push_back(std::move(entrant));
    }
    if (options_.beside.peers) {
      for (Peer& peer : make_peers(scene_.mesh, executor_.threads)) {
        Entrant entrant;
        entrant.name = peer.name;
        entrant.family = "embree";
        entrant.peer = true;
        entrant.runner = std::move(peer.runner);
        entrants.push_back(std::move(entrant));
      }
    }

    scene::Progress progress(scene_.name + ": run time against error",
                             entrants.size() * options_.repeat);
    for (unsigned repetition = 0; repetition < options_.repeat; ++repetition) {
      for (Entrant& entrant : entrants) {
        measure(entrant, repetition == 0);
        progress.advance(1);
      }
    }
    progress.finish();

    std::vector<Point> points;
    for (const Entrant& entrant : entrants) {
      for (const char* group : {"workload", "adversarial"}) add_point(entrant, group, points);
    }
    return points;
  }

 private:
  void measure(Entrant& entrant, bool first) {
    entrant.build_ms.push_back(entrant.runner->build());
    if (first) {
      entrant.references_per_triangle = entrant.runner->references_per_triangle();
      entrant.of_set.resize(sets_.size());
    }
    for (std::size_t i = 0; i < sets_.size(); ++i) {
      const RaySet& set = sets_[i];
      Entrant::OfSet& of_set = entrant.of_set[i];
      if (first) {
        of_set.stride = stride_for(*entrant.runner, set, options_.longest_ms);
        if (of_set.stride > 1) of_set.rays = every(set.rays, of_set.stride);
      }
      const std::span<const Ray> rays =
          of_set.stride > 1 ? std::span<const Ray>(of_set.rays) : std::span<const Ray>(set.rays);
      hits_.resize(rays.size());
      of_set.trace_ms.push_back(entrant.runner->closest_hit(rays, hits_));
      if (first) {
        of_set.score =
            score({*set.truth, scene_.mesh.view(), entrant.judged_as ? &oracle_ : nullptr,
                   entrant.judged_as, executor_.threads},
                  hits_, of_set.stride);
      }
    }
    entrant.runner->clear();
  }

  void add_point(const Entrant& entrant, const std::string& group, std::vector<Point>& points) {
    Point point;
    point.scene = scene_.name;
    point.setting = entrant.name;
    point.family = entrant.family;
    point.rays = group;
    point.peer = entrant.peer;
    point.cuda = entrant.cuda;
    point.by_intersector = entrant.by_intersector;
    point.stand_in = scene_.stand_in;
    point.triangles = scene_.mesh.faces.size();
    point.references_per_triangle = entrant.references_per_triangle;
    point.build_ms = spread_of(entrant.build_ms);
    Samples sums(options_.repeat, 0.0);
    for (std::size_t i = 0; i < sets_.size(); ++i) {
      if (sets_[i].group != group) continue;
      const Entrant::OfSet& of_set = entrant.of_set[i];
      for (unsigned repetition = 0; repetition < options_.repeat; ++repetition) {
        sums[repetition] += of_set.trace_ms[repetition];
      }
      point.score.add(of_set.score);
    }
    const std::uint64_t rays = point.score.total().rays;
    if (rays == 0) return;
    point.trace_ms = spread_of(sums);
    point.ns_per_ray = 1e6 * point.trace_ms.median / static_cast<double>(rays);
    points.push_back(std::move(point));
  }

  const TestScene& scene_;
  const std::vector<RaySet>& sets_;
  const verify::Oracle& oracle_;
  const cpu::Executor& executor_;
  const CurveOptions& options_;
  std::vector<Hit> hits_;
};

// A time per ray, so that points measured on fewer rays compare: the build shared among the rays
// that the scene's other points have.
double cost_of(const Point& point, std::uint64_t rays) {
  return 1e6 * point.build_ms.median / static_cast<double>(rays) + point.ns_per_ray;
}

void mark_pareto(std::vector<Point>& points) {
  for (Point& point : points) {
    // Of the same rays some settings answer only a part.
    std::uint64_t rays = 1;
    for (const Point& other : points)
      if (other.rays == point.rays) rays = std::max(rays, other.score.total().rays);
    point.pareto = std::none_of(points.begin(), points.end(), [&](const Point& other) {
      if (other.rays != point.rays || other.cuda != point.cuda) return false;
      const double cost = cost_of(point, rays);
      const double other_cost = cost_of(other, rays);
      return other_cost <= cost && other.error() <= point.error() &&
             (other_cost < cost || other.error() < point.error());
    });
  }
}

}  // namespace

double Point::error() const {
  const Counts counts = score.total();
  return counts.rays == 0 ? 0.0
                          : static_cast<double>(counts.errors()) / static_cast<double>(counts.rays);
}

std::vector<Point> measure_curves(const TestScene& scene, const std::vector<RaySet>& sets,
                                  const verify::Oracle& oracle, const cpu::Executor& executor,
                                  const CurveOptions& options) {
  std::vector<Point> points = Measurement(scene, sets, oracle, executor, options).run();
  mark_pareto(points);
  return points;
}

}  // namespace zkd::bench::accuracy
