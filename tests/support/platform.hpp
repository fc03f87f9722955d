// SPDX-License-Identifier: Apache-2.0
//
// Where the tests run. The same test source is compiled once for each platform: the CPU, a CUDA
// device (ZKD_TEST_CUDA), or the CUDA backend's logic on the host (ZKD_TEST_SIMULATED). Each
// offers, in zkd::test:
//
//   Executor                  what stages are called with
//   executor(threads)         one; only the CPU has threads
//   executors(most)           one for each number of threads up to `most`; elsewhere one
//   all_executors(most)       the same for every instruction set
//   name(executor)            for messages
//   Array<T>                  values where the platform's stages find them: made of a length or of
//                             host values, passed as a span, brought back by download()
//   upload(...)               an Array of these values; a TriangleView that may be passed to stages
//   thinning                  where a call costs launches and waits, tests with thousands of tiny
//                             calls make one in so many (a prime, so that every option stays)
//   sort_leaves_passes_out    whether stages::radix_sort looks for passes that are not needed
//
// Tests of whole trees need none of it: see support/platform_tree.hpp.
#pragma once

#if defined(ZKD_TEST_CUDA)
#include "support/platform_cuda.hpp"  // IWYU pragma: export
#elif defined(ZKD_TEST_SIMULATED)
#include "support/platform_simulated.hpp"  // IWYU pragma: export
#else
#include "support/platform_cpu.hpp"  // IWYU pragma: export
#endif
