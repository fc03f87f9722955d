// SPDX-License-Identifier: Apache-2.0
//
// The same loop compiled for two instruction sets in one portable binary.
//
// A loop body is inlined, with all it calls, into a function that may use AVX2 and FMA; which of
// the two functions runs is decided at run time. Nothing is compiled twice under one name, so the
// linker cannot mix them up.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__)
#include <cpuid.h>
#endif

#include <zkd/cpu/executor.hpp>

namespace zkd::cpu {

#if defined(__x86_64__) && defined(__GNUC__)
#define ZKD_CPU_AVX2 __attribute__((target("avx2,fma,bmi,bmi2,lzcnt"), flatten))
inline constexpr bool has_avx2_code = true;
#else
#define ZKD_CPU_AVX2
inline constexpr bool has_avx2_code = false;
#endif

/// Whether this processor runs the AVX2 code: every extension that it is compiled for.
inline bool processor_has_avx2() noexcept {
#if defined(__x86_64__) && defined(__GNUC__)
  static const bool has = [] {
    // Not all compilers know the names of these two here; the bits are asked for themselves.
    unsigned a = 0;
    unsigned b = 0;
    unsigned c = 0;
    unsigned d = 0;
    const bool bmi = __get_cpuid_count(7, 0, &a, &b, &c, &d) != 0 && (b & bit_BMI) != 0;
    const bool lzcnt = __get_cpuid(0x80000001, &a, &b, &c, &d) != 0 && (c & bit_ABM) != 0;
    return bmi && lzcnt && __builtin_cpu_supports("avx2") != 0 &&
           __builtin_cpu_supports("fma") != 0 && __builtin_cpu_supports("bmi2") != 0;
  }();
  return has;
#else
  return false;
#endif
}

inline bool use_avx2(InstructionSet asked) noexcept {
  return has_avx2_code && asked != InstructionSet::portable && processor_has_avx2();
}

template <class Body, class... Arguments>
ZKD_CPU_AVX2 auto call_avx2(Body& body, Arguments... arguments) {
  return body(arguments...);
}

/// Calls body(arguments...) in the chosen instruction set.
template <class Body, class... Arguments>
auto call(bool avx2, Body& body, Arguments... arguments) {
  if (has_avx2_code && avx2) return call_avx2(body, arguments...);
  return body(arguments...);
}

}  // namespace zkd::cpu
