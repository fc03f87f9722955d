// SPDX-License-Identifier: Apache-2.0
//
// A CUDA device as a platform. See support/platform.hpp. Host code: compiled by the host's
// compiler.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <cuda_runtime_api.h>

#include <zkd/cuda/build.hpp>
#include <zkd/cuda/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>

#include "support/uploaded_triangles.hpp"

namespace zkd::test {

using Executor = cuda::Executor;

inline constexpr std::uint32_t thinning = 17;
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
    copy_from(values);
  }
  Array(Array&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), count_(std::exchange(other.count_, 0)) {}
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  ~Array() { (void)cudaFree(data_); }

  operator std::span<T>() { return {data_, count_}; }
  operator std::span<const T>() const { return {data_, count_}; }

  /// As many values as before.
  void assign(std::span<const T> values) {
    if (values.size() != count_) throw std::logic_error("an array does not change its length");
    if (count_ != 0) copy_from(values);
  }

  [[nodiscard]] const T* data() const { return data_; }

  [[nodiscard]] std::vector<T> download() const {
    std::vector<T> values(count_);
    if (count_ != 0)
      require(cudaMemcpy(values.data(), data_, count_ * sizeof(T), cudaMemcpyDeviceToHost));
    return values;
  }

 private:
  // Done when it returns, for other streams too: a copy of pageable memory may end later.
  void copy_from(std::span<const T> values) {
    require(cudaMemcpy(data_, values.data(), values.size_bytes(), cudaMemcpyHostToDevice));
    require(cudaStreamSynchronize(nullptr));
  }

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

/// `all` with the room that it needs.
inline BuildOptions with_room(const TriangleView& triangles, const BuildOptions& options) {
  if (options.references != References::all || options.reference_capacity != 0) return options;
  BuildOptions enough = options;
  enough.reference_capacity = analyse(executor(), triangles, options).reference_capacity;
  return enough;
}

/// A program's own device memory, in the order of a stream: counts, and refuses.
class CountingMemory final : public cuda::MemoryResource {
 public:
  /// The allocation (from 1) that is refused; 0: none.
  std::size_t refuse_at = 0;

  void* allocate(std::size_t bytes, cuda::Stream stream) override {
    asked_.push_back(bytes);
    if (asked_.size() == refuse_at) throw std::bad_alloc();
    void* data = nullptr;
    require(cudaMallocAsync(&data, bytes, stream));
    live_[data] = bytes;
    return data;
  }

  void deallocate(void* data, std::size_t bytes, cuda::Stream stream) noexcept override {
    const auto block = live_.find(data);
    if (block == live_.end() || block->second != bytes) {
      misused_ = true;
      return;
    }
    live_.erase(block);
    misused_ |= cudaFreeAsync(data, stream) != cudaSuccess;
  }

  /// Bytes of each allocation since the last forget(), refused ones too.
  [[nodiscard]] const std::vector<std::size_t>& asked() const { return asked_; }
  [[nodiscard]] std::size_t live_blocks() const { return live_.size(); }
  /// A block came back that was not given out, of another size, or on a stream that refused it.
  [[nodiscard]] bool misused() const { return misused_; }
  void forget() { asked_.clear(); }

 private:
  std::vector<std::size_t> asked_;
  std::map<void*, std::size_t> live_;
  bool misused_ = false;
};

}  // namespace zkd::test
