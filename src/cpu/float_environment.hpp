// SPDX-License-Identifier: Apache-2.0
//
// The floating-point mode that identical results need, whatever mode the caller runs in.
#pragma once

#if defined(__SSE2__)
#include <xmmintrin.h>
#else
#include <cfenv>
#endif

namespace zkd::cpu {

/// While it lives, this thread rounds to nearest and keeps denormals; then the old mode is back.
/// A program linked with -ffast-math starts with flush-to-zero set, so this is no rare case.
class FloatEnvironment {
 public:
#if defined(__SSE2__)
  FloatEnvironment() noexcept : saved_(_mm_getcsr()) {
    if ((saved_ & mode_bits) != masked_exceptions)
      _mm_setcsr((saved_ & ~mode_bits) | masked_exceptions);
  }
  ~FloatEnvironment() {
    if ((saved_ & mode_bits) != masked_exceptions)
      _mm_setcsr((_mm_getcsr() & ~mode_bits) | (saved_ & mode_bits));
  }
#else
  FloatEnvironment() noexcept {
    std::feholdexcept(&saved_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~FloatEnvironment() { std::fesetenv(&saved_); }
#endif
  FloatEnvironment(const FloatEnvironment&) = delete;             // it stands for a scope
  FloatEnvironment& operator=(const FloatEnvironment&) = delete;  // likewise

 private:
#if defined(__SSE2__)
  // Flush-to-zero 0x8000, rounding 0x6000, exception masks 0x1F80, denormals-are-zero 0x0040.
  static constexpr unsigned mode_bits = 0xFFC0;
  static constexpr unsigned masked_exceptions = 0x1F80;  // to nearest, nothing flushed, no traps
  unsigned saved_;
#else
  std::fenv_t saved_;
#endif
};

}  // namespace zkd::cpu
