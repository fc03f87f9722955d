// SPDX-License-Identifier: Apache-2.0
//
// Rows 16 and 17: scenes far from the origin, and of every scale.
#include <cfenv>
#include <cmath>
#include <string>
#include <utility>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include <zkd/build.hpp>
#include <zkd/query.hpp>

#include "scene/generate.hpp"
#include "scene/hard_meshes.hpp"
#include "stress/case.hpp"
#include "verify/hits.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::stress {
namespace {

using scene::Mesh;
using verify::print;
using verify::same_bits;

std::vector<BuildOptions> some_options(const Setting& setting) {
  return setting.size == Size::small ? many_options() : once_and_all();
}

void far_from_the_origin(const Setting& setting, const Yield& yield) {
  for (const float by : {148376.0F, 1e6F, 1.6e7F}) {
    const glm::vec3 places[] = {glm::vec3(by), {by, -by, 0.0F}, {0.0F, by, 0.5F}};
    for (const glm::vec3& place : places) {
      const std::string name = " at " + std::to_string(by);
      yield(hard_case(
          "soup" + name,
          scene::offset(scene::scaled(scene::soup(setting.pick(200u, 40000u), setting.seed), 5),
                        place),
          some_options(setting), setting.pick(900u, 4000u)));
      yield(hard_case("sphere" + name,
                      scene::offset(scene::scaled(scene::sphere(setting.pick(2u, 5u)), 3), place),
                      some_options(setting), setting.pick(900u, 4000u)));
    }
  }
}

// ---- Scales -------------------------------------------------------------------------------------

// Whether v * 2^exponent is exact; makes v that.
bool scale_exactly(glm::vec3& v, int exponent) {
  for (int a = 0; a < 3; ++a) {
    const float scaled = std::ldexp(v[a], exponent);
    if (std::ldexp(scaled, -exponent) != v[a]) return false;
    v[a] = scaled;
  }
  return true;
}

// Scene and rays times a power of two: the same t, u, v and ids.
void same_as_unscaled(const Mesh& unscaled, int exponent, const Traced& traced,
                      Findings& findings) {
  const Tree tree = build(unscaled.view(), traced.of.options[0]);
  std::uint64_t compared = 0;
  for (std::size_t i = 0; i < traced.rays.size(); ++i) {
    Ray ray = traced.rays[i];
    if (!scale_exactly(ray.origin, -exponent) || !scale_exactly(ray.direction, -exponent)) continue;
    ++compared;
    const Hit want = closest_hit(tree.view(), unscaled.view(), ray).value_or(Hit{});
    findings.expect(same_bits(traced.hits[i], want), print(traced.hits[i]) + " instead of " +
                                                         print(want) + " before scaling, ray " +
                                                         print(traced.rays[i]));
  }
  findings.expect(compared > traced.rays.size() / 4, "few rays could be scaled exactly");
}

// While it lives the thread flushes denormals to zero, as a caller compiled with -ffast-math does.
class FlushToZero {
 public:
#if defined(__SSE2__)
  FlushToZero() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040u); }
  ~FlushToZero() { _mm_setcsr(before_); }
  static constexpr bool possible = true;
#else
  static constexpr bool possible = false;
#endif
  FlushToZero(const FlushToZero&) = delete;
  FlushToZero& operator=(const FlushToZero&) = delete;

 private:
#if defined(__SSE2__)
  unsigned before_;
#endif
};

void same_when_flushing(const Traced& traced, Findings& findings) {
  if (!FlushToZero::possible) {
    findings.note("flush-to-zero is not tried: not an x86 processor");
    return;
  }
  const TriangleView triangles = traced.of.mesh.view();
  const cpu::Executor executor{.threads = traced.threads};
  for (std::size_t i = 0; i < traced.trees.size(); ++i) {
    Tree tree;
    std::vector<Hit> hits(traced.rays.size());
    {
      const FlushToZero flushing;
      tree = build(executor, triangles, traced.of.options[i]);
      closest_hit(executor, tree.view(), triangles, traced.rays, hits);
    }
    findings.expect(verify::tree_hash(tree.view()) == verify::tree_hash(traced.trees[i]->view()),
                    "another tree when the caller flushes denormals");
    for (std::size_t k = 0; k < hits.size(); ++k) {
      findings.expect(
          same_bits(hits[k], traced.hits[k]),
          "another answer when the caller flushes denormals, ray " + print(traced.rays[k]));
    }
  }
}

void scales(const Setting& setting, const Yield& yield) {
  const std::uint32_t count = setting.pick(200u, 10000u);
  // 2^-60 is about 1e-18, 2^50 about 1e15; further out coordinates overflow or go denormal.
  for (const int exponent : {-120, -60, -40, -20, -1, 1, 20, 40, 50, 100}) {
    for (const bool closed : {false, true}) {
      Mesh mesh = closed ? scene::sphere(setting.pick(2u, 5u)) : scene::soup(count, setting.seed);
      // Coordinates of full precision below 2^-126 would lose bits.
      Case made = hard_case(
          (closed ? "sphere times 2^" : "soup times 2^") + std::to_string(exponent),
          scene::scaled(mesh, exponent), some_options(setting), setting.pick(900u, 2000u));
      made.also = [mesh = std::move(mesh), exponent](const Traced& traced, Findings& findings) {
        const bool exact = [&] {
          for (glm::vec3 p : mesh.positions) {
            if (!scale_exactly(p, exponent)) return false;
          }
          return true;
        }();
        if (exact) same_as_unscaled(mesh, exponent, traced, findings);
        same_when_flushing(traced, findings);
      };
      yield(std::move(made));
    }
  }
  for (const int exponent : {-126, -135, -140, -147}) {  // what the input itself loses is lost
    Case made = hard_case("sphere times 2^" + std::to_string(exponent),
                          scene::scaled(scene::sphere(setting.pick(2u, 4u)), exponent),
                          some_options(setting), setting.pick(900u, 2000u));
    made.also = same_when_flushing;
    yield(std::move(made));
  }
  for (const int half_width : {1, 3, 100}) {
    Case made = hard_case("multiples of 1.4e-45 up to " + std::to_string(half_width),
                          scene::denormals(count, half_width, setting.seed), some_options(setting),
                          setting.pick(900u, 2000u));
    made.oracle_rays = setting.pick(0u, 200u);
    made.also = same_when_flushing;
    yield(std::move(made));
  }
}

}  // namespace

std::vector<Row> place_rows() {
  return {{16, "far from the origin", far_from_the_origin}, {17, "every scale", scales}};
}

}  // namespace zkd::stress
