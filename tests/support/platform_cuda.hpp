// SPDX-License-Identifier: Apache-2.0
//
// A CUDA device as a platform. See support/platform.hpp. Host code: compiled by the host's
// compiler.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <cuda_runtime_api.h>

#include <zkd/cuda/build.hpp>
#include <zkd/cuda/query.hpp>
#include <zkd/geometry.hpp>

#include "support/uploaded_triangles.hpp"

namespace zkd::test {

using Executor = cuda::Executor;

inline constexpr std::uint32_t thinning = 16;
inline constexpr bool sort_leaves_passes_out = false;

inline Executor executor(int = 0) { return {}; }
inline std::vector<Executor> executors(int) { return {executor()}; }
inline std::vector<Executor> all_executors(int) { return {executor()}; }
inline std::string name(const Executor&) { return "CUDA"; }

inline void require(cudaError_t status) {
  if (status != cudaSuccess) throw std::runtime_error(cudaGetErrorString(status));
}

template <class T>
class Array {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  explicit Array(std::size_t count, const T& value = T{})
      : Array(std::span<const T>(std::vector<T>(count, value))) {}
  explicit Array(std::span<const T> values) : count_(values.size()) {
    if (count_ == 0) return;
    require(cudaMalloc(reinterpret_cast<void**>(&data_), values.size_bytes()));
    require(cudaMemcpy(data_, values.data(), values.size_bytes(), cudaMemcpyHostToDevice));
  }
  Array(Array&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), count_(std::exchange(other.count_, 0)) {}
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  ~Array() { (void)cudaFree(data_); }

  operator std::span<T>() { return {data_, count_}; }
  operator std::span<const T>() const { return {data_, count_}; }

  [[nodiscard]] const T* data() const { return data_; }

  [[nodiscard]] std::vector<T> download() const {
    std::vector<T> values(count_);
    if (count_ != 0)
      require(cudaMemcpy(values.data(), data_, count_ * sizeof(T), cudaMemcpyDeviceToHost));
    return values;
  }

 private:
  T* data_ = nullptr;
  std::size_t count_ = 0;
};

template <class T>
Array<T> upload(const std::vector<T>& values) {
  return Array<T>(std::span<const T>(values));
}

inline UploadedTriangles<Array> upload(const TriangleView& triangles) {
  return UploadedTriangles<Array>(triangles);
}

/// Makes the room that `all` needs.
inline Tree build(const TriangleView& triangles, const BuildOptions& options = {}) {
  const UploadedTriangles<Array> on_device(triangles);
  BuildOptions enough = options;
  if (options.references == References::all && options.reference_capacity == 0)
    enough.reference_capacity = analyse(executor(), on_device, options).reference_capacity;
  return zkd::build(executor(), on_device, enough).to_host();
}

inline std::vector<Hit> closest_hits(const Tree& tree, const TriangleView& triangles,
                                     std::span<const Ray> rays) {
  const cuda::Tree on_device = cuda::to_device(executor(), tree, triangles);
  const Array<Ray> uploaded(rays);
  Array<Hit> hits(rays.size());
  closest_hit(executor(), on_device.view(), on_device.triangles(), uploaded, hits);
  return hits.download();
}

}  // namespace zkd::test
