// SPDX-License-Identifier: Apache-2.0
//
// A device that runs every pass on the host, so that what the CUDA backend does on the host is
// proven where there is no GPU: builds, rebuilds, stages and their memory. In place of
// cuda/device.cuh; see cuda/backend.hpp for what is asked of a Device.
//
// It is as unfriendly as the rules allow. Elements come in any order, sums in any grouping, climbs
// interleave; every element gets a copy of the functor to itself; memory behind a result is
// garbage, fresh memory and scratch too, and different each time. A functor that carries an
// address of host memory is refused.
#pragma once

#include <cxxabi.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <vector>

#include <zkd/build.hpp>
#include <zkd/cpu/executor.hpp>
#include <zkd/cuda/executor.hpp>
#include <zkd/cuda/tree.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/query.hpp>
#include <zkd/tree.hpp>

#include "core/compress.hpp"
#include "core/verbs.hpp"
#include "cuda/build_steps.hpp"
#include "cuda/transfer.hpp"
#include "support/random.hpp"
#include "support/simulated_memory.hpp"
#include "support/simulated_stream.hpp"

// Under AddressSanitizer half the address space is mapped, and nothing can be told from that.
#if defined(__has_builtin) && !defined(__SANITIZE_ADDRESS__)
#if __has_builtin(__builtin_clear_padding)
#define ZKD_FINDS_HOST_POINTERS
#endif
#endif

namespace zkd::simulated {

/// A cuda::Executor whose stream is a simulated::Stream; null: one for all.
struct Executor : cuda::Executor {
  /// Whether passes may work on host memory, as no device does: for single stages whose caller
  /// keeps its arrays on the host.
  bool arrays_on_host = true;
};

template <class Visit>
void in_any_order(std::uint32_t n, test::Random& random, const Visit& visit) {
  if (n == 0) return;
  std::uint32_t step = n;
  while (std::gcd(step, n) != 1) step = 1 + random.below(n);
  std::uint64_t at = random.below(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    visit(static_cast<std::uint32_t>(at));
    at = (at + step) % n;
  }
}

template <class Functor>
Functor loaded(Functor f) {
  if constexpr (requires { f.load(); }) f.load();
  return f;
}

inline void scribble(void* data, std::size_t bytes) {
  AddressSpace::instance().fill_with_garbage(data, bytes);
}

/// The number that a Count stands for, where the device looks.
inline std::uint32_t actual(core::Count count) {
  const std::uint32_t n = count.actual != nullptr ? *count.actual : count.bound;
  if (n > count.bound)
    throw std::logic_error("a pass over " + std::to_string(n) + " elements, launched for " +
                           std::to_string(count.bound));
  return n;
}

class Device {
 public:
  explicit Device(const Executor& executor)
      : executor_(executor),
        memory_(executor.memory != nullptr ? executor.memory : &Memory::by_default()) {}

  [[nodiscard]] cuda::Stream stream() const { return executor_.stream; }
  [[nodiscard]] static int number() { return 0; }
  [[nodiscard]] cuda::MemoryResource& memory() const { return *memory_; }
  [[nodiscard]] static bool is_host_memory(const void* pointer) {
    return !AddressSpace::instance().contains(pointer);
  }

  // --- passes ---

  template <class Functor>
  void for_each(core::Count count, const Functor& f) {
    enqueue("for_each", count, f, [=](test::Random& random) {
      in_any_order(actual(count), random, [&](std::uint32_t i) { loaded(f)(i); });
    });
  }

