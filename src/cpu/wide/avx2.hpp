// SPDX-License-Identifier: Apache-2.0
//
// Eight boxes and eight triangles at once, for AVX2 and FMA.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <zkd/traversal/intersect.hpp>
#include <zkd/traversal/ray.hpp>
#include <zkd/traversal/single.hpp>

#include "core/exact/intersect.hpp"
#include "cpu/instruction_set.hpp"
#include "cpu/wide/portable.hpp"
#include "cpu/wide/walk.hpp"

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>

namespace zkd::cpu {

/// core::BoxTest of eight children, with the roundings of Avx2BoxTest.
class Avx2WideBoxes {
 public:
  ZKD_CPU_AVX2 explicit Avx2WideBoxes(const core::PreparedRay& ray)
      : first_(_mm256_set1_ps(ray.first.value)) {
    for (std::uint32_t a = 0; a < 3; ++a) {
      origin_[a] = _mm256_set1_ps(ray.origin[a].value);
      inverse_[a] = _mm256_set1_ps(ray.inverse[a].value);
      leaving_[a] = _mm256_set1_ps((ray.inverse[a] * ray.far_slack).value);
      padding_[a] = _mm256_set1_ps(ray.padding[a].value);
      near_[a] = ray.is_negative(a) ? other_side : 0;
    }
  }

  ZKD_CPU_AVX2 void operator()(const WideNode& node, core::Real last, WideEntries& entries) const {
    __m256 near = first_;
    __m256 far = _mm256_set1_ps(last.value);
    for (int a = 0; a < 3; ++a) {
      const char* const bounds = reinterpret_cast<const char*>(node.bounds[a]);
      const __m256 to_near = _mm256_sub_ps(load(bounds + near_[a]), origin_[a]);
      const __m256 to_far = _mm256_sub_ps(load(bounds + (near_[a] ^ other_side)), origin_[a]);
      near = _mm256_max_ps(near, _mm256_fmsub_ps(to_near, inverse_[a], padding_[a]));
      far = _mm256_min_ps(far, _mm256_fmadd_ps(to_far, leaving_[a], padding_[a]));
    }
    const __m256i bits = _mm256_castps_si256(near);
    const __m256i flipped =
        _mm256_and_si256(_mm256_srai_epi32(bits, 31), _mm256_set1_epi32(0x7FFFFFFF));
    _mm256_store_si256(reinterpret_cast<__m256i*>(entries.t), _mm256_xor_si256(bits, flipped));
    entries.hit =
        static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(near, far, _CMP_LE_OQ)));
  }

 private:
  static constexpr std::size_t other_side = sizeof(WideNode::bounds[0][0]);

  ZKD_CPU_AVX2 static __m256 load(const char* bounds) {
    return _mm256_load_ps(reinterpret_cast<const float*>(bounds));
  }

  __m256 first_;
  __m256 origin_[3];
  __m256 inverse_[3];
  __m256 leaving_[3];
  __m256 padding_[3];
  std::size_t near_[3];
};

/// The triangles of a block that the ray may hit, by single precision: core::surely_misses of all
/// of them, with what the intersector's answers need besides ("Wide trees" in docs/accuracy.md).
template <class Intersect>
class Avx2Lanes {
 public:
  ZKD_CPU_AVX2 explicit Avx2Lanes(const core::PreparedRay& ray)
      : ray_(ray), scale_(_mm256_set1_ps(ray.scale.value)) {
    for (int i = 0; i < 3; ++i) origin_[i] = _mm256_set1_ps(ray.permuted_origin[i].value);
    for (int i = 0; i < 2; ++i) shear_[i] = _mm256_set1_ps(ray.shear[i].value);
  }

  /// The lanes that are left. One without a triangle never is.
  ZKD_CPU_AVX2 std::uint32_t operator()(const TriangleBlock& block) const {
    if (!ray_.moved) return left<false>(block);
    if constexpr (std::is_same_v<Intersect, core::ExactIntersect>) return lanes_in_use(block);
    return left<true>(block);
  }

