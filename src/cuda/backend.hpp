// SPDX-License-Identifier: Apache-2.0
//
// The verbs of core/verbs.hpp for a device that works by itself: what is enqueued, in which order,
// in which memory. Host code, and nothing in it waits for the device but read().
//
// How a pass runs is the business of a Device (cuda/device.cuh; the tests have one that runs on the
// host). Every call enqueues on its stream:
//
//   for_each(count, f), climb(leaves, arrivals, f)     as the verbs
//   reduce, select, exclusive_scan, scan, segmented_reduce, radix_sort
//       likewise, with two arguments in front: scratch memory and its size. Without memory (null)
//       nothing is enqueued, and the size becomes what would be needed.
//   stage(next)                                        for clocks and profilers
//   copy_to_host(to, from, bytes)                      waits
//
// A Memory is one of those in cuda/memory.hpp.
#pragma once

#include <cstddef>
#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/statistics.hpp>
#include <zkd/tree.hpp>

#include "core/pipeline.hpp"
#include "core/status.hpp"
#include "core/verbs.hpp"

namespace zkd::cuda {

/// What a tree has room for: as many leaves as triangles, and so many references.
struct Capacity {
  std::uint64_t triangles = 0;
  std::uint64_t references = 0;
};

/// A layout of one array.
template <class T>
struct Array {
  T* data = nullptr;
  void lay_out(core::Arena& arena, std::size_t count) { data = arena.take<T>(count); }
};

/// A tree whose size is known.
struct ExactTree {
  core::BuildState* record;
  core::TreeArrays arrays;
  Array<std::uint32_t> references;

  void lay_out(core::Arena& arena, std::size_t leaves, std::size_t reference_count) {
    record = arena.take<core::BuildState>(1);
    arrays.lay_out(arena, leaves);
    references.lay_out(arena, reference_count);
  }
};

/// Takes a value along to the device.
template <class T>
struct Store {
  T value;
  T* to;
  ZKD_HOST_DEVICE void operator()(std::uint32_t) const { *to = value; }
};

template <class Device, class Memory>
class Backend {
 public:
  Backend(Device& device, Memory& memory, Capacity capacity)
      : device_(device), memory_(memory), capacity_(capacity) {}

  // --- passes ---

  template <class Functor>
  void for_each(core::Count count, Functor f) {
    if (count.bound == 0) return;
    enqueue([&] { device_.for_each(count, f); });
  }

  template <class Functor>
  void climb(core::Count leaves, std::uint32_t* arrivals, Functor f) {
    if (leaves.bound == 0) return;
    enqueue([&] { device_.climb(leaves, arrivals, f); });
  }

  template <class T, class Functor>
  void reduce(core::Count count, T* out, Functor f) {
    enqueue_with_scratch(
        [&](void* scratch, std::size_t& bytes) { device_.reduce(scratch, bytes, count, out, f); });
  }

  template <class Functor>
  void select(core::Count count, Functor f, std::uint32_t* out, std::uint32_t* total) {
    enqueue_with_scratch([&](void* scratch, std::size_t& bytes) {
      device_.select(scratch, bytes, count, f, out, total);
    });
  }

  template <class Functor, class Total>
  void exclusive_scan(core::Count count, Functor f, std::uint32_t* out, Total* total) {
    enqueue_with_scratch([&](void* scratch, std::size_t& bytes) {
      device_.exclusive_scan(scratch, bytes, count, f, out, total);
    });
  }

  template <class T, class Functor>
  void scan(core::Count count, Functor f) {
    if (count.bound == 0) return;
    enqueue_with_scratch([&](void* scratch, std::size_t& bytes) {
      device_.template scan<T>(scratch, bytes, count, f);
    });
  }

  template <class T, class Functor>
  void segmented_reduce(core::Count segments, const std::uint32_t* offsets, core::Count elements,
                        T* out, Functor f) {
    if (elements.bound == 0) return;
    enqueue_with_scratch([&](void* scratch, std::size_t& bytes) {
      device_.segmented_reduce(scratch, bytes, segments, offsets, elements, out, f);
    });
  }

  template <class Key>
  core::SortBuffers<Key> radix_sort(core::SortBuffers<Key> buffers, core::Count count,
                                    std::uint32_t bits) {
    if (count.bound == 0) return buffers;
    enqueue_with_scratch([&](void* scratch, std::size_t& bytes) {
      device_.radix_sort(scratch, bytes, buffers, count, bits);
    });
    return buffers;
  }

  // --- what the host knows: bounds ---

  [[nodiscard]] static std::uint32_t size(core::Count count) { return count.bound; }
  [[nodiscard]] static bool may_exist(core::Count count) { return count.bound != 0; }
  [[nodiscard]] std::uint64_t reference_capacity() const { return capacity_.references; }

  /// The tree's owner throws, when asked.
  static void raise(const core::BuildStatus*, const TriangleView&) {}

  // --- memory ---

  template <class Layout, class... Counts>
  void take(Layout& layout, Counts... counts) {
    memory_.take(layout, counts...);
  }

  void allocate_tree(core::Count) { memory_.take_for_tree(arrays_, capacity_.triangles); }
  void allocate_references(core::Count) {
    memory_.take_for_tree(references_, capacity_.references);
  }

  void allocate_tree_exactly(std::uint32_t leaves, std::uint32_t references) {
    ExactTree tree{};
    memory_.take_for_tree(tree, leaves, references);
    record_ = tree.record;
    arrays_ = tree.arrays;
    references_ = tree.references;
  }
  auto hold(std::size_t bytes) { return memory_.hold(bytes); }

  /// After allocate_tree_exactly: room for what the build found.
  [[nodiscard]] core::BuildState* record() const { return record_; }
  [[nodiscard]] TreeHeader* header() const { return arrays_.header; }
  [[nodiscard]] Node* nodes() const { return arrays_.nodes; }
  [[nodiscard]] std::uint32_t* leaf_offsets() const { return arrays_.leaf_offsets; }
  [[nodiscard]] std::uint32_t* references() const { return references_.data; }

  /// A copy in the backend's memory, for as long as the backend lives.
  template <class T>
  T* keep(const T& value) {
    Array<T> array{};
    take(array, std::size_t{1});
    for_each(core::one, Store<T>{value, array.data});
    return array.data;
  }

  /// Waits for all that was enqueued.
  template <class T>
  T read(const T* value) {
    T result;
    device_.copy_to_host(&result, value, sizeof(T));
    return result;
  }

  // --- clocks and counts ---

  void stage(Stage next) {
    if (!memory_.counting()) device_.stage(next);
  }
  [[nodiscard]] std::uint32_t passes() const { return passes_; }
  /// Which digits differ only the device could know: the sort goes over all.
  [[nodiscard]] static std::uint32_t passes_left_out() { return 0; }

 private:
  template <class Work>
  void enqueue(const Work& work) {
    ++passes_;
    if (!memory_.counting()) work();
  }

  template <class Work>
  void enqueue_with_scratch(const Work& work) {
    ++passes_;
    auto scratch = memory_.scratch([&] {
      std::size_t bytes = 0;
      work(nullptr, bytes);
      return bytes;
    });
    if (!memory_.counting()) work(scratch.data, scratch.bytes);
  }

  Device& device_;
  Memory& memory_;
  Capacity capacity_;
  core::BuildState* record_ = nullptr;
  core::TreeArrays arrays_{};
  Array<std::uint32_t> references_{};
  std::uint32_t passes_ = 0;
};

}  // namespace zkd::cuda
