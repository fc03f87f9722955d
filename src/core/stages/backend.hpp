// SPDX-License-Identifier: Apache-2.0
//
// What single stages run on: the verbs of an executor's backend, by a host that waits and looks.
#pragma once

#include <cstddef>
#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/tree.hpp>

#include "core/arena.hpp"
#include "core/pipeline.hpp"
#include "core/status.hpp"
#include "core/validate.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// Which backend an executor means, as `type`; it is made from the executor. Whoever instantiates
/// the stages (instantiate.hpp) says so.
template <class Executor>
struct BackendOf;

/// The lowest index at which something holds.
struct Lowest {
  std::uint32_t index = none_found;
  ZKD_HOST_DEVICE void combine(const Lowest& other) { index = smaller(index, other.index); }
};

template <class Predicate>
struct FindLowest {
  Predicate holds;
  ZKD_HOST_DEVICE void operator()(std::uint32_t i, Lowest& lowest) const {
    if (holds(i)) lowest.index = smaller(lowest.index, i);
  }
};

/// A backend whose host knows every count before the pass that it sizes, because it waits for it:
/// passes and arrays are then exactly as large as need be, on devices too. For what else a verb
/// means see core/verbs.hpp.
template <class Backend>
class ExactBackend {
 public:
  template <class Executor>
  explicit ExactBackend(const Executor& executor)
      : backend_(executor), lowest_(backend_.keep(Lowest{})) {}

  // --- passes ---

  template <class Functor>
  void for_each(Count count, Functor f) {
    backend_.for_each(exact(count), f);
  }

  template <class T, class Functor>
  void reduce(Count count, T* out, Functor f) {
    backend_.reduce(exact(count), out, f);
  }

  template <class Functor>
  void select(Count count, Functor f, std::uint32_t* out, std::uint32_t* total) {
    backend_.select(exact(count), f, out, total);
  }

  template <class Functor>
  void histogram(Count count, Functor f, std::uint32_t bins, std::uint32_t* out) {
    backend_.histogram(exact(count), f, bins, out);
  }

  template <class Functor, class Total>
  void exclusive_scan(Count count, Functor f, std::uint32_t* out, Total* total) {
    backend_.exclusive_scan(exact(count), f, out, total);
  }

  template <class T, class Functor>
  void segmented_reduce(Count segments, const std::uint32_t* offsets, Count elements, T* out,
                        Functor f) {
    backend_.segmented_reduce(exact(segments), offsets, exact(elements), out, f);
  }

  template <class Key>
  SortBuffers<Key> radix_sort(SortBuffers<Key> buffers, Count count, std::uint32_t bits) {
    return backend_.radix_sort(buffers, exact(count), bits);
  }

  /// Of the last sort; 0 where the backend does not look for passes to leave out.
  [[nodiscard]] std::uint32_t passes_left_out() const { return backend_.passes_left_out(); }

  template <class Functor>
  void climb(Count leaves, std::uint32_t* arrivals, Functor f) {
    backend_.climb(exact(leaves), arrivals, f);
  }

  /// The lowest i for which holds(i); none_found if there is none.
  template <class Predicate>
  [[nodiscard]] std::uint32_t first_where(Count count, Predicate holds) {
    reduce(count, lowest_, FindLowest<Predicate>{holds});
    return read(lowest_).index;
  }

  // --- what the host knows: everything, at the price of waiting ---

  template <class T>
  [[nodiscard]] T read(const T* value) {
    return backend_.read(value);
  }
  /// Until all that was enqueued is done.
  void wait() { (void)read(lowest_); }

  [[nodiscard]] std::uint32_t size(Count count) {
    return count.actual != nullptr ? read(count.actual) : count.bound;
  }
  [[nodiscard]] bool may_exist(Count count) { return size(count) != 0; }

  void raise(const BuildStatus* status, const TriangleView& triangles) {
    core::raise(read(status), triangles);
  }
  [[nodiscard]] static std::uint64_t reference_capacity() { return max_count; }

  // --- memory ---

  template <class T>
  T* keep(const T& value) {
    return backend_.keep(value);
  }

  template <class Layout, class... Counts>
  void take(Layout& layout, Counts... counts) {
    backend_.take(layout, counts...);
  }

  /// One array, until the stage ends.
  template <class T>
  T* take_array(std::size_t count) {
    struct Room {
      T* array;
      void lay_out(Arena& arena, std::size_t n) { array = arena.take<T>(n); }
    } room{};
    take(room, count);
    return room.array;
  }

  void allocate_tree(Count trunks) { take(tree_, size(trunks)); }
  void allocate_references(Count references) {
    references_ = take_array<std::uint32_t>(size(references));
  }
  [[nodiscard]] Node* nodes() const { return tree_.nodes; }
  [[nodiscard]] std::uint32_t* leaf_offsets() const { return tree_.leaf_offsets; }
  [[nodiscard]] std::uint32_t* references() const { return references_; }

 private:
  [[nodiscard]] Count exact(Count count) { return {nullptr, size(count)}; }

  Backend backend_;
  Lowest* lowest_;
  TreeArrays tree_{};
  std::uint32_t* references_ = nullptr;
};

template <class Executor>
using ExactBackendOf = ExactBackend<typename BackendOf<Executor>::type>;

}  // namespace zkd::core
