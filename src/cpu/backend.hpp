// SPDX-License-Identifier: Apache-2.0
//
// The verbs of core/verbs.hpp on OpenMP, and the arrays of one build.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <memory>
#include <memory_resource>
#include <string>
#include <utility>

#include <zkd/build.hpp>
#include <zkd/cpu/executor.hpp>
#include <zkd/error.hpp>
#include <zkd/statistics.hpp>
#include <zkd/tree.hpp>

#include "core/check_input.hpp"
#include "core/host_block.hpp"
#include "core/pipeline.hpp"
#include "cpu/float_environment.hpp"
#include "cpu/radix_sort.hpp"
#include "cpu/threads.hpp"

namespace zkd::cpu {

/// A copy of its own for each range, ready to be called: its members then stay in registers, which
/// writes through pointers cannot reach.
template <class Functor>
Functor loaded(Functor f) {
  if constexpr (core::Loads<Functor>) f.load();
  return f;
}

class Backend {
 public:
  explicit Backend(const Executor& executor)
      : threads_(executor),
        memory_(executor.memory != nullptr ? executor.memory : std::pmr::get_default_resource()) {
    check_executor(executor);
  }

  // --- passes ---

  template <class Functor>
  void for_each(core::Count count, Functor f) {
    threads_.share(size(count), grain, [f](Range range) {
      Functor g = loaded(f);
      for (std::uint32_t i = range.begin; i < range.end; ++i) g(i);
    });
  }

  template <class T, class Functor>
  void reduce(core::Count count, T* out, Functor f) {
    const std::uint32_t n = size(count);
    const int team = threads_.team(n);
    Scratch<T> parts(*this, static_cast<std::size_t>(team));
    threads_.divide(n, team, [f, parts = parts.data](Range range, int thread) {
      Functor g = loaded(f);
      T mine{};
      for (std::uint32_t i = range.begin; i < range.end; ++i) g(i, mine);
      parts[thread] = mine;
    });
    *out = T{};
    for (int thread = 0; thread < team; ++thread) out->combine(parts.data[thread]);
  }

  /// Every thread writes what it selects to the place where all of its part would go; then the
  /// parts are closed up.
  template <class Functor>
  void select(core::Count count, Functor f, std::uint32_t* out, std::uint32_t* total) {
    const std::uint32_t n = size(count);
    const int team = threads_.team(n);
    Scratch<std::uint32_t> selected(*this, static_cast<std::size_t>(team));
    threads_.divide(n, team, [f, out, selected = selected.data](Range range, int thread) {
      Functor g = loaded(f);
      std::uint32_t* to = out + range.begin;
      for (std::uint32_t i = range.begin; i < range.end; ++i) {
        *to = i;  // kept only if the place is not taken again; without a branch
        to += g(i) ? 1 : 0;
      }
      selected[thread] = static_cast<std::uint32_t>(to - (out + range.begin));
    });
    std::uint32_t end = 0;
    for (int thread = 0; thread < team; ++thread) {
      const std::uint32_t begin = Threads::part(n, thread, team).begin;
      if (begin != end) std::memmove(out + end, out + begin, selected.data[thread] * sizeof *out);
      end += selected.data[thread];
    }
    *total = end;
  }

  template <class Functor, class Total>
  void exclusive_scan(core::Count count, Functor f, std::uint32_t* out, Total* total) {
    const std::uint32_t n = size(count);
    const int team = threads_.team(n);
    Scratch<std::uint64_t> sums(*this, static_cast<std::size_t>(team));
    threads_.divide(n, team, [f, out, sums = sums.data](Range range, int thread) {
      Functor g = loaded(f);
      std::uint64_t sum = 0;
      for (std::uint32_t i = range.begin; i < range.end; ++i) {
        const std::uint32_t value = g(i);
        out[i] = static_cast<std::uint32_t>(sum);
        sum += value;
      }
      sums[thread] = sum;
    });
    std::uint64_t before = 0;
    for (int thread = 0; thread < team; ++thread)
      before += std::exchange(sums.data[thread], before);
    *total = static_cast<Total>(before);
    if (team > 1)
      threads_.divide(n, team, [out, sums = sums.data](Range range, int thread) {
        const auto add = static_cast<std::uint32_t>(sums[thread]);
        for (std::uint32_t i = range.begin; i < range.end; ++i) out[i] += add;
      });
  }

