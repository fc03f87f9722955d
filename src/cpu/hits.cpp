// SPDX-License-Identifier: Apache-2.0
//
// All hits of a ray in order, on the CPU.
#include <zkd/hits.hpp>

#include <algorithm>
#include <atomic>
#include <exception>

#include <zkd/traversal/all_hits.hpp>

#include "cpu/box_test.hpp"
#include "cpu/float_environment.hpp"
#include "cpu/instruction_set.hpp"
#include "cpu/rays.hpp"
#include "cpu/threads.hpp"

namespace zkd {
namespace {

using cpu::for_each_ray;
using cpu::rays_at_once;
using cpu::with_intersector;

/// Hits kept and boxes in order, of one ray. See bench/NOTES.md.
constexpr std::uint32_t hits_kept = 256;
constexpr std::uint32_t boxes_in_order = 32;

/// trace.operator()<Boxes>(i) for each ray, `Boxes` as the instruction set has it.
template <class Trace>
void trace_all(const cpu::Threads& threads, std::size_t count, Trace trace) {
  if (threads.avx2())
    for_each_ray(threads, count, rays_at_once,
                 [=](std::size_t i) { trace.template operator()<cpu::Avx2BoxTest>(i); });
  else
    for_each_ray(threads, count, rays_at_once,
                 [=](std::size_t i) { trace.template operator()<core::BoxTest>(i); });
}

/// The first exception of several threads. The others need not go on then.
class FirstException {
 public:
  [[nodiscard]] bool caught() const { return caught_.load(std::memory_order_relaxed); }
  void keep_current() {
    if (!caught_.exchange(true)) exception_ = std::current_exception();
  }
  /// When all threads are done.
  void rethrow() const {
    if (exception_) std::rethrow_exception(exception_);
  }

 private:
  std::atomic<bool> caught_ = false;
  std::exception_ptr exception_;
};

/// How many rays are traced. Every span but the first may be empty.
std::size_t ray_count(std::size_t rays, std::uint32_t hits_per_ray, std::size_t hits,
                      std::size_t counts, std::size_t costs) {
  if (hits_per_ray != 0) rays = std::min(rays, hits / hits_per_ray);
  if (counts != 0) rays = std::min(rays, counts);
  if (costs != 0) rays = std::min(rays, costs);
  return rays;
}

}  // namespace

namespace detail {

void for_each_hit(const TreeView& tree, const TriangleView& triangles, const Ray& ray,
                  CallHitVisitor call, void* visitor, Intersector intersector) {
  const cpu::FloatEnvironment environment;
  with_intersector(intersector, [&]<class Intersect>() {
    const auto trace = [&]<class Boxes>(const Ray& one) {
      const auto visit = [=](const auto& found) { return call(visitor, 0, core::to_hit(found)); };
      core::for_each_hit<hits_kept, boxes_in_order, Boxes, Intersect>(tree, triangles, one, visit);
    };
    if (cpu::use_avx2(cpu::InstructionSet::automatic)) {
      const auto body = [&](const Ray& one) { trace.template operator()<cpu::Avx2BoxTest>(one); };
      cpu::call_avx2(body, ray);
    } else {
      trace.template operator()<core::BoxTest>(ray);
    }
  });
}

void for_each_hit(const cpu::Executor& executor, const TreeView& tree,
                  const TriangleView& triangles, std::span<const Ray> rays, CallHitVisitor call,
                  void* visitor, Intersector intersector) {
  FirstException exception;
  with_intersector(intersector, [&, first = &exception]<class Intersect>() {
    trace_all(cpu::Threads(executor), rays.size(), [=]<class Boxes>(std::size_t i) {
      if (first->caught()) return;
      const auto visit = [=](const auto& found) { return call(visitor, i, core::to_hit(found)); };
      try {
        core::for_each_hit<hits_kept, boxes_in_order, Boxes, Intersect>(tree, triangles, rays[i],
                                                                        visit);
      } catch (...) {
        first->keep_current();
      }
    });
  });
  exception.rethrow();
}

}  // namespace detail

void closest_hits(const cpu::Executor& executor, const TreeView& tree,
                  const TriangleView& triangles, std::span<const Ray> rays,
                  std::uint32_t hits_per_ray, std::span<Hit> hits, std::span<std::uint32_t> counts,
                  std::span<TraversalCost> costs, Intersector intersector) noexcept {
  const std::size_t count =
      ray_count(rays.size(), hits_per_ray, hits.size(), counts.size(), costs.size());
  with_intersector(intersector, [&]<class Intersect>() {
    trace_all(cpu::Threads(executor), count, [=]<class Boxes>(std::size_t i) {
      const std::uint32_t found = core::closest_hits<hits_kept, boxes_in_order, Boxes, Intersect>(
          tree, triangles, rays[i], hits.data() + i * hits_per_ray, hits_per_ray,
          costs.empty() ? nullptr : &costs[i]);
      if (!counts.empty()) counts[i] = found;
    });
  });
}

void closest_hits_brute_force(const cpu::Executor& executor, const TreeView& tree,
                              const TriangleView& triangles, std::span<const Ray> rays,
                              std::uint32_t hits_per_ray, std::span<Hit> hits,
                              std::span<std::uint32_t> counts, Intersector intersector) noexcept {
  const std::size_t count = ray_count(rays.size(), hits_per_ray, hits.size(), counts.size(), 0);
  with_intersector(intersector, [&]<class Intersect>() {
    for_each_ray(cpu::Threads(executor), count, 1, [=](std::size_t i) {
      core::HitPlaces places(hits.data() + i * hits_per_ray, hits_per_ray);
      if (hits_per_ray != 0)
        core::for_each_hit_brute_force<Intersect>(tree, triangles, rays[i], places);
      const std::uint32_t found = places.finish();
      if (!counts.empty()) counts[i] = found;
    });
  });
}

}  // namespace zkd
