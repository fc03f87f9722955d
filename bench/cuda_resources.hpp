// SPDX-License-Identifier: Apache-2.0
//
// Owners of what the CUDA runtime hands out, and its errors as zkd::Error.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace zkd::bench {

/// Throws Error (out_of_memory for cudaErrorMemoryAllocation, else device_failure) that names
/// `call`, and clears the error.
void check_cuda(cudaError_t status, const char* call);

/// A stream that does not wait for the default one.
class CudaStream {
 public:
  CudaStream() {
    check_cuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate");
  }
  ~CudaStream() { (void)cudaStreamDestroy(stream_); }
  CudaStream(const CudaStream&) = delete;
  CudaStream& operator=(const CudaStream&) = delete;

  [[nodiscard]] cudaStream_t get() const { return stream_; }
  void wait() const { check_cuda(cudaStreamSynchronize(stream_), "cudaStreamSynchronize"); }

 private:
  cudaStream_t stream_ = nullptr;
};

/// The device's clock around what is enqueued between begin() and end().
class CudaClock {
 public:
  explicit CudaClock(const CudaStream& stream) : stream_(stream) {
    check_cuda(cudaEventCreate(&begin_), "cudaEventCreate");
    const cudaError_t status = cudaEventCreate(&end_);
    if (status != cudaSuccess) (void)cudaEventDestroy(begin_);
    check_cuda(status, "cudaEventCreate");
  }
  ~CudaClock() {
    (void)cudaEventDestroy(begin_);
    (void)cudaEventDestroy(end_);
  }
  CudaClock(const CudaClock&) = delete;
  CudaClock& operator=(const CudaClock&) = delete;

  void begin() { check_cuda(cudaEventRecord(begin_, stream_.get()), "cudaEventRecord"); }
  void end() { check_cuda(cudaEventRecord(end_, stream_.get()), "cudaEventRecord"); }

  /// Waits for end().
  [[nodiscard]] double ms() const {
    check_cuda(cudaEventSynchronize(end_), "cudaEventSynchronize");
    float ms = 0.0F;
    check_cuda(cudaEventElapsedTime(&ms, begin_, end_), "cudaEventElapsedTime");
    return static_cast<double>(ms);
  }

  /// Milliseconds of what `work` enqueues on the stream, which is idle before.
  template <class Work>
  double time(Work&& work) {
    stream_.wait();
    begin();
    work();
    end();
    return ms();
  }

 private:
  const CudaStream& stream_;
  cudaEvent_t begin_ = nullptr;
  cudaEvent_t end_ = nullptr;
};

/// Device memory, or pinned host memory, for `T`s that grows on demand and never shrinks.
template <class T, bool pinned = false>
class CudaArray {
 public:
  CudaArray() = default;
  ~CudaArray() { release(); }
  CudaArray(const CudaArray&) = delete;
  CudaArray& operator=(const CudaArray&) = delete;

  /// Room for `count`; what was in it may be lost.
  void reserve(std::size_t count) {
    if (count <= capacity_) return;
    release();
    void* data = nullptr;
    if constexpr (pinned) {
      check_cuda(cudaMallocHost(&data, count * sizeof(T)), "cudaMallocHost");
    } else {
      check_cuda(cudaMalloc(&data, count * sizeof(T)), "cudaMalloc");
    }
    data_ = static_cast<T*>(data);
    capacity_ = count;
  }

  [[nodiscard]] T* data() const { return data_; }
  [[nodiscard]] std::size_t bytes() const { return capacity_ * sizeof(T); }
  [[nodiscard]] std::span<T> first(std::size_t count) const { return {data_, count}; }

 private:
  void release() {
    if constexpr (pinned) {
      (void)cudaFreeHost(data_);
    } else {
      (void)cudaFree(data_);
    }
    data_ = nullptr;
    capacity_ = 0;
  }

  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

/// What `work` enqueues on a stream, captured, to be launched again and again.
class CudaGraph {
 public:
  template <class Work>
  CudaGraph(const CudaStream& stream, Work&& work) {
    check_cuda(cudaStreamBeginCapture(stream.get(), cudaStreamCaptureModeThreadLocal),
               "cudaStreamBeginCapture");
    try {
      work();
    } catch (...) {
      (void)cudaStreamEndCapture(stream.get(), &graph_);
      if (graph_ != nullptr) (void)cudaGraphDestroy(graph_);
      throw;
    }
    check_cuda(cudaStreamEndCapture(stream.get(), &graph_), "cudaStreamEndCapture");
    const cudaError_t status = cudaGraphInstantiate(&executable_, graph_, 0);
    if (status != cudaSuccess) (void)cudaGraphDestroy(graph_);
    check_cuda(status, "cudaGraphInstantiate");
  }
  ~CudaGraph() {
    (void)cudaGraphExecDestroy(executable_);
    (void)cudaGraphDestroy(graph_);
  }
  CudaGraph(const CudaGraph&) = delete;
  CudaGraph& operator=(const CudaGraph&) = delete;

  void launch(const CudaStream& stream) const {
    check_cuda(cudaGraphLaunch(executable_, stream.get()), "cudaGraphLaunch");
  }

  [[nodiscard]] std::size_t nodes() const {
    std::size_t count = 0;
    check_cuda(cudaGraphGetNodes(graph_, nullptr, &count), "cudaGraphGetNodes");
    return count;
  }

 private:
  cudaGraph_t graph_ = nullptr;
  cudaGraphExec_t executable_ = nullptr;
};

}  // namespace zkd::bench
