// SPDX-License-Identifier: Apache-2.0
//
// One answer after another, each into its class and its bin.
#include "score.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "cpu/float_environment.hpp"
#include "verify/band.hpp"
#include "verify/exact.hpp"

namespace zkd::bench::accuracy {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

std::size_t bin_of(double condition) {
  const auto* const end = std::find_if(condition_ends.begin(), condition_ends.end(),
                                       [&](double upper) { return condition < upper; });
  return static_cast<std::size_t>(end - condition_ends.begin());
}

double error_of(double difference, double unit) { return std::abs(difference) / unit; }

verify::Point point(const glm::vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

double phantom_distance(const TriangleView& triangles, const Ray& ray, std::uint32_t triangle) {
  if (verify::degenerate(ray) || triangle >= triangles.triangle_count) {
    return infinity;
  }
  const auto corners = verify::finite_corners(triangles, triangle);
  if (!corners) return infinity;
  const auto [u, v] = verify::barycentrics(point(ray.origin), point(ray.direction), *corners);
  return error_of(std::max(0.0, -std::min({u, v, 1.0 - u - v})), 0x1p-24);
}

class Examiner {
 public:
  Examiner(const Exam& exam, std::span<const Hit> hits, std::size_t stride)
      : exam_(exam), hits_(hits), stride_(stride) {
    score_.judged = exam.oracle != nullptr;
  }

  void examine(std::size_t i) {
    const std::size_t ray = i * stride_;
    const Hit& hit = hits_[i];
    const Truth::Answer& exact = exam_.truth.answer(ray);
    const auto ties = exam_.truth.ties(ray);
    Counts& counts = score_.of_class[static_cast<std::size_t>(exact.ray_class)];
    ++counts.rays;
    const bool answered = hit.triangle != no_triangle;
    if (ties.empty() && !answered) return;
    if (answered && std::binary_search(ties.begin(), ties.end(), hit.triangle)) {
      count_correct(hit, exact, ties.front(), ray);
      return;
    }

    bool in_band = false;
    if (exam_.oracle != nullptr) {
      in_band = verify::judge(*exam_.oracle, exam_.triangles, exam_.truth.rays()[ray], hit,
                              exam_.intersector.value_or(Intersector::single_precision))
                    .in_band;
    }
    if (!in_band && !score_.first_offender) score_.first_offender = exam_.truth.rays()[ray];
    const std::uint64_t excused = in_band ? 1 : 0;
    if (!answered) {
      ++counts.missed;
      counts.in_band_missed += excused;
    } else if (ties.empty()) {
      ++counts.phantom;
      counts.in_band_phantom += excused;
      score_.phantom_units.add(
          phantom_distance(exam_.triangles, exam_.truth.rays()[ray], hit.triangle));
    } else {
      const double off = std::abs(static_cast<double>(hit.t) - exact.t) / float_ulp(exact.t);
      ++(off <= benign_ulps ? counts.wrong_benign : counts.wrong_real);
      counts.in_band_wrong += excused;
    }
  }

  [[nodiscard]] const Score& score() const { return score_; }

 private:
  void count_correct(const Hit& hit, const Truth::Answer& exact, std::uint32_t first_tie,
                     std::size_t ray) {
    const std::size_t bin = bin_of(exact.condition);
    if (exam_.intersector) count_above_bound(hit, exact, first_tie, ray);
    score_.t_ulps[bin].add(error_of(static_cast<double>(hit.t) - exact.t, float_ulp(exact.t)));
    if (hit.triangle != first_tie) return;
    score_.uv_units[bin].add(error_of(static_cast<double>(hit.u) - exact.u, 0x1p-24));
    score_.uv_units[bin].add(error_of(static_cast<double>(hit.v) - exact.v, 0x1p-24));
  }

  void count_above_bound(const Hit& hit, const Truth::Answer& exact, std::uint32_t first_tie,
                         std::size_t ray) {
    const double bound = verify::stated_t_bound(*exam_.intersector, exact.condition, exact.reach);
    const auto t = static_cast<double>(hit.t);
    // Half a unit of the rounding to float, and that of the exact t to double.
    const double rounding =
        0.5 * float_ulp(std::max(std::abs(t), std::abs(exact.t))) + 0x1p-52 * std::abs(exact.t);
    bool above = !(std::abs(t - exact.t) <= bound + rounding);
    // The bound is of the first triangle of the tie set: another may be seen more edge-on.
    if (above && hit.triangle != first_tie) {
      above = exam_.oracle != nullptr &&
              !verify::judge(*exam_.oracle, exam_.triangles, exam_.truth.rays()[ray], hit,
                             *exam_.intersector)
                   .t_in_bound;
    }
    if (!above && exam_.oracle != nullptr) {
      above = !verify::point_in_bound(*exam_.oracle, exam_.triangles, exam_.truth.rays()[ray], hit,
                                      *exam_.intersector);
    }
    score_.above_bound = score_.above_bound.value_or(0) + (above ? 1 : 0);
    if (above && !score_.first_above_bound) score_.first_above_bound = exam_.truth.rays()[ray];
  }

  const Exam& exam_;
  std::span<const Hit> hits_;
  std::size_t stride_;
  Score score_;
};

}  // namespace

std::string describe(const Ray& ray) {
  char text[256];
  const auto d = [](float x) { return static_cast<double>(x); };
  std::snprintf(text, sizeof text, "origin %a %a %a, direction %a %a %a, t %a to %a",
                d(ray.origin.x), d(ray.origin.y), d(ray.origin.z), d(ray.direction.x),
                d(ray.direction.y), d(ray.direction.z), d(ray.t_min), d(ray.t_max));
  return text;
}

double float_ulp(double x) {
  int exponent = 0;
  std::frexp(x, &exponent);
  return std::ldexp(1.0, x == 0.0 ? -149 : std::max(exponent - 24, -149));
}

Counts& Counts::operator+=(const Counts& other) {
  rays += other.rays;
  missed += other.missed;
  phantom += other.phantom;
  wrong_benign += other.wrong_benign;
  wrong_real += other.wrong_real;
  in_band_missed += other.in_band_missed;
  in_band_phantom += other.in_band_phantom;
  in_band_wrong += other.in_band_wrong;
  return *this;
}

Counts Score::total() const {
  Counts sum;
  for (const Counts& counts : of_class) sum += counts;
  return sum;
}

Histogram Score::all_t_ulps() const {
  Histogram all;
  for (const Histogram& bin : t_ulps) all += bin;
  return all;
}

void Score::add(const Score& other) {
  for (std::size_t i = 0; i < ray_classes; ++i) of_class[i] += other.of_class[i];
  for (std::size_t i = 0; i < condition_bins; ++i) {
    t_ulps[i] += other.t_ulps[i];
    uv_units[i] += other.uv_units[i];
  }
  phantom_units += other.phantom_units;
  if (other.above_bound) above_bound = above_bound.value_or(0) + *other.above_bound;
  if (!first_offender) first_offender = other.first_offender;
  if (!first_above_bound) first_above_bound = other.first_above_bound;
  judged = judged || other.judged;
}

Score score(const Exam& exam, std::span<const Hit> hits, std::size_t stride) {
  // Parts are added in order, so that the score does not depend on the number of threads.
  const auto parts = static_cast<std::int64_t>(exam.threads);
  const auto count = static_cast<std::int64_t>(hits.size());
  std::vector<Score> scores(static_cast<std::size_t>(parts));
#pragma omp parallel for num_threads(exam.threads)
  for (std::int64_t part = 0; part < parts; ++part) {
    // A t may be denormal, whatever mode this thread was left in.
    const cpu::FloatEnvironment environment;
    Examiner examiner(exam, hits, stride);
    for (std::int64_t i = count * part / parts; i < count * (part + 1) / parts; ++i) {
      examiner.examine(static_cast<std::size_t>(i));
    }
    scores[static_cast<std::size_t>(part)] = examiner.score();
  }
  Score all;
  for (const Score& part : scores) all.add(part);
  return all;
}

}  // namespace zkd::bench::accuracy