  template <class Functor>
  void climb(core::Count leaves, std::uint32_t* arrivals, const Functor& f) {
    enqueue("climb", leaves, f, [=](test::Random& random) {
      struct Climber {
        Functor f;
        core::Parent parent;
      };
      constexpr std::size_t at_a_time = 100;
      std::vector<Climber> climbing;
      const auto one_steps = [&] {
        const std::size_t i = random.below(static_cast<std::uint32_t>(climbing.size()));
        Climber& climber = climbing[i];
        const std::uint32_t arrived = arrivals[climber.parent.node()]++;
        if (arrived > 1) throw std::logic_error("a node has more than two children that arrive");
        climber.parent = arrived != 0 ? climber.f.rise(climber.parent.node()) : core::Parent{};
        if (!climber.parent.is_none()) return;
        std::destroy_at(&climber);
        std::construct_at(&climber, climbing.back());
        climbing.pop_back();
      };
      in_any_order(actual(leaves), random, [&](std::uint32_t leaf) {
        Functor g = loaded(f);
        const core::Parent parent = g.begin(leaf);
        if (!parent.is_none()) climbing.push_back({g, parent});
        while (climbing.size() > at_a_time || (!climbing.empty() && random.one_in(2))) one_steps();
      });
      while (!climbing.empty()) one_steps();
    });
  }

  template <class T, class Functor>
  void reduce(void* scratch, std::size_t& bytes, core::Count count, T* out, const Functor& f) {
    enqueue("reduce", count, f, scratch, bytes, [=](test::Random& random) {
      std::vector<T> parts(1 + random.below(20));
      in_any_order(actual(count), random, [&](std::uint32_t i) {
        loaded(f)(i, parts[random.below(static_cast<std::uint32_t>(parts.size()))]);
      });
      *out = T{};
      for (const T& part : parts) out->combine(part);
    });
  }

  template <class T, class Functor>
  void reduce_and_count(void* scratch, std::size_t& bytes, core::Count count, T* out,
                        const Functor& f, std::uint32_t bins, std::uint32_t* counts) {
    if (bins > core::most_bins) throw std::logic_error("a histogram of too many bins");
    enqueue("reduce_and_count", count, f, scratch, bytes, [=](test::Random& random) {
      std::vector<T> parts(1 + random.below(20));
      in_any_order(actual(count), random, [&](std::uint32_t i) {
        const std::uint32_t bin =
            loaded(f)(i, parts[random.below(static_cast<std::uint32_t>(parts.size()))]);
        if (bin < bins) ++counts[bin];
      });
      *out = T{};
      for (const T& part : parts) out->combine(part);
    });
  }

  template <class Functor>
  void select(void* scratch, std::size_t& bytes, core::Count count, const Functor& f,
              std::uint32_t* out, std::uint32_t* total) {
    require_apart(count, total);
    enqueue("select", count, f, scratch, bytes, [=](test::Random& random) {
      const std::uint32_t n = actual(count);
      scribble(out, std::size_t{count.bound} * sizeof *out);
      scribble(total, sizeof *total);
      std::vector<std::uint8_t> selected(n);
      in_any_order(n, random, [&](std::uint32_t i) { selected[i] = loaded(f)(i) ? 1 : 0; });
      std::uint32_t end = 0;
      for (std::uint32_t i = 0; i < n; ++i)
        if (selected[i] != 0) out[end++] = i;
      *total = end;
    });
  }

  template <class Functor>
  void histogram(core::Count count, const Functor& f, std::uint32_t bins, std::uint32_t* out) {
    if (bins > core::most_bins) throw std::logic_error("a histogram of too many bins");
    enqueue("histogram", count, f, [=](test::Random& random) {
      in_any_order(actual(count), random, [&](std::uint32_t i) {
        const std::uint32_t bin = loaded(f)(i);
        if (bin < bins) ++out[bin];
      });
    });
  }

  template <class Functor, class Total>
  void exclusive_scan(void* scratch, std::size_t& bytes, core::Count count, const Functor& f,
                      std::uint32_t* out, Total* total) {
    require_apart(count, total);
    enqueue("exclusive_scan", count, f, scratch, bytes, [=](test::Random& random) {
      const std::uint32_t n = actual(count);
      scribble(out, std::size_t{count.bound} * sizeof *out);
      scribble(total, sizeof *total);
      std::vector<std::uint32_t> values(n);
      in_any_order(n, random, [&](std::uint32_t i) { values[i] = loaded(f)(i); });
      std::uint64_t sum = 0;
      for (std::uint32_t i = 0; i < n; ++i) {
        out[i] = static_cast<std::uint32_t>(sum);
        sum += values[i];
      }
      *total = static_cast<Total>(sum);
    });
  }

