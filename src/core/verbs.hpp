// SPDX-License-Identifier: Apache-2.0
//
// What the pipeline asks of a backend, and the small types both speak in.
//
// Counts that the scene decides (valid triangles, trunks, ...) live where the data is. A Count
// names one together with a bound that the host knows, so that nothing has to come back to the host
// in the middle of a build.
//
// A backend has these verbs; arrays are in the backend's own memory.
//
//   stage(Stage)                       names the work that follows, for clocks and profilers
//   for_each(count, f)                 f(i); one is worth a thread where F::is_long is true
//   reduce(count, &out, f)             out = T{}; f(i, out) for all i, in any grouping (T::combine)
//   histogram(count, f, bins, out)     out[b] = how many i have f(i) = b, below `bins` (at most
//                                      most_bins)
//   reduce_and_count(count, &out, f, bins, counts)     both at once: f(i, out) names the bin
//   select(count, f, out, &total)      the i for which f(i), in order
//   exclusive_scan(count, f, out, &total)     sums of f(0) .. f(i - 1). f.prefetch(i, end), if
//                                      there is one, may be called before, below `end`
//   scan<T>(count, f)                  sum = T{}; for each i in order: f(i, sum), then f.take(i,
//   sum),
//                                      in any grouping (T::combine, of what follows). f.take(i) may
//                                      write to what f(i) reads and no other f(k) does. Segments
//                                      are in T, which a first element empties; f.segment_begin(i):
//                                      the first element that the sum at i depends on
//   segmented_reduce(segments, offsets, elements, out, f)   out[s] = T{}; f(s, i, out[s])
//   radix_sort(buffers, count, bits)   stable; says in which of the buffers the result is
//   climb(leaves, arrivals, f)         f.begin(leaf), then f.rise(node) for each node whose second
//                                      child has arrived (counted in `arrivals`, zero before); both
//                                      return the way up. f.prefetch(leaf) may be called before
//   recode(trunks, count, elements)    optional: the second round in one (core/recode.hpp)
//   may_exist(count), size(count)      what the host knows; where only the device does: true, bound
//   raise(status, triangles)           throws what the status says, if the host can look now
//   reference_capacity()               how many references a tree may have
//   take(layout, counts...)            arrays until the build ends
//   hold(bytes)                        a block of its own (Held: data(), bytes()), until its owner
//                                      dies. Only where builds wait
//   keep(value)                        a copy in the backend's memory until the build ends, for
//                                      functors to point to
//   read(pointer)                      what it points to, when all that was enqueued is done:
//   waits.
//                                      Builds do not, single stages do (core/stages)
//   allocate_tree, allocate_references the arrays of the tree, from then on at header(), nodes(),
//                                      leaf_offsets(), references()
//   allocate_tree_exactly(leaves, references)     both, where the host knows
//
// A functor is copied for every range of elements that one thread works on. If it has a member
// load(), that is called first: there the copy reads numbers that earlier stages left in the
// backend's memory. A copy may remember something from one element to the next, if the results do
// not depend on it.
#pragma once

#include <cstdint>

#include <zkd/config.hpp>
#include <zkd/traversal/arithmetic.hpp>

namespace zkd::core {

/// How many elements a pass works on.
struct Count {
  const std::uint32_t* actual = nullptr;  ///< in the backend's memory; null: exactly `bound`
  std::uint32_t bound = 0;                ///< known to the host
};

/// A pass over a single element: work for one thread.
inline constexpr Count one{nullptr, 1};

/// A histogram may have as many: they fit into the shared memory of a block.
inline constexpr std::uint32_t most_bins = 1024;

/// Functors that have to be made ready (see above).
template <class Functor>
concept Loads = requires(Functor& f) {
  f.load();
};

/// Functors each of whose elements is much work (see above).
template <class Functor>
concept Long = Functor::is_long;

/// Keys and values, and room to move them to and fro.
template <class Key>
struct SortBuffers {
  Key* keys;
  std::uint32_t* values;
  Key* other_keys;
  std::uint32_t* other_values;
};

/// Bits needed to write the numbers below `count`.
inline std::uint32_t bits_to_count(std::uint32_t count) {
  return count > 1 ? 64 - leading_zeros(count - 1) : 1;
}

template <class T>
struct CopyTo {
  const T* from;
  T* to;
  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const { to[i] = from[i]; }
};

struct Fill {
  std::uint32_t* array;
  std::uint32_t value;
  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const { array[i] = value; }
};

/// 0, 1, 2, ...
struct Number {
  std::uint32_t* array;
  ZKD_HOST_DEVICE void operator()(std::uint32_t i) const { array[i] = i; }
};

}  // namespace zkd::core
