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
#include <optional>
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
#include "cpu/second_round.hpp"
#include "cpu/threads.hpp"

namespace zkd::cpu {

/// A copy of its own for each range, ready to be called: its members then stay in registers, which
/// writes through pointers cannot reach.
template <class Functor>
Functor loaded(Functor f) {
  if constexpr (core::Loads<Functor>) f.load();
  return f;
}

/// For a histogram alone.
struct Nothing {
  void combine(const Nothing&) {}
};
template <class Functor>
struct CountOnly {
  Functor f;
  void load() { f = loaded(f); }
  std::uint32_t operator()(std::uint32_t i, Nothing&) { return f(i); }
};

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
    threads_.share(size(count), core::Long<Functor> ? 1 : grain, [f](Range range) {
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

  template <class Functor>
  void histogram(core::Count count, Functor f, std::uint32_t bins, std::uint32_t* out) {
    Nothing nothing;
    reduce_and_count(count, &nothing, CountOnly<Functor>{f}, bins, out);
  }

  template <class T, class Functor>
  void reduce_and_count(core::Count count, T* out, Functor f, std::uint32_t bins,
                        std::uint32_t* counts) {
    const std::uint32_t n = size(count);
    const int team = threads_.team(n);
    Scratch<T> results(*this, static_cast<std::size_t>(team));
    Scratch<std::uint32_t> parts(*this, static_cast<std::size_t>(team) * bins);
    threads_.divide(n, team,
                    [f, bins, results = results.data, parts = parts.data](Range range, int thread) {
                      Functor g = loaded(f);
                      std::uint32_t* mine = parts + static_cast<std::size_t>(thread) * bins;
                      std::fill(mine, mine + bins, 0);
                      T result{};
                      for (std::uint32_t i = range.begin; i < range.end; ++i) {
                        const std::uint32_t bin = g(i, result);
                        if (bin < bins) ++mine[bin];
                      }
                      results[thread] = result;
                    });
    *out = T{};
    for (int thread = 0; thread < team; ++thread) out->combine(results.data[thread]);
    for (std::uint32_t bin = 0; bin < bins; ++bin) {
      counts[bin] = 0;
      for (int thread = 0; thread < team; ++thread)
        counts[bin] += parts.data[static_cast<std::size_t>(thread) * bins + bin];
    }
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
        if constexpr (requires { g.prefetch(i, range.end); }) g.prefetch(i, range.end);
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
    return sort(buffers, size(count), bits, passes_left_out_);
  }

  /// Each thread takes whole trunks. One that is so large that others would wait for it is done by
  /// all threads, in passes.
  template <class Code>
  void recode(const core::CrowdedTrunks<Code>& trunks, core::Count count, core::Count triangles) {
    const std::uint32_t n = size(count);
    const std::uint32_t all = size(triangles);
    const std::uint32_t* const offsets = trunks.work.offsets;
    const auto length = [=](std::uint32_t c) {
      return (c + 1 < n ? offsets[c + 1] : all) - offsets[c];
    };
    constexpr std::uint32_t large = 8 * grain;
    const std::uint32_t most = threads_.available() > 1 ? large : all;
    const core::CrowdedTriangles members{trunks.work.first, offsets, &n};
    for (std::uint32_t c = 0; c < n; ++c)
      if (length(c) > most) recode_large(trunks, members, c, length(c));
    const auto trunks_a_grain = static_cast<std::uint32_t>(grain * n / all + 1);
    threads_.share(n, trunks_a_grain, [=](Range range) {
      const RecodeTrunk<Code> recode{trunks};
      for (std::uint32_t c = range.begin; c < range.end; ++c)
        if (length(c) <= most) recode(c, length(c));
    });
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
    const std::uint32_t triangles =
        core::most_elements(options, static_cast<std::uint32_t>(triangle_count));
    MemoryRequirement most;
    most.workspace_bytes = wide_codes ? core::bytes_of(core::Workspace<std::uint64_t>{}, triangles)
                                      : core::bytes_of(core::Workspace<std::uint32_t>{}, triangles);
    if (options.recode_crowded) {
      const std::uint32_t crowded = core::most_crowded_trunks(triangles, options.leaf_size);
      most.workspace_bytes +=
          core::bytes_of(core::RecodeWorkspace{}, triangles, crowded, crowded > 0 ? triangles : 0);
    }
    if (core::may_split(options))
      most.workspace_bytes += core::bytes_of(core::SplitWorkspace{}, triangle_count, triangles);
    if (options.quality == Quality::balanced)
      most.workspace_bytes +=
          core::bytes_of(core::ClusterRecord{}, 1u) +
          core::bytes_of(core::ClusterWorkspace{}, core::most_clusters(triangles));
    const std::uint64_t leaves = options.references == References::all
                                     ? core::most_reference_trunks(reference_count, triangles)
                                     : triangles;
    if (options.references == References::all) {
      const auto references = static_cast<std::uint32_t>(reference_count);
      const std::uint32_t crowded =
          core::most_crowded_trunks(references, core::crowded_factor * options.leaf_size);
      most.workspace_bytes +=
          core::bytes_of(core::SkeletonWorkspace{}, triangles) +
          core::bytes_of(core::NotesWorkspace{}, triangles, core::remembered_of_triangle) +
          core::bytes_of(core::ReferenceWorkspace{}, references, triangles) +
          core::bytes_of(core::CrowdedLeavesWorkspace{}, references, triangles) +
          core::bytes_of(core::RecodeWorkspace{}, references, crowded, references) +
          core::bytes_of(core::ReferenceTrunkWorkspace{}, references, triangles) +
          core::bytes_of(core::SubtreeWorkspace{}, leaves) +
          core::bytes_of(core::NotesWorkspace{}, references, core::remembered_of_reference) +
          core::bytes_of(core::FoundAgainWorkspace{}, references) +
          core::bytes_of(core::SplitReferenceWorkspace{}, references, leaves);
    }
    // Of what single verbs take for themselves, a sort by 64 bits takes most.
    const int team = Threads(executor).team(std::max<std::uint64_t>(triangles, reference_count));
    most.workspace_bytes += core::bytes_of(SortScratch{}, team, digits_of(64));
    most.tree_bytes =
        core::bytes_of(core::TreeArrays{}, leaves) + reference_count * sizeof(std::uint32_t);
    return most;
  }

  void allocate_tree(core::Count trunks) {
    core::TreeArrays arrays{};
    tree_block_ = core::HostBlock(memory_, core::bytes_of(arrays, size(trunks)));
    note_held();
    core::Arena arena(tree_block_.data());
    arrays.lay_out(arena, size(trunks));
    arrays_ = arrays;
  }
  void allocate_references(core::Count references) {
    reference_block_ =
        core::HostBlock(memory_, std::size_t{size(references)} * sizeof(std::uint32_t));
    references_ = static_cast<std::uint32_t*>(reference_block_.data());
    note_held();
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
    note_held();
  }
  /// Ends the last stage.
  void finish() { stage(Stage::count); }

  [[nodiscard]] const auto& stage_ms() const { return stage_ms_; }
  [[nodiscard]] const auto& stage_bytes() const { return stage_bytes_; }
  [[nodiscard]] std::uint32_t passes_left_out() const { return passes_left_out_.count; }
  /// What these would have taken; nothing where nobody knows.
  [[nodiscard]] std::optional<double> passes_saved_ms() const {
    if (passes_left_out_.count == 0 || !passes_left_out_.all_have_a_time) return std::nullopt;
    return passes_left_out_.saved_ms;
  }
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

  template <class Key>
  core::SortBuffers<Key> sort(core::SortBuffers<Key> buffers, std::uint32_t n, std::uint32_t bits,
                              PassesLeftOut& left_out) {
    SortScratch scratch{};
    const int team = threads_.team(n);
    const core::HostBlock block = lay_out(scratch, team, digits_of(bits));
    return RadixSort<Key>(threads_, scratch, buffers, n, bits).run(left_out);
  }

  /// The passes of core::SecondRound over one trunk.
  template <class Code>
  void recode_large(const core::CrowdedTrunks<Code>& trunks, const core::CrowdedTriangles& members,
                    std::uint32_t c, std::uint32_t n) {
    const core::RecodeWorkspace& work = trunks.work;
    const std::uint32_t offset = work.offsets[c];
    const core::Count count{nullptr, n};
    reduce(count, &work.centres[c],
           [c, offset,
            include = core::IncludeCentre{trunks.boxes, trunks.ids, work.first, work.offsets}](
               std::uint32_t i, core::WideBox& box) { include(c, offset + i, box); });
    core::CrowdedLattice<Code>{work.centres, trunks.codes, work.first,    trunks.most_bits,
                               trunks.order, trunks.frame, work.lattices, work.coders}(c);
    for_each(count, [offset, recode = core::RecodeTriangle{
                                 trunks.boxes, trunks.ids, members, work.lattices, work.coders,
                                 work.sort.keys, work.sort.values, c}](std::uint32_t i) mutable {
      recode(offset + i);
    });
    const core::SortBuffers<std::uint64_t> all = work.sort;
    PassesLeftOut not_counted;
    const core::SortBuffers<std::uint64_t> sorted =
        sort<std::uint64_t>({all.keys + offset, all.values + offset, all.other_keys + offset,
                             all.other_values + offset},
                            n, core::fine_bits, not_counted);
    for_each(count, [offset, place = core::PlaceRecoded{
                                 members, sorted.keys - offset, sorted.values - offset, trunks.ids,
                                 work.fine}](std::uint32_t i) { place(offset + i); });
  }

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
    note_held(more);
  }

  /// What is held now, and `more`, for the stage that runs.
  void note_held(std::size_t more = 0) {
    if (running_ == Stage::count) return;
    std::uint64_t held = tree_block_.bytes() + reference_block_.bytes() + more;
    for (int i = 0; i < blocks_used_; ++i) held += blocks_[i].bytes();
    auto& most = stage_bytes_[static_cast<std::size_t>(running_)];
    most = std::max(most.value_or(0), held);
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

  static constexpr int max_blocks = 32;  // a build takes fifteen at most, a stage twenty-five

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
  std::array<std::optional<std::uint64_t>, static_cast<std::size_t>(Stage::count)> stage_bytes_{};
  PassesLeftOut passes_left_out_;
};

}  // namespace zkd::cpu
