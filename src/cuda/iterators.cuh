// SPDX-License-Identifier: Apache-2.0
//
// The stages' functors as what CUB reads from and writes to.
//
// CUB is given the bound of a count; what lies behind the actual count, which only the device
// knows, reads as nothing and is written nowhere.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>

#include "core/search.hpp"
#include "core/verbs.hpp"

namespace zkd::cuda {

/// The number that a Count stands for.
__device__ inline std::uint32_t actual(core::Count count) {
  return count.actual != nullptr ? *count.actual : count.bound;
}

/// A copy for one thread, ready to be called.
template <class Functor>
__device__ inline Functor loaded(Functor f) {
  if constexpr (core::Loads<Functor>) f.load();
  return f;
}

/// For DeviceSelect.
template <class Functor>
struct SelectActual {
  core::Count count;
  Functor f;

  __device__ bool operator()(std::uint32_t i) const { return i < actual(count) && loaded(f)(i); }
};

/// For DeviceScan: the values to be summed, which a pass has left in `values`, and behind them 0.
struct ReadActual {
  core::Count count;
  const std::uint32_t* values;

  __device__ std::uint64_t operator()(std::uint32_t i) const {
    return i < actual(count) ? values[i] : 0;
  }
};

struct Plus {
  __host__ __device__ std::uint64_t operator()(std::uint64_t a, std::uint64_t b) const {
    return a + b;
  }
};

/// What the three iterators below have in common: a position to count from.
template <class Derived, class Write>
struct WritingIterator {
  using iterator_category = std::random_access_iterator_tag;
  using value_type = void;
  using difference_type = std::ptrdiff_t;
  using pointer = void;
  using reference = Write;

  difference_type at = 0;

  __host__ __device__ Derived operator+(difference_type n) const {
    Derived moved = static_cast<const Derived&>(*this);
    moved.at += n;
    return moved;
  }
  __host__ __device__ Derived& operator+=(difference_type n) {
    at += n;
    return static_cast<Derived&>(*this);
  }
  __host__ __device__ Derived& operator++() { return *this += 1; }
  __host__ __device__ Write operator*() const {
    return static_cast<const Derived&>(*this).place(at);
  }
  __host__ __device__ Write operator[](difference_type n) const {
    return static_cast<const Derived&>(*this).place(at + n);
  }
};

/// Where DeviceScan's sums go: those of actual elements to `out`, the one behind them to `total`.
template <class Total>
struct WriteSum {
  core::Count count;
  std::uint32_t* out;
  Total* total;
  std::ptrdiff_t i;

  __device__ const WriteSum& operator=(std::uint64_t sum) const {
    const auto index = static_cast<std::uint32_t>(i);
    const std::uint32_t n = actual(count);
    if (index < n) out[index] = static_cast<std::uint32_t>(sum);
    if (index == n) *total = static_cast<Total>(sum);
    return *this;
  }
};
template <class Total>
struct SumIterator : WritingIterator<SumIterator<Total>, WriteSum<Total>> {
  core::Count count;
  std::uint32_t* out;
  Total* total;

  __host__ __device__ SumIterator(core::Count the_count, std::uint32_t* the_out, Total* the_total)
      : count(the_count), out(the_out), total(the_total) {}
  __host__ __device__ WriteSum<Total> place(std::ptrdiff_t i) const {
    return {count, out, total, i};
  }
};

/// For DeviceReduce::ReduceByKey: the segment of each element; behind them one more.
struct SegmentOf {
  core::Count segments;
  core::Count elements;
  const std::uint32_t* offsets;

  __device__ std::uint32_t operator()(std::uint32_t i) const {
    const std::uint32_t n = actual(segments);
    return i < actual(elements) ? core::last_at_or_before(offsets, n, i) : n;
  }
};

/// Likewise: what each element adds to its segment.
template <class T, class Functor>
struct SegmentValue {
  SegmentOf segment_of;
  Functor f;

  __device__ T operator()(std::uint32_t i) const {
    T value{};
    if (i < actual(segment_of.elements)) loaded(f)(segment_of(i), i, value);
    return value;
  }
};

struct Combine {
  template <class T>
  __host__ __device__ T operator()(T a, const T& b) const {
    a.combine(b);
    return a;
  }
};

/// Where its results go: no segment is empty, so the i-th run is segment i.
template <class T>
struct WriteSegment {
  core::Count segments;
  T* out;
  std::ptrdiff_t i;

  __device__ const WriteSegment& operator=(const T& value) const {
    if (static_cast<std::uint32_t>(i) < actual(segments)) out[i] = value;
    return *this;
  }
};
template <class T>
struct SegmentIterator : WritingIterator<SegmentIterator<T>, WriteSegment<T>> {
  core::Count segments;
  T* out;

  __host__ __device__ SegmentIterator(core::Count the_segments, T* the_out)
      : segments(the_segments), out(the_out) {}
  __host__ __device__ WriteSegment<T> place(std::ptrdiff_t i) const { return {segments, out, i}; }
};

/// For DeviceScan of sums that a functor takes: what each element adds.
template <class T, class Functor>
struct ScanValue {
  core::Count count;
  Functor f;

  __device__ T operator()(std::uint32_t i) const {
    T value{};
    if (i < actual(count)) {
      Functor g = loaded(f);
      g(i, value);
    }
    return value;
  }
};

/// And where the sums go.
template <class T, class Functor>
struct TakeSum {
  core::Count count;
  Functor f;
  std::ptrdiff_t i;

  __device__ const TakeSum& operator=(const T& sum) const {
    const auto index = static_cast<std::uint32_t>(i);
    if (index < actual(count)) {
      Functor g = loaded(f);
      g.take(index, sum);
    }
    return *this;
  }
};
template <class T, class Functor>
struct TakeIterator : WritingIterator<TakeIterator<T, Functor>, TakeSum<T, Functor>> {
  core::Count count;
  Functor f;

  __host__ __device__ TakeIterator(core::Count the_count, const Functor& the_f)
      : count(the_count), f(the_f) {}
  __host__ __device__ TakeSum<T, Functor> place(std::ptrdiff_t i) const { return {count, f, i}; }
};

/// Takes what nobody wants.
struct WriteNothing {
  template <class T>
  __device__ const WriteNothing& operator=(const T&) const {
    return *this;
  }
};
struct NothingIterator : WritingIterator<NothingIterator, WriteNothing> {
  __host__ __device__ WriteNothing place(std::ptrdiff_t) const { return {}; }
};

}  // namespace zkd::cuda