  /// A tile after the other: what each adds is known before any sum of the tile is taken.
  template <class T, class Functor>
  void scan(void* scratch, std::size_t& bytes, core::Count count, const Functor& f) {
    enqueue("scan", count, f, scratch, bytes, [=](test::Random& random) {
      const std::uint32_t n = actual(count);
      T before{};
      for (std::uint32_t begin = 0; begin < n;) {
        const std::uint32_t size = std::min(n - begin, 1 + random.below(300));
        std::vector<T> sums(size);
        in_any_order(size, random, [&](std::uint32_t i) { loaded(f)(begin + i, sums[i]); });
        T sum{};
        for (T& value : sums) {
          sum.combine(value);
          value = before;
          value.combine(sum);
        }
        in_any_order(size, random, [&](std::uint32_t i) { loaded(f).take(begin + i, sums[i]); });
        before = sums.back();
        begin += size;
      }
    });
  }

  template <class T, class Functor>
  void segmented_reduce(void* scratch, std::size_t& bytes, core::Count segments,
                        const std::uint32_t* offsets, core::Count elements, T* out,
                        const Functor& f) {
    enqueue("segmented_reduce", elements, f, scratch, bytes, [=](test::Random& random) {
      const std::uint32_t n = actual(elements);
      const std::uint32_t m = actual(segments);
      scribble(out, std::size_t{segments.bound} * sizeof *out);
      std::fill(out, out + m, T{});
      // CUB finds a segment where the number of the segment changes: none may be empty.
      for (std::uint32_t s = 0; s < m; ++s)
        if (offsets[s] >= (s + 1 < m ? offsets[s + 1] : n))
          throw std::logic_error("segment " + std::to_string(s) + " is empty");
      in_any_order(n, random, [&](std::uint32_t i) {
        const auto s =
            static_cast<std::uint32_t>(std::upper_bound(offsets, offsets + m, i) - offsets) - 1;
        T value{};
        loaded(f)(s, i, value);
        out[s].combine(value);
      });
    });
  }

  template <class Key>
  void radix_sort(void* scratch, std::size_t& bytes, core::SortBuffers<Key>& buffers,
                  core::Count count, std::uint32_t bits) {
    if (bits < 1 || bits > 8 * sizeof(Key)) throw std::logic_error("a sort by such bits");
    core::SortBuffers<Key> sorted = buffers;
    if (Stream::of(stream()).random().one_in(2)) {
      std::swap(sorted.keys, sorted.other_keys);
      std::swap(sorted.values, sorted.other_values);
    }
    const auto run = [=, from = buffers](test::Random&) {
      const std::uint32_t n = actual(count);
      const Key mask = static_cast<Key>(~Key{0} >> (8 * sizeof(Key) - bits));
      std::vector<std::pair<Key, std::uint32_t>> pairs(n);
      for (std::uint32_t i = 0; i < n; ++i) pairs[i] = {from.keys[i], from.values[i]};
      std::stable_sort(pairs.begin(), pairs.end(), [mask](const auto& a, const auto& b) {
        return (a.first & mask) < (b.first & mask);
      });
      for (Key* keys : {from.keys, from.other_keys})
        scribble(keys, std::size_t{count.bound} * sizeof *keys);
      for (std::uint32_t* values : {from.values, from.other_values})
        scribble(values, std::size_t{count.bound} * sizeof *values);
      for (std::uint32_t i = 0; i < n; ++i) {
        sorted.keys[i] = pairs[i].first;
        sorted.values[i] = pairs[i].second;
      }
    };
    enqueue("radix_sort", count, buffers, scratch, bytes, run);
    if (scratch != nullptr) buffers = sorted;
  }

  // --- copies ---

  void copy_to_host(void* to, const void* from, std::size_t bytes) {
    Stream::of(stream()).synchronize();
    const AddressSpace::Open open;
    std::memcpy(to, from, bytes);
  }

  /// Reads host memory when its turn comes, as CUDA may.
  void copy_to_device(void* to, const void* from, std::size_t bytes) {
    Stream::of(stream()).enqueue_silently("copy_to_device",
                                          [=](test::Random&) { std::memcpy(to, from, bytes); });
  }