  /// Every thread first sums what the sum at its last element depends on, for those after it.
  template <class T, class Functor>
  void scan(core::Count count, Functor f) {
    const std::uint32_t n = size(count);
    const int team = threads_.team(n);
    Scratch<T> sums(*this, static_cast<std::size_t>(team));
    if (team > 1)
      threads_.divide(n, team, [f, sums = sums.data](Range range, int thread) {
        Functor g = loaded(f);
        T sum{};
        for (std::uint32_t i = std::max(range.begin, g.segment_begin(range.end - 1)); i < range.end;
             ++i)
          g(i, sum);
        sums[thread] = sum;
      });
    T before{};
    for (int thread = 0; thread < team; ++thread) {
      const T sum = before;
      if (team > 1) before.combine(sums.data[thread]);
      sums.data[thread] = sum;
    }
    threads_.divide(n, team, [f, sums = sums.data](Range range, int thread) {
      Functor g = loaded(f);
      T sum = sums[thread];
      for (std::uint32_t i = range.begin; i < range.end; ++i) {
        g(i, sum);
        g.take(i, sum);
      }
    });
  }

  /// Elements are divided evenly, whatever the segments: a thread that begins inside one leaves
  /// what it found there for the thread where the segment begins.
  template <class T, class Functor>
  void segmented_reduce(core::Count segment_count, const std::uint32_t* offsets,
                        core::Count element_count, T* out, Functor f) {
    const std::uint32_t segments = size(segment_count);
    const std::uint32_t elements = size(element_count);
    const int team = threads_.team(elements);
    struct Head {
      T value{};
      std::uint32_t segment = 0;
    };
    Scratch<Head> heads(*this, static_cast<std::size_t>(team));
    threads_.divide(elements, team, [=, heads = heads.data](Range range, int thread) {
      Functor g = loaded(f);
      Head head;
      if (range.begin < range.end) {
        const auto* const after = std::upper_bound(offsets, offsets + segments, range.begin);
        auto segment = static_cast<std::uint32_t>(after - offsets) - 1;
        head.segment = segment;
        std::uint32_t i = range.begin;
        while (i < range.end) {
          const std::uint32_t segment_end =
              segment + 1 < segments ? offsets[segment + 1] : elements;
          const bool begins_here = offsets[segment] >= range.begin;
          T value{};
          for (; i < std::min(segment_end, range.end); ++i) g(segment, i, value);
          if (begins_here)
            out[segment] = value;
          else
            head.value = value;
          ++segment;
        }
      }
      heads[thread] = head;
    });
    for (int thread = 1; thread < team; ++thread)
      out[heads.data[thread].segment].combine(heads.data[thread].value);
  }

  template <class Key>
  core::SortBuffers<Key> radix_sort(core::SortBuffers<Key> buffers, core::Count count,
                                    std::uint32_t bits) {
    const std::uint32_t n = size(count);
    SortScratch scratch{};
    const int team = threads_.team(n);
    const core::HostBlock block = lay_out(scratch, team, digits_of(bits));
    return RadixSort<Key>(threads_, scratch, buffers, n, bits).run(passes_left_out_);
  }

  template <class Functor>
  void climb(core::Count leaves, std::uint32_t* arrivals, Functor f) {
    threads_.share(size(leaves), grain / 4, [f, arrivals](Range range) {
      Functor g = loaded(f);
      // Leaves first, some at a time: an atomic operation would hold up the loads of the next leaf.
      constexpr std::uint32_t at_a_time = 64;
      core::Parent parents[at_a_time];
      for (std::uint32_t leaf = range.begin; leaf < range.end;) {
        const std::uint32_t batch = std::min(at_a_time, range.end - leaf);
        for (std::uint32_t i = 0; i < batch; ++i) g.prefetch(leaf + i);
        for (std::uint32_t i = 0; i < batch; ++i) parents[i] = g.begin(leaf + i);
        for (std::uint32_t i = 0; i < batch; ++i) {
          core::Parent parent = parents[i];
          // Two leaves of one node need not be told to wait for each other.
          if (i + 1 < batch && !parent.is_none() && parents[i + 1].node() == parent.node()) {
            parent = g.rise(parent.node());
            ++i;
          }
          climb_from(parent, arrivals, g);
        }
        leaf += batch;
      }
    });
  }

