// SPDX-License-Identifier: Apache-2.0
//
// Rays in blocks, each block answered by one thread.
#include "truth.hpp"

#include <time.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "verify/band.hpp"
#include "verify/exact.hpp"

namespace zkd::bench::accuracy {
namespace {

constexpr std::size_t block_size = 512;

// Processor time of this thread: the same on a busy machine.
double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

RayClass class_of(verify::HitClass value) {
  switch (value) {
    case verify::HitClass::interior:
      return RayClass::interior;
    case verify::HitClass::edge:
      return RayClass::edge;
    case verify::HitClass::vertex:
      return RayClass::vertex;
    case verify::HitClass::duplicate:
      break;
  }
  return RayClass::duplicate;
}

verify::Point point(const glm::vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

Truth::Answer answer_of(const verify::Oracle& oracle, const verify::ExactHit& hit,
                        const TriangleView& triangles, const Ray& ray) {
  if (!hit.hit)
    return {std::numeric_limits<double>::infinity(), 0.0, 0.0, 0.0, 0.0, RayClass::miss};
  const verify::Corners corners = *verify::finite_corners(triangles, hit.ties.front());
  const verify::Point o = point(ray.origin);
  const verify::Point d = point(ray.direction);
  const verify::PlaneHit plane = verify::plane_hit(o, d, corners);
  const verify::Barycentrics place = verify::barycentrics(o, d, corners);
  const double length = std::hypot(d[0], d[1], d[2]);
  return {hit.t,
          length * (plane.normal / std::abs(plane.denominator)),
          verify::stated_reach(oracle, ray, corners) / length,
          place.u,
          place.v,
          class_of(hit.hit_class)};
}

}  // namespace

const char* to_string(RayClass value) noexcept {
  switch (value) {
    case RayClass::interior:
      return "interior";
    case RayClass::edge:
      return "edge";
    case RayClass::vertex:
      return "vertex";
    case RayClass::duplicate:
      return "duplicate";
    case RayClass::miss:
      return "miss";
  }
  return "miss";
}

Truth::Truth(const verify::Oracle& oracle, const TriangleView& triangles, std::span<const Ray> rays,
             int threads)
    : rays_(rays), answers_(rays.size()), first_tie_(rays.size() + 1) {
  const std::size_t blocks = (rays.size() + block_size - 1) / block_size;
  std::vector<std::vector<std::uint32_t>> ties(blocks);
  std::atomic<std::size_t> next{0};
#pragma omp parallel num_threads(threads)
  {
    double seconds = 0.0;
    for (std::size_t block = next++; block < blocks; block = next++) {
      const double begin = thread_seconds();
      const std::size_t end = std::min((block + 1) * block_size, rays.size());
      std::vector<verify::ExactHit> hits;
      for (std::size_t i = block * block_size; i < end; ++i) {
        hits.push_back(oracle.closest_hit(rays[i]));
      }
      seconds += thread_seconds() - begin;
      for (std::size_t i = block * block_size; i < end; ++i) {
        const verify::ExactHit& hit = hits[i - block * block_size];
        answers_[i] = answer_of(oracle, hit, triangles, rays[i]);
        first_tie_[i + 1] = hit.ties.size();
        ties[block].insert(ties[block].end(), hit.ties.begin(), hit.ties.end());
      }
    }
#pragma omp critical(zkd_accuracy_truth)
    oracle_seconds_ += seconds;
  }
  std::partial_sum(first_tie_.begin(), first_tie_.end(), first_tie_.begin());
  ties_.reserve(first_tie_.back());
  for (const std::vector<std::uint32_t>& of_block : ties) {
    ties_.insert(ties_.end(), of_block.begin(), of_block.end());
  }
}

}  // namespace zkd::bench::accuracy