 private:
  template <bool moved>
  ZKD_CPU_AVX2 std::uint32_t left(const TriangleBlock& block) const {
    __m256 x[3];
    __m256 y[3];
    __m256 size_x = _mm256_setzero_ps();
    __m256 size_y = _mm256_setzero_ps();
    __m256 across_x = _mm256_setzero_ps();
    __m256 across_y = _mm256_setzero_ps();
    Extent extent;
    for (int corner = 0; corner < 3; ++corner) {
      const __m256 right = from_origin<moved>(block, corner, 0);
      const __m256 up = from_origin<moved>(block, corner, 1);
      const __m256 along = from_origin<moved>(block, corner, 2);
      x[corner] = _mm256_fnmadd_ps(shear_[0], along, right);
      y[corner] = _mm256_fnmadd_ps(shear_[1], along, up);
      const __m256 depth = magnitude(along);
      size_x = _mm256_max_ps(size_x, _mm256_add_ps(magnitude(right), depth));
      size_y = _mm256_max_ps(size_y, _mm256_add_ps(magnitude(up), depth));
      across_x = _mm256_max_ps(across_x, magnitude(x[corner]));
      across_y = _mm256_max_ps(across_y, magnitude(y[corner]));
      if constexpr (is_fast) extent.include(corner, right, up, along);
    }
    const __m256 w0 = _mm256_fmsub_ps(x[2], y[1], _mm256_mul_ps(y[2], x[1]));
    const __m256 w1 = _mm256_fmsub_ps(x[0], y[2], _mm256_mul_ps(y[0], x[2]));
    const __m256 w2 = _mm256_fmsub_ps(x[1], y[0], _mm256_mul_ps(y[1], x[0]));

    const __m256 units = _mm256_set1_ps(6.0F * 0x1p-24F);
    const __m256 error_x = _mm256_mul_ps(units, size_x);
    const __m256 error_y = _mm256_mul_ps(units, size_y);
    const __m256 half = _mm256_fmadd_ps(error_y, across_x,
                                        _mm256_mul_ps(error_x, _mm256_add_ps(across_y, error_y)));
    __m256 bound = _mm256_max_ps(_mm256_add_ps(half, half), _mm256_set1_ps(0x1p-96F));
    if constexpr (is_fast) {
      const __m256 reach = _mm256_max_ps(size_x, size_y);
      const __m256 edge = _mm256_fmadd_ps(_mm256_set1_ps(0x1p-21F), reach, extent.longest());
      const __m256 unit = _mm256_mul_ps(_mm256_set1_ps(0x1p-15F), reach);
      bound = _mm256_fmadd_ps(unit, edge, bound);
    }
    const __m256 least = _mm256_min_ps(w0, _mm256_min_ps(w1, w2));
    const __m256 most = _mm256_max_ps(w0, _mm256_max_ps(w1, w2));
    // Ordered comparisons: where there is no triangle all is NaN.
    const __m256 may =
        _mm256_or_ps(_mm256_cmp_ps(least, _mm256_sub_ps(_mm256_setzero_ps(), bound), _CMP_GE_OQ),
                     _mm256_cmp_ps(most, bound, _CMP_LE_OQ));
    return static_cast<std::uint32_t>(_mm256_movemask_ps(may));
  }

  static constexpr bool is_fast = std::is_same_v<Intersect, core::Fast>;

  /// The boxes of triangles, as they are seen from the origin.
  struct Extent {
    __m256 lo[3];
    __m256 hi[3];

    ZKD_CPU_AVX2 void include(int corner, __m256 right, __m256 up, __m256 along) {
      const __m256 at[3] = {right, up, along};
      for (int a = 0; a < 3; ++a) {
        lo[a] = corner == 0 ? at[a] : _mm256_min_ps(lo[a], at[a]);
        hi[a] = corner == 0 ? at[a] : _mm256_max_ps(hi[a], at[a]);
      }
    }
    [[nodiscard]] ZKD_CPU_AVX2 __m256 longest() const {
      return _mm256_max_ps(_mm256_sub_ps(hi[0], lo[0]),
                           _mm256_max_ps(_mm256_sub_ps(hi[1], lo[1]), _mm256_sub_ps(hi[2], lo[2])));
    }
  };

  ZKD_CPU_AVX2 static __m256 magnitude(__m256 x) {
    return _mm256_and_ps(x, _mm256_castsi256_ps(_mm256_set1_epi32(0x7FFFFFFF)));
  }

  ZKD_CPU_AVX2 static std::uint32_t lanes_in_use(const TriangleBlock& block) {
    const __m256i ids = _mm256_load_si256(reinterpret_cast<const __m256i*>(block.ids));
    const __m256i unused =
        _mm256_cmpeq_epi32(ids, _mm256_set1_epi32(static_cast<int>(TriangleBlock::unused)));
    return 0xFFu & ~static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(unused)));
  }

  template <bool moved>
  ZKD_CPU_AVX2 __m256 from_origin(const TriangleBlock& block, int corner, int i) const {
    const __m256 position = _mm256_load_ps(block.positions[corner][ray_.k[i]]);
    const __m256 difference = _mm256_fmsub_ps(position, scale_, origin_[i]);
    if constexpr (!moved) return difference;
    return _mm256_sub_ps(difference, _mm256_set1_ps(ray_.permuted_rest[i].value));
  }

  const core::PreparedRay& ray_;
  __m256 scale_;
  __m256 origin_[3];
  __m256 shear_[2];
};

/// AVX2, where the processor has it.
struct Avx2Wide {
  using Boxes = Avx2WideBoxes;
  template <class Intersect>
  using Lanes = Avx2Lanes<Intersect>;

  /// What decides of the triangles that are left: a filter is not asked twice.
  template <class Intersect>
  using Decide = std::conditional_t<std::is_same_v<Intersect, core::Watertight>,
                                    core::DoublePrecision, Intersect>;
};

}  // namespace zkd::cpu
#else
namespace zkd::cpu {
using Avx2Wide = PortableWide;
}
#endif
