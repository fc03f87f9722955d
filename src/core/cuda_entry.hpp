// SPDX-License-Identifier: Apache-2.0
//
// How a build without an executor finds CUDA: the library zkd::cuda defines this function, and a
// program that does not link it has none.
#pragma once

#include <string>

#include <zkd/config.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/tree.hpp>

namespace zkd::core {

struct CudaEntry {
  /// As zkd::cuda::available.
  bool (*available)(std::string* why) noexcept;
  /// From host memory to host memory; waits.
  Tree (*build)(const TriangleView& triangles, const BuildOptions& options);
};

}  // namespace zkd::core

extern "C" ZKD_API __attribute__((weak)) const zkd::core::CudaEntry* zkd_cuda_entry();