  // --- what the host knows: here, everything ---

  [[nodiscard]] static std::uint32_t size(core::Count count) {
    return count.actual != nullptr ? *count.actual : count.bound;
  }
  [[nodiscard]] static bool may_exist(core::Count count) { return size(count) != 0; }

  static void raise(const core::BuildStatus* status, const TriangleView& triangles) {
    core::raise(*status, triangles);
  }
  [[nodiscard]] static std::uint64_t reference_capacity() { return max_count; }

  // --- memory ---

  /// Lays out arrays that live until the build ends.
  template <class Layout, class... Counts>
  void take(Layout& layout, Counts... counts) {
    assert(blocks_used_ < max_blocks);
    blocks_[blocks_used_++] = lay_out(layout, counts...);
  }

  /// A block that is counted as long as it lives.
  class Held {
   public:
    Held() = default;
    Held(Backend& backend, std::size_t bytes) : backend_(&backend), block_(backend.memory_, bytes) {
      backend.held_ += bytes;
      backend.count_held();
    }
    Held(Held&& other) noexcept
        : backend_(std::exchange(other.backend_, nullptr)), block_(std::move(other.block_)) {}
    Held& operator=(Held&& other) noexcept {
      std::swap(backend_, other.backend_);
      std::swap(block_, other.block_);
      return *this;
    }
    ~Held() {
      if (backend_ != nullptr) backend_->held_ -= block_.bytes();
    }
    [[nodiscard]] void* data() const noexcept { return block_.data(); }
    [[nodiscard]] std::size_t bytes() const noexcept { return block_.bytes(); }

   private:
    Backend* backend_ = nullptr;
    core::HostBlock block_;
  };
  Held hold(std::size_t bytes) { return Held(*this, bytes); }

  /// A copy until the build ends.
  template <class T>
  T* keep(const T& value) {
    struct Room {
      T* place;
      void lay_out(core::Arena& arena) { place = arena.take<T>(1); }
    } room{};
    take(room);
    return std::construct_at(room.place, value);
  }
  template <class T>
  [[nodiscard]] static T read(const T* value) {
    return *value;
  }

  /// See zkd::memory_requirement.
  static MemoryRequirement requirement(const Executor& executor, std::uint64_t triangle_count,
                                       const BuildOptions& options, bool wide_codes,
                                       std::uint64_t reference_count) {
    const auto triangles = static_cast<std::uint32_t>(triangle_count);
    MemoryRequirement most;
    most.workspace_bytes = wide_codes ? core::bytes_of(core::Workspace<std::uint64_t>{}, triangles)
                                      : core::bytes_of(core::Workspace<std::uint32_t>{}, triangles);
    if (options.recode_crowded) {
      const std::uint32_t crowded = core::most_crowded_trunks(triangles, options.leaf_size);
      most.workspace_bytes +=
          core::bytes_of(core::RecodeWorkspace{}, triangles, crowded, crowded > 0 ? triangles : 0);
    }
    if (options.references == References::all)
      most.workspace_bytes += core::bytes_of(core::NotesWorkspace{}, triangles) +
                              core::bytes_of(core::ReferenceWorkspace{}, reference_count);
    // Of what single verbs take for themselves, a sort by 64 bits takes most.
    const int team = Threads(executor).team(std::max<std::uint64_t>(triangles, reference_count));
    most.workspace_bytes += core::bytes_of(SortScratch{}, team, digits_of(64));
    most.tree_bytes =
        core::bytes_of(core::TreeArrays{}, triangles) + reference_count * sizeof(std::uint32_t);
    return most;
  }

