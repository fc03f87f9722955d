// SPDX-License-Identifier: Apache-2.0
//
// core::BoxTest in vectors of four: low and high sides of both children at once, for AVX2 and FMA.
#pragma once

#include <cstdint>

#include <zkd/traversal/traverse.hpp>

#include "cpu/instruction_set.hpp"

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>

namespace zkd::cpu {

/// Rounds once less than core::BoxTest: boxes only say what may be left out, within padding.
class Avx2BoxTest {
 public:
  ZKD_CPU_AVX2 explicit Avx2BoxTest(const core::PreparedRay& ray)
      : first_(_mm_set1_ps(ray.first.value)) {
    for (std::uint32_t a = 0; a < 3; ++a) {
      origin_[a] = _mm_set1_ps(ray.origin[a].value);
      const float leaving = (ray.inverse[a] * ray.far_slack).value;
      const float inverse = ray.inverse[a].value;
      inverse_[a] = _mm_setr_ps(inverse, inverse, leaving, leaving);
      const float p = ray.padding[a].value;
      padding_[a] = _mm_setr_ps(-p, -p, p, p);
      // Lanes of Node::bounds in the order near, near, far, far.
      near_far_[a] = ray.is_negative(a) ? _mm_setr_epi32(2, 3, 0, 1) : _mm_setr_epi32(0, 1, 2, 3);
    }
  }

  [[nodiscard]] static const Node& read(const Node& node) { return node; }

  ZKD_CPU_AVX2 core::Entries operator()(const Node& node, core::Real last) const {
    __m128 t[3];
    for (int a = 0; a < 3; ++a) {
      const __m128 from_origin = _mm_sub_ps(_mm_load_ps(node.bounds[a]), origin_[a]);
      t[a] = _mm_fmadd_ps(_mm_permutevar_ps(from_origin, near_far_[a]), inverse_[a], padding_[a]);
    }
    const __m128 near = _mm_max_ps(_mm_max_ps(t[0], t[1]), _mm_max_ps(t[2], first_));
    const __m128 far =
        _mm_min_ps(_mm_min_ps(t[0], t[1]), _mm_min_ps(t[2], _mm_set1_ps(last.value)));
    const int hit = _mm_movemask_ps(_mm_cmple_ps(near, _mm_movehl_ps(far, far)));
    core::Entries entries;
    _mm_storel_pi(reinterpret_cast<__m64*>(entries.t), near);
    entries.hit = static_cast<std::uint32_t>(hit) & 3u;
    return entries;
  }

 private:
  __m128 first_;
  __m128 origin_[3];
  __m128 inverse_[3];
  __m128 padding_[3];
  __m128i near_far_[3];
};

}  // namespace zkd::cpu
#else
namespace zkd::cpu {
using Avx2BoxTest = core::BoxTest;
}
#endif
