// SPDX-License-Identifier: Apache-2.0
//
// Many answers held against the oracle, counted.
#include "verify/check.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <string>

#include <omp.h>

namespace zkd::verify {
namespace {

constexpr std::size_t block_size = 512;
constexpr std::size_t offender_limit = 10;

struct Part {
  Summary summary;
  std::vector<float> t_ulps;
};

void count(Part& part, const Verdict& verdict, std::uint64_t ray, bool hit) {
  Summary& summary = part.summary;
  const std::uint64_t excused = verdict.in_band ? 1 : 0;
  switch (verdict.kind) {
    case Verdict::correct:
      ++summary.correct;
      if (hit) part.t_ulps.push_back(static_cast<float>(verdict.t_ulp));
      if (verdict.in_bound()) return;
      ++summary.beyond_bound;
      break;
    case Verdict::missed:
      ++summary.missed;
      summary.in_band.missed += excused;
      break;
    case Verdict::phantom:
      ++summary.phantom;
      summary.in_band.phantom += excused;
      break;
    case Verdict::wrong_triangle:
      ++summary.wrong_triangle;
      summary.in_band.wrong_triangle += excused;
      break;
  }
  // Rays reach a part in ascending order: the first ones are all that can be among the first of
  // all.
  if (!verdict.in_band && summary.first_offenders.size() < offender_limit) {
    summary.first_offenders.push_back(ray);
  }
}

void add(Part& all, Part& part) {
  Summary& to = all.summary;
  const Summary& from = part.summary;
  to.add_counts(from);
  to.first_offenders.insert(to.first_offenders.end(), from.first_offenders.begin(),
                            from.first_offenders.end());
  all.t_ulps.insert(all.t_ulps.end(), part.t_ulps.begin(), part.t_ulps.end());
}

}  // namespace

void Summary::add_counts(const Summary& other) {
  rays += other.rays;
  correct += other.correct;
  missed += other.missed;
  phantom += other.phantom;
  wrong_triangle += other.wrong_triangle;
  beyond_bound += other.beyond_bound;
  in_band.missed += other.in_band.missed;
  in_band.phantom += other.in_band.phantom;
  in_band.wrong_triangle += other.in_band.wrong_triangle;
}

Summary check(const Oracle& oracle, const TriangleView& triangles, std::span<const Ray> rays,
              std::span<const Hit> hits, int threads,
              const std::function<void(std::uint64_t)>& progress, Intersector intersector) {
  if (rays.size() != hits.size()) {
    throw std::invalid_argument("check: " + std::to_string(rays.size()) + " rays, but " +
                                std::to_string(hits.size()) + " hits");
  }
  const std::size_t blocks = (rays.size() + block_size - 1) / block_size;
  std::atomic<std::size_t> next{0};
  std::atomic<std::uint64_t> done{0};
  Part all;
  std::exception_ptr failure;  // no exception may leave a parallel region: the last one, thrown on
#pragma omp parallel num_threads(threads > 0 ? threads : omp_get_max_threads())
  try {
    Part part;
    for (std::size_t block = next++; block < blocks; block = next++) {
      const std::size_t begin = block * block_size;
      const std::size_t end = std::min(begin + block_size, rays.size());
      for (std::size_t i = begin; i < end; ++i) {
        count(part, judge(oracle, triangles, rays[i], hits[i], intersector), i,
              hits[i].triangle != no_triangle);
      }
      done += end - begin;
      if (progress && omp_get_thread_num() == 0) progress(done);
    }
#pragma omp critical(zkd_verify_check)
    add(all, part);
  } catch (...) {
#pragma omp critical(zkd_verify_check)
    failure = std::current_exception();
    next = blocks;
  }
  if (failure) std::rethrow_exception(failure);

  Summary& summary = all.summary;
  summary.rays = rays.size();
  std::sort(summary.first_offenders.begin(), summary.first_offenders.end());
  summary.first_offenders.resize(std::min(summary.first_offenders.size(), offender_limit));
  if (!all.t_ulps.empty()) {
    const auto rank =
        static_cast<std::size_t>(std::ceil(0.999 * static_cast<double>(all.t_ulps.size())));
    const auto at = all.t_ulps.begin() + static_cast<std::ptrdiff_t>(rank - 1);
    std::nth_element(all.t_ulps.begin(), at, all.t_ulps.end());
    summary.t_ulp_p999 = static_cast<double>(*at);
    summary.t_ulp_max = static_cast<double>(*std::max_element(at, all.t_ulps.end()));
  }
  if (progress) progress(summary.rays);
  return summary;
}

}  // namespace zkd::verify