  void allocate_tree(core::Count trunks) {
    core::TreeArrays arrays{};
    tree_block_ = core::HostBlock(memory_, core::bytes_of(arrays, size(trunks)));
    core::Arena arena(tree_block_.data());
    arrays.lay_out(arena, size(trunks));
    arrays_ = arrays;
  }
  void allocate_references(core::Count references) {
    reference_block_ =
        core::HostBlock(memory_, std::size_t{size(references)} * sizeof(std::uint32_t));
    references_ = static_cast<std::uint32_t*>(reference_block_.data());
  }

  void allocate_tree_exactly(std::uint32_t leaves, std::uint32_t references) {
    allocate_tree(core::Count{nullptr, leaves});
    allocate_references(core::Count{nullptr, references});
  }

  [[nodiscard]] TreeHeader* header() const { return arrays_.header; }
  [[nodiscard]] Node* nodes() const { return arrays_.nodes; }
  [[nodiscard]] std::uint32_t* leaf_offsets() const { return arrays_.leaf_offsets; }
  [[nodiscard]] std::uint32_t* references() const { return references_; }

  // --- clocks and counts ---

  void stage(Stage next) {
    const auto now = std::chrono::steady_clock::now();
    if (running_ != Stage::count)
      stage_ms_[static_cast<std::size_t>(running_)] +=
          std::chrono::duration<double, std::milli>(now - since_).count();
    running_ = next;
    since_ = now;
  }
  /// Ends the last stage.
  void finish() { stage(Stage::count); }

  [[nodiscard]] const auto& stage_ms() const { return stage_ms_; }
  [[nodiscard]] std::uint32_t passes_left_out() const { return passes_left_out_; }
  [[nodiscard]] std::size_t workspace_bytes() const { return most_held_; }
  [[nodiscard]] std::pmr::memory_resource* memory() const { return memory_; }
  core::HostBlock& tree_block() { return tree_block_; }
  core::HostBlock& reference_block() { return reference_block_; }

 private:
  /// Working memory of the backend itself, for the time of one verb.
  template <class T>
  struct Scratch {
    T* data;
    core::HostBlock block;

    struct Layout {
      T* array;
      void lay_out(core::Arena& arena, std::size_t count) { array = arena.take<T>(count); }
    };
    Scratch(Backend& backend, std::size_t count) {
      Layout layout{};
      block = backend.lay_out(layout, count);
      data = layout.array;
    }
  };

  template <class Layout, class... Counts>
  core::HostBlock lay_out(Layout& layout, Counts... counts) {
    core::HostBlock block(memory_, core::bytes_of(layout, counts...));
    core::Arena arena(block.data());
    layout.lay_out(arena, counts...);
    count_held(block.bytes());
    return block;
  }
  void count_held(std::size_t more = 0) {
    std::size_t held = held_ + more;
    for (int i = 0; i < blocks_used_; ++i) held += blocks_[i].bytes();
    most_held_ = std::max(most_held_, held);
  }

  /// Goes up from a finished child until it is the first to arrive.
  template <class Functor>
  static void climb_from(core::Parent parent, std::uint32_t* arrivals, Functor& f) {
    while (!parent.is_none()) {
      // Releases this child's box to whoever goes on, and acquires the sibling's if that is us.
      const std::atomic_ref<std::uint32_t> arrived(arrivals[parent.node()]);
      if (arrived.fetch_add(1, std::memory_order_acq_rel) == 0) return;
      parent = f.rise(parent.node());
    }
  }

  static constexpr int max_blocks = 16;  // a build takes three at most, a stage fourteen

  FloatEnvironment environment_;  // for the serial steps between passes
  Threads threads_;
  std::pmr::memory_resource* memory_;
  core::HostBlock blocks_[max_blocks];
  int blocks_used_ = 0;
  std::size_t held_ = 0;  // in blocks of others
  std::size_t most_held_ = 0;
  core::HostBlock tree_block_;
  core::HostBlock reference_block_;
  core::TreeArrays arrays_{};
  std::uint32_t* references_ = nullptr;

  Stage running_ = Stage::count;
  std::chrono::steady_clock::time_point since_;
  std::array<double, static_cast<std::size_t>(Stage::count)> stage_ms_{};
  std::uint32_t passes_left_out_ = 0;
};

}  // namespace zkd::cpu
