// SPDX-License-Identifier: Apache-2.0
//
// Part of every test program under ThreadSanitizer: what happens inside libraries that are not
// instrumented (libomp, GMP) is no race of ours. How libomp's threads wait for each other is told to
// ThreadSanitizer by Archer, which is linked in.

extern "C" const char* __tsan_default_options() {
  return "ignore_noninstrumented_modules=1 halt_on_error=1";
}