  void stage(Stage next) { Stream::of(stream()).stage(next); }

 private:
  template <class Functor, class Run>
  void enqueue(const char* verb, core::Count count, const Functor& f, const Run& run) {
    const std::string name = std::string(verb) + " " + name_of(typeid(Functor));
    if (!executor_.arrays_on_host && carries_host_pointer(f))
      throw std::logic_error("the device would be sent to host memory: " + name);
    Stream::of(stream()).enqueue(name, count.bound, run);
  }

  /// A pass with scratch memory; without any, only its size.
  template <class Functor, class Run>
  void enqueue(const char* verb, core::Count count, const Functor& f, void* scratch,
               std::size_t& bytes, const Run& run) {
    const std::size_t needed = 2 * (std::size_t{count.bound} / 3) + 77;
    if (scratch == nullptr) {
      bytes = needed;
      return;
    }
    if (bytes < needed) throw std::logic_error(std::string(verb) + " has too little scratch");
    enqueue(verb, count, f, [=, size = bytes](test::Random& random) {
      scribble(scratch, size);
      run(random);
      scribble(scratch, size);
    });
  }

  /// The total may be written before the last element has asked how many there are.
  static void require_apart(core::Count count, const void* total) {
    if (total == count.actual) throw std::logic_error("a total that is the pass's own count");
  }

  static std::string name_of(const std::type_info& type) {
    const std::unique_ptr<char, void (*)(void*)> name(
        abi::__cxa_demangle(type.name(), nullptr, nullptr, nullptr), std::free);
    return name != nullptr ? name.get() : type.name();
  }

  /// Looks at each word of a functor.
  template <class Functor>
  static bool carries_host_pointer([[maybe_unused]] Functor f) {
#if defined(ZKD_FINDS_HOST_POINTERS)
    __builtin_clear_padding(&f);  // where addresses from long ago may be left
    const auto* bytes = reinterpret_cast<const std::byte*>(&f);
    for (std::size_t at = 0; at + sizeof(void*) <= sizeof f; at += sizeof(void*)) {
      std::uintptr_t word = 0;
      std::memcpy(&word, bytes + at, sizeof word);
      constexpr std::uintptr_t page = 4096;
      // GCC 12 leaves the padding behind an array of structures: half an old address may still
      // stand above a number.
      if (static_cast<std::uint32_t>(word) < 16 * page) continue;
      auto* const address = reinterpret_cast<void*>(word / page * page);
      if (is_host_memory(address) && msync(address, 1, MS_ASYNC) == 0) return true;
    }
#endif
    return false;
  }

  Executor executor_;
  cuda::MemoryResource* memory_;
};

/// An array in device memory.
template <class T>
class Array {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  explicit Array(std::span<const T> values, const Executor& executor = {})
      : executor_(executor), count_(values.size()) {
    if (count_ == 0) return;
    data_ = static_cast<T*>(Device(executor_).memory().allocate(bytes(), executor_.stream));
    assign(values);
  }
  explicit Array(std::size_t count, const T& value = T{}, const Executor& executor = {})
      : Array(std::span<const T>(std::vector<T>(count, value)), executor) {}
  Array(Array&& other) noexcept
      : executor_(other.executor_),
        data_(std::exchange(other.data_, nullptr)),
        count_(std::exchange(other.count_, 0)) {}
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  ~Array() {
    if (data_ != nullptr) Device(executor_).memory().deallocate(data_, bytes(), executor_.stream);
  }

  /// When all that was enqueued is done.
  void assign(std::span<const T> values) {
    Stream::of(executor_.stream).synchronize();
    const AddressSpace::Open open;
    if (!values.empty()) std::memcpy(data_, values.data(), values.size_bytes());
  }

  operator std::span<T>() { return {data_, count_}; }
  operator std::span<const T>() const { return {data_, count_}; }
  [[nodiscard]] const T* data() const { return data_; }

