// SPDX-License-Identifier: Apache-2.0
//
// How passes run on a CUDA device: one thread an element, and CUB for what moves elements. See
// cuda/backend.hpp for what is asked of it.
#pragma once

#include <cuda_runtime.h>

#include <nvtx3/nvToolsExt.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/transform_iterator.h>
#include <cub/block/block_reduce.cuh>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>
#include <cuda/atomic>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <zkd/cuda/executor.hpp>
#include <zkd/statistics.hpp>

#include "core/compress.hpp"
#include "core/verbs.hpp"
#include "cuda/current_device.hpp"
#include "cuda/default_memory.hpp"
#include "cuda/error.hpp"
#include "cuda/iterators.cuh"
#include "cuda/launch.cuh"

namespace zkd::cuda {

inline constexpr unsigned block_size = 256;

/// Thread's number within the grid.
__device__ inline std::uint32_t thread_number() { return blockIdx.x * blockDim.x + threadIdx.x; }

template <class Functor>
__global__ void __launch_bounds__(block_size) for_each_kernel(core::Count count, Functor f) {
  const std::uint32_t i = thread_number();
  if (i < actual(count)) loaded(f)(i);
}

template <class Functor>
__global__ void __launch_bounds__(block_size)
    climb_kernel(core::Count leaves, std::uint32_t* arrivals, Functor f) {
  const std::uint32_t leaf = thread_number();
  if (leaf >= actual(leaves)) return;
  Functor g = loaded(f);
  core::Parent parent = g.begin(leaf);
  while (!parent.is_none()) {
    // Releases this child's box to whoever goes on, and acquires the sibling's if that is us.
    ::cuda::atomic_ref<std::uint32_t, ::cuda::thread_scope_device> arrived(arrivals[parent.node()]);
    if (arrived.fetch_add(1, ::cuda::memory_order_acq_rel) == 0) return;
    parent = g.rise(parent.node());
  }
}

/// One partial result a block; or, over those, the result.
template <class T, class Functor>
__global__ void __launch_bounds__(block_size) reduce_kernel(core::Count count, Functor f, T* out) {
  using Reduce = cub::BlockReduce<T, block_size>;
  __shared__ typename Reduce::TempStorage storage;
  const std::uint32_t n = actual(count);
  const std::uint64_t stride = std::uint64_t{gridDim.x} * block_size;
  Functor g = loaded(f);
  T mine{};
  for (std::uint64_t i = thread_number(); i < n; i += stride)
    g(static_cast<std::uint32_t>(i), mine);
  const T all = Reduce(storage).Reduce(mine, Combine{});
  if (threadIdx.x == 0) out[blockIdx.x] = all;
}

template <class T>
struct CombinePartial {
  const T* partial;
  __device__ void operator()(std::uint32_t i, T& value) const { value.combine(partial[i]); }
};

/// Gives keys behind the actual count the greatest value: the sort leaves them there, since it is
/// stable.
template <class Key>
__global__ void __launch_bounds__(block_size)
    pad_kernel(core::Count count, Key* keys, std::uint32_t* values) {
  const std::uint64_t stride = std::uint64_t{gridDim.x} * block_size;
  for (std::uint64_t i = std::uint64_t{actual(count)} + thread_number(); i < count.bound;
       i += stride) {
    keys[i] = ~Key{0};
    values[i] = 0;
  }
}

template <class Functor>
struct WriteValue {
  Functor f;
  std::uint32_t* values;
  __device__ void load() {
    if constexpr (core::Loads<Functor>) f.load();
  }
  __device__ void operator()(std::uint32_t i) const { values[i] = f(i); }
};

template <class Total>
struct WriteZero {
  Total* total;
  __device__ void operator()(std::uint32_t) const { *total = 0; }
};

class Device {
 public:
  /// Throws Error backend_unavailable where no device answers.
  explicit Device(const Executor& executor)
      : executor_(executor),
        number_(current_device()),
        memory_(executor.memory != nullptr ? executor.memory : &default_memory(number_)) {}
  ~Device() { end_range(); }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] Stream stream() const { return executor_.stream; }
  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] MemoryResource& memory() const { return *memory_; }

  // --- passes ---

  template <class Functor>
  void for_each(core::Count count, Functor f) {
    enqueue(blocks_for(count.bound), for_each_kernel<Functor>, count, f);
  }

  template <class Functor>
  void climb(core::Count leaves, std::uint32_t* arrivals, Functor f) {
    enqueue(blocks_for(leaves.bound), climb_kernel<Functor>, leaves, arrivals, f);
  }

  template <class T, class Functor>
  void reduce(void* scratch, std::size_t& bytes, core::Count count, T* out, Functor f) {
    const unsigned blocks = std::min(most_partials, blocks_for(count.bound));
    if (scratch == nullptr) {
      bytes = blocks * sizeof(T);
      return;
    }
    T* partial = static_cast<T*>(scratch);
    enqueue(blocks, reduce_kernel<T, Functor>, count, f, partial);
    enqueue(1, reduce_kernel<T, CombinePartial<T>>, core::Count{nullptr, blocks},
            CombinePartial<T>{partial}, out);
  }

  template <class Functor>
  void select(void* scratch, std::size_t& bytes, core::Count count, Functor f, std::uint32_t* out,
              std::uint32_t* total) {
    if (count.bound == 0) return none(scratch, total);
    ZKD_CUB_CHECK(cub::DeviceSelect::If(scratch, bytes, numbers(), out, total,
                                        static_cast<int>(count.bound),
                                        SelectActual<Functor>{count, f}, stream()));
  }

  template <class Functor, class Total>
  void exclusive_scan(void* scratch, std::size_t& bytes, core::Count count, Functor f,
                      std::uint32_t* out, Total* total) {
    if (count.bound == 0) return none(scratch, total);
    // A value may cost a walk through the tree: a pass of its own computes it, once, with as many
    // threads as there are elements.
    if (scratch != nullptr) for_each(count, WriteValue<Functor>{f, out});
    ZKD_CUB_CHECK(cub::DeviceScan::ExclusiveScan(
        scratch, bytes, thrust::make_transform_iterator(numbers(), ReadActual{count, out}),
        SumIterator<Total>(count, out, total), Plus{}, std::uint64_t{0}, count.bound + 1,
        stream()));
  }

  template <class T, class Functor>
  void scan(void* scratch, std::size_t& bytes, core::Count count, Functor f) {
    ZKD_CUB_CHECK(cub::DeviceScan::InclusiveScan(
        scratch, bytes, thrust::make_transform_iterator(numbers(), ScanValue<T, Functor>{count, f}),
        TakeIterator<T, Functor>(count, f), Combine{}, static_cast<int>(count.bound), stream()));
  }

  template <class T, class Functor>
  void segmented_reduce(void* scratch, std::size_t& bytes, core::Count segments,
                        const std::uint32_t* offsets, core::Count elements, T* out, Functor f) {
    const SegmentOf segment_of{segments, elements, offsets};
    // The number of runs is written in front of CUB's own memory.
    void* rest = scratch == nullptr ? nullptr : static_cast<std::byte*>(scratch) + run_count_bytes;
    std::size_t rest_bytes = bytes - (scratch == nullptr ? bytes : run_count_bytes);
    ZKD_CUB_CHECK(cub::DeviceReduce::ReduceByKey(
        rest, rest_bytes, thrust::make_transform_iterator(numbers(), segment_of), NothingIterator{},
        thrust::make_transform_iterator(numbers(), SegmentValue<T, Functor>{segment_of, f}),
        SegmentIterator<T>(segments, out), static_cast<std::uint32_t*>(scratch), Combine{},
        static_cast<int>(elements.bound), stream()));
    if (scratch == nullptr) bytes = rest_bytes + run_count_bytes;
  }

  template <class Key>
  void radix_sort(void* scratch, std::size_t& bytes, core::SortBuffers<Key>& buffers,
                  core::Count count, std::uint32_t bits) {
    if (scratch != nullptr && count.actual != nullptr)
      enqueue(std::min(most_partials, blocks_for(count.bound)), pad_kernel<Key>, count,
              buffers.keys, buffers.values);
    cub::DoubleBuffer<Key> keys(buffers.keys, buffers.other_keys);
    cub::DoubleBuffer<std::uint32_t> values(buffers.values, buffers.other_values);
    ZKD_CUB_CHECK(cub::DeviceRadixSort::SortPairs(scratch, bytes, keys, values,
                                                  static_cast<int>(count.bound), 0,
                                                  static_cast<int>(bits), stream()));
    if (scratch != nullptr)
      buffers = {keys.Current(), values.Current(), keys.Alternate(), values.Alternate()};
  }

  // --- copies ---

  void copy_to_host(void* to, const void* from, std::size_t bytes) {
    ZKD_CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, stream()));
    ZKD_CUDA_CHECK(cudaStreamSynchronize(stream()));
  }
  void copy_to_device(void* to, const void* from, std::size_t bytes) {
    ZKD_CUDA_CHECK(cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, stream()));
  }

  /// Pinned memory counts as the host's too: kernels could read it, at the speed of the bus.
  [[nodiscard]] static bool is_host_memory(const void* pointer) {
    cudaPointerAttributes attributes{};
    ZKD_CUDA_CHECK(cudaPointerGetAttributes(&attributes, pointer));
    return attributes.type == cudaMemoryTypeUnregistered || attributes.type == cudaMemoryTypeHost;
  }

  // --- clocks ---

  void stage(Stage next) {
    end_range();
    if (next != Stage::count) {
      stage_ = to_string(next);
      nvtxRangePushA(stage_);
      in_range_ = true;
    }
    if (executor_.timer != nullptr) executor_.timer->mark(next, stream());
  }

 private:
  static thrust::counting_iterator<std::uint32_t> numbers() {
    return thrust::counting_iterator<std::uint32_t>(0);
  }
  static unsigned blocks_for(std::uint32_t n) {
    return std::max(1u, (n + block_size - 1) / block_size);
  }

  /// The total of no elements.
  template <class Total>
  void none(void* scratch, Total* total) {
    if (scratch != nullptr) for_each(core::one, WriteZero<Total>{total});
  }

  template <class Kernel, class... Arguments>
  void enqueue(unsigned blocks, Kernel kernel, Arguments... arguments) {
    launch(stage_, stream(), blocks, block_size, kernel, arguments...);
  }

  void end_range() {
    if (std::exchange(in_range_, false)) nvtxRangePop();
  }

  static constexpr unsigned most_partials = 1024;
  static constexpr std::size_t run_count_bytes = 256;

  Executor executor_;
  int number_;
  MemoryResource* memory_;
  const char* stage_ = "a pass";  ///< what is being enqueued
  bool in_range_ = false;
};

}  // namespace zkd::cuda
