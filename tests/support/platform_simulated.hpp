// SPDX-License-Identifier: Apache-2.0
//
// The CUDA backend's logic on the host, as a platform. See support/platform.hpp, and
// support/simulated_device.hpp for what such a device finds out.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <zkd/geometry.hpp>

#include "support/simulated_device.hpp"
#include "support/uploaded_triangles.hpp"

namespace zkd::test {

using Executor = simulated::Executor;

inline constexpr std::uint32_t thinning = 17;
inline constexpr bool sort_leaves_passes_out = false;

inline Executor executor(int = 0) {
  Executor executor;
  executor.arrays_on_host = false;
  return executor;
}
inline std::vector<Executor> executors(int) { return {executor()}; }
inline std::vector<Executor> all_executors(int) { return {executor()}; }
inline std::string name(const Executor&) { return "simulated"; }

template <class T>
using Array = simulated::Array<T>;

template <class T>
Array<T> upload(const std::vector<T>& values) {
  return Array<T>(std::span<const T>(values));
}

inline UploadedTriangles<simulated::Array> upload(const TriangleView& triangles) {
  return UploadedTriangles<simulated::Array>(triangles);
}

}  // namespace zkd::test