  [[nodiscard]] std::vector<T> download() const {
    std::vector<T> values(count_);
    if (count_ != 0) Device(executor_).copy_to_host(values.data(), data_, bytes());
    return values;
  }

 private:
  [[nodiscard]] std::size_t bytes() const { return count_ * sizeof(T); }

  Executor executor_;
  T* data_ = nullptr;
  std::size_t count_ = 0;
};

/// A cuda::Tree that asks the simulated device.
class Tree : public cuda::Tree {
 public:
  Tree() = default;
  Tree(cuda::Tree&& tree, const Executor& executor)
      : cuda::Tree(std::move(tree)), executor_(executor) {}

  void check() const {
    Device device(executor_);
    (void)cuda::checked_state(device, *this, access().record());
  }
  [[nodiscard]] Statistics statistics() const {
    Device device(executor_);
    return cuda::statistics_of(*this, cuda::checked_state(device, *this, access().record()),
                               access().workspace_bytes());
  }
  [[nodiscard]] Lattice lattice() const {
    Device device(executor_);
    return cuda::checked_state(device, *this, access().record()).lattice;
  }
  [[nodiscard]] zkd::Tree to_host(std::pmr::memory_resource* memory = nullptr) const {
    Device device(executor_);
    return cuda::copy_to_host(device, *this, access().record(), access().workspace_bytes(), memory);
  }

 private:
  // What gives access is meant for those who make trees; here nothing is changed.
  [[nodiscard]] cuda::TreeAccess access() const {
    return {const_cast<cuda::Tree&>(static_cast<const cuda::Tree&>(*this))};
  }

  Executor executor_;
};

inline Tree to_device(const Executor& executor, const zkd::Tree& tree,
                      const TriangleView& triangles) {
  Device device(executor);
  return {cuda::copy_to_device(device, tree, triangles), executor};
}

}  // namespace zkd::simulated

namespace zkd {

// As for cuda::Executor: see zkd/cuda/build.hpp and zkd/cuda/query.hpp. Builds and
// single stages are compiled once, in simulated_*.cpp: their passes take long.

simulated::Tree build(const simulated::Executor& executor, const TriangleView& triangles,
                      const BuildOptions& options = {});

void rebuild(const simulated::Executor& executor, cuda::Tree& tree, const TriangleView& triangles);

BuildOptions analyse(const simulated::Executor& executor, const TriangleView& triangles,
                     const BuildOptions& options = {});

MemoryRequirement memory_requirement(const simulated::Executor& executor,
                                     std::uint64_t triangle_count,
                                     const BuildOptions& options = {});

inline void closest_hit(const simulated::Executor& executor, const TreeView& tree,
                        const TriangleView& triangles, std::span<const Ray> rays,
                        std::span<Hit> hits, std::span<TraversalCost> costs = {}) {
  simulated::Stream::of(executor.stream)
      .enqueue("closest_hit", static_cast<std::uint32_t>(rays.size()), [=](test::Random&) {
        closest_hit(cpu::Executor{.threads = 1}, tree, triangles, rays, hits, costs);
      });
}

}  // namespace zkd

namespace zkd::simulated {

/// From host memory to host memory; makes the room that `all` needs. An object, so that a plain
/// build(executor, ...) is zkd's.
inline constexpr auto build = [](const Executor& executor, const TriangleView& triangles,
                                 const BuildOptions& options = {}) {
  BuildOptions enough = options;
  if (options.references == References::all && options.reference_capacity == 0)
    enough.reference_capacity = zkd::analyse(executor, triangles, options).reference_capacity;
  return zkd::build(executor, triangles, enough).to_host();
};

/// From host memory to host memory.
inline std::vector<Hit> closest_hits(const Executor& executor, const zkd::Tree& tree,
                                     const TriangleView& triangles, std::span<const Ray> rays) {
  const Tree on_device = to_device(executor, tree, triangles);
  const Array<Ray> uploaded(rays, executor);
  Array<Hit> hits(rays.size(), Hit{}, executor);
  zkd::closest_hit(executor, on_device.view(), on_device.triangles(), uploaded, hits);
  return hits.download();
}

}  // namespace zkd::simulated
