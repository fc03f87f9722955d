// SPDX-License-Identifier: Apache-2.0
//
// All stages as kernels of nothing but their functors, by way of a backend that only launches: what
// is in this file's PTX is the arithmetic of src/core. For PTX only; never run.
#include <cstddef>
#include <cstdint>

#include "core/pipeline.hpp"

namespace zkd::core {

template <class Functor>
__device__ Functor loaded(Functor f) {
  if constexpr (requires { f.load(); }) f.load();
  return f;
}

__device__ std::uint32_t thread_number() { return blockIdx.x * blockDim.x + threadIdx.x; }

template <class Functor>
__global__ void for_each_kernel(Functor f) {
  Functor g = loaded(f);
  g(thread_number());
}

template <class Functor, class Value>
__global__ void value_kernel(Functor f, Value* out) {
  Functor g = loaded(f);
  out[thread_number()] = g(thread_number());
}

template <class Functor, class T>
__global__ void reduce_kernel(Functor f, T* out) {
  Functor g = loaded(f);
  T value{};
  g(thread_number(), value);
  out[thread_number()].combine(value);
}

template <class Functor, class T>
__global__ void reduce_and_count_kernel(Functor f, T* out, std::uint32_t* counts) {
  Functor g = loaded(f);
  T value{};
  atomicAdd(counts + g(thread_number(), value), 1u);
  out[thread_number()].combine(value);
}

template <class Functor, class T>
__global__ void segmented_reduce_kernel(Functor f, const std::uint32_t* offsets, T* out) {
  Functor g = loaded(f);
  const std::uint32_t segment = blockIdx.x;
  T value{};
  for (std::uint32_t i = offsets[segment]; i < offsets[segment + 1]; ++i) g(segment, i, value);
  out[segment].combine(value);
}

template <class Functor>
__global__ void climb_kernel(Functor f, std::uint32_t* arrivals) {
  Functor g = loaded(f);
  Parent parent = g.begin(thread_number());
  while (!parent.is_none() && atomicAdd(arrivals + parent.node(), 1u) != 0)
    parent = g.rise(parent.node());
}

/// The verbs of core/verbs.hpp, as far as they make the compiler see every functor.
class LaunchOnly {
 public:
  void stage(Stage) {}

  template <class Functor>
  void for_each(Count count, Functor f) {
    for_each_kernel<<<count.bound, 1>>>(f);
  }
  template <class T, class Functor>
  void reduce(Count count, T* out, Functor f) {
    reduce_kernel<<<count.bound, 1>>>(f, out);
  }
  template <class T, class Functor>
  void reduce_and_count(Count count, T* out, Functor f, std::uint32_t, std::uint32_t* counts) {
    reduce_and_count_kernel<<<count.bound, 1>>>(f, out, counts);
  }
  template <class Functor>
  void histogram(Count count, Functor f, std::uint32_t, std::uint32_t* out) {
    value_kernel<<<count.bound, 1>>>(f, out);
  }
  template <class Functor>
  void select(Count count, Functor f, std::uint32_t* out, std::uint32_t*) {
    value_kernel<<<count.bound, 1>>>(f, out);
  }
  template <class Functor, class Total>
  void exclusive_scan(Count count, Functor f, std::uint32_t* out, Total*) {
    value_kernel<<<count.bound, 1>>>(f, out);
  }
  template <class T, class Functor>
  void segmented_reduce(Count segments, const std::uint32_t* offsets, Count, T* out, Functor f) {
    segmented_reduce_kernel<<<segments.bound, 1>>>(f, offsets, out);
  }
  template <class Key>
  SortBuffers<Key> radix_sort(const SortBuffers<Key>& buffers, Count, std::uint32_t) {
    return buffers;
  }
  template <class Functor>
  void climb(Count leaves, std::uint32_t* arrivals, Functor f) {
    climb_kernel<<<leaves.bound, 1>>>(f, arrivals);
  }

  [[nodiscard]] bool may_exist(Count) const { return true; }
  [[nodiscard]] std::uint32_t size(Count count) const { return count.bound; }
  void raise(const BuildStatus*, const TriangleView&) {}
  [[nodiscard]] std::uint64_t reference_capacity() const { return max_count; }

  template <class Layout, class... Counts>
  void take(Layout& layout, Counts... counts) {
    Arena arena;
    layout.lay_out(arena, counts...);
  }
  void allocate_tree(Count) {}
  void allocate_references(Count) {}
  [[nodiscard]] TreeHeader* header() const { return nullptr; }
  [[nodiscard]] Node* nodes() const { return nullptr; }
  [[nodiscard]] std::uint32_t* leaf_offsets() const { return nullptr; }
  [[nodiscard]] std::uint32_t* references() const { return nullptr; }
};

// Every functor of a build.
template class MortonPipeline<std::uint32_t, LaunchOnly>;
template class MortonPipeline<std::uint64_t, LaunchOnly>;

// Functors for those who call a stage by itself.
template __global__ void for_each_kernel(NumberCrowd);
template __global__ void for_each_kernel(WriteKey<std::uint32_t>);
template __global__ void for_each_kernel(WriteKey<std::uint64_t>);
template __global__ void for_each_kernel(PlaceSplitPlane<LatticePlanes, CrowdByTrunk>);
template __global__ void reduce_kernel(IncludeBox, ValidationReport*);

}  // namespace zkd::core
