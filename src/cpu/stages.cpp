// SPDX-License-Identifier: Apache-2.0
//
// Single stages on the CPU: the same functors and verbs as build(), over the caller's spans.
#include <zkd/stages.hpp>

#include <algorithm>
#include <string>

#include "core/check_input.hpp"
#include "core/pipeline.hpp"
#include "cpu/backend.hpp"
#include "cpu/stage_input.hpp"

namespace zkd::stages {
namespace {

void check_leaf_size(std::uint32_t leaf_size) {
  BuildOptions options;
  options.leaf_size = leaf_size;
  core::check_options(options);
}

template <class Code>
void encode(const cpu::Executor& executor, std::span<const Box> boxes, const Lattice& lattice,
            std::span<Code> codes, std::span<std::uint32_t> ids) {
  check_length(ids.size(), codes.size(), "ids");
  if (lattice.code_bits > 8 * sizeof(Code))
    throw Error(ErrorCode::invalid_option, lattice.code_bits,
                "codes of " + std::to_string(lattice.code_bits) + " bits do not fit into " +
                    std::to_string(8 * sizeof(Code)));
  cpu::Backend backend(executor);
  struct Room {
    std::uint32_t* ids;
    void lay_out(core::Arena& arena, std::size_t n) { ids = arena.take<std::uint32_t>(n); }
  } room{};
  backend.take(room, boxes.size());
  std::uint32_t listed = 0;
  backend.select(exactly(boxes.size()), core::IsListed{boxes.data()}, room.ids, &listed);
  check_length(codes.size(), listed, "codes");
  const core::MortonCoder coder(lattice);
  backend.for_each(exactly(listed), core::CopyTo<std::uint32_t>{room.ids, ids.data()});
  backend.for_each(exactly(listed),
                   core::EncodeTriangle<Code>{boxes.data(), ids.data(), &coder, codes.data()});
}

template <class Code>
std::uint32_t sort(const cpu::Executor& executor, std::span<Code> codes,
                   std::span<std::uint32_t> values, std::uint32_t bits) {
  check_length(values.size(), codes.size(), "values");
  if (bits > 8 * sizeof(Code))
    throw Error(ErrorCode::invalid_option, bits,
                std::to_string(bits) + " bits to sort by, but a code has " +
                    std::to_string(8 * sizeof(Code)));
  const Count count = exactly(codes.size());
  cpu::Backend backend(executor);
  struct Room {
    Code* codes;
    std::uint32_t* values;
    void lay_out(core::Arena& arena, std::size_t n) {
      codes = arena.take<Code>(n);
      values = arena.take<std::uint32_t>(n);
    }
  } room{};
  backend.take(room, codes.size());
  const core::SortBuffers<Code> sorted = backend.radix_sort(
      core::SortBuffers<Code>{codes.data(), values.data(), room.codes, room.values}, count, bits);
  if (sorted.keys != codes.data()) {
    backend.for_each(count, core::CopyTo<Code>{sorted.keys, codes.data()});
    backend.for_each(count, core::CopyTo<std::uint32_t>{sorted.values, values.data()});
  }
  return backend.passes_left_out();
}

/// Keys that are already made, in the place of core::SortedKeys.
struct GivenKeys {
  const TrunkKey* keys;
  void load() {}
  const TrunkKey& operator[](std::uint32_t i) const { return keys[i]; }
};

}  // namespace

SceneSummary triangle_boxes(const cpu::Executor& executor, const TriangleView& triangles,
                            InvalidTriangles invalid, std::span<Box> boxes) {
  core::check_view(triangles);
  check_length(boxes.size(), triangles.triangle_count, "boxes");
  cpu::Backend backend(executor);
  core::ValidationReport report;
  backend.reduce(exactly(boxes.size()), &report, core::ValidateTriangle{triangles, boxes.data()});
  core::BuildCounts counts;
  core::judge(report, triangles, invalid, counts);
  core::raise(counts.status, triangles);
  return {report.bounds, report.valid, report.zero_area, report.non_finite};
}

Lattice make_lattice(const Box& bounds, std::uint32_t code_bits, AxisOrder order) {
  if (code_bits < 1 || code_bits > 64)
    throw Error(ErrorCode::invalid_option, code_bits,
                "code_bits is " + std::to_string(code_bits) + "; it must be 1 to 64");
  const cpu::FloatEnvironment environment;
  for (int a = 0; a < 3; ++a)
    if (!bounds.empty() && !(core::is_finite(bounds.lo[a]) && core::is_finite(bounds.hi[a])))
      throw Error(ErrorCode::invalid_view, static_cast<std::uint64_t>(a),
                  "bounds are not finite along axis " + std::to_string(a));
  return core::make_lattice(core::widen(bounds), code_bits, order, core::SceneFrame(bounds).finest);
}

void morton_encode(const cpu::Executor& executor, std::span<const Box> boxes,
                   const Lattice& lattice, std::span<std::uint32_t> codes,
                   std::span<std::uint32_t> ids) {
  encode(executor, boxes, lattice, codes, ids);
}

void morton_encode(const cpu::Executor& executor, std::span<const Box> boxes,
                   const Lattice& lattice, std::span<std::uint64_t> codes,
                   std::span<std::uint32_t> ids) {
  encode(executor, boxes, lattice, codes, ids);
}

std::uint32_t radix_sort(const cpu::Executor& executor, std::span<std::uint32_t> codes,
                         std::span<std::uint32_t> values, std::uint32_t bits) {
  return sort(executor, codes, values, bits);
}

std::uint32_t radix_sort(const cpu::Executor& executor, std::span<std::uint64_t> codes,
                         std::span<std::uint32_t> values, std::uint32_t bits) {
  return sort(executor, codes, values, bits);
}

std::uint32_t recode_crowded(const cpu::Executor& executor, std::span<const Box> boxes,
                             const Lattice& lattice, std::span<const std::uint64_t> codes,
                             std::span<std::uint32_t> ids, std::uint32_t leaf_size, AxisOrder order,
                             bool enabled, std::span<TrunkKey> keys, std::span<std::uint32_t> crowd,
                             std::span<Lattice> lattices) {
  check_leaf_size(leaf_size);
  check_length(ids.size(), codes.size(), "ids");
  check_length(keys.size(), codes.size(), "keys");
  check_length(crowd.size(), codes.size(), "crowd");
  const Count count = exactly(codes.size());
  cpu::Backend backend(executor);
  struct Room {
    std::uint32_t* first;
    std::uint32_t* offsets;
    void lay_out(core::Arena& arena, std::size_t n) {
      first = arena.take<std::uint32_t>(n);
      offsets = arena.take<std::uint32_t>(n + 1);
    }
  } room{};
  backend.take(room, codes.size());
  std::uint32_t trunks = 0;
  std::uint32_t crowded = 0;
  check_each(backend, count, "ids", [=](std::uint32_t i) { return ids[i] >= boxes.size(); });
  core::ValidationReport scene;
  backend.reduce(exactly(boxes.size()), &scene, core::IncludeBox{boxes.data()});
  const core::SceneFrame frame(scene.bounds);
  core::SecondRound<std::uint64_t, cpu::Backend> round{
      boxes.data(), codes.data(), ids.data(), count,      leaf_size,   order,
      &frame,       &trunks,      &crowded,   room.first, room.offsets};
  if (enabled) round.run(backend);

  backend.for_each(count, core::Fill{crowd.data(), no_crowd});
  backend.for_each(Count{nullptr, crowded}, core::NumberCrowd{round.members(), crowd.data()});
  core::SortedKeys<std::uint64_t> sorted{codes.data(), round.work.fine, &lattice.code_bits};
  backend.for_each(count, core::WriteKey<std::uint64_t>{sorted, keys.data()});
  const std::size_t fit = std::min<std::size_t>(trunks, lattices.size());
  std::copy_n(round.work.lattices, fit, lattices.begin());
  return trunks;
}

std::uint32_t find_trunks(const cpu::Executor& executor, std::span<const TrunkKey> keys,
                          std::uint32_t leaf_size, std::span<std::uint32_t> first) {
  check_leaf_size(leaf_size);
  check_length(first.size(), keys.size(), "first");
  const Count count = exactly(keys.size());
  cpu::Backend backend(executor);
  std::uint32_t trunks = 0;
  backend.select(count,
                 core::BeginsTrunk<GivenKeys>{GivenKeys{keys.data()}, &count.bound, leaf_size},
                 first.data(), &trunks);
  return trunks;
}

void essential_nodes(const cpu::Executor& executor, std::span<const TrunkKey> trunk_keys,
                     std::span<std::uint8_t> levels) {
  check_length(levels.size(), std::max<std::size_t>(trunk_keys.size(), 1) - 1, "levels");
  cpu::Backend(executor).for_each(exactly(levels.size()),
                                  core::EssentialLevel{trunk_keys.data(), levels.data()});
}

Link path_compression(const cpu::Executor& executor, std::span<const TrunkKey> trunk_keys,
                      std::span<const std::uint8_t> levels, std::span<Link> children) {
  check_length(levels.size(), std::max<std::size_t>(trunk_keys.size(), 1) - 1, "levels");
  check_length(children.size(), 2 * levels.size(), "children");
  const Count trunks = exactly(trunk_keys.size());
  cpu::Backend backend(executor);
  Link root;
  const core::LinkWriter writer{children.data(), 2, nullptr, nullptr, &root, &trunks.bound};
  backend.for_each(trunks, core::LinkTrunk{levels.data(), writer});
  backend.for_each(exactly(levels.size()),
                   core::LinkEssentialNode{trunk_keys.data(), levels.data(), writer});
  return root;
}

void split_planes(const cpu::Executor& executor, std::span<const TrunkKey> trunk_keys,
                  std::span<const std::uint8_t> levels, std::span<const std::uint32_t> crowd,
                  const Lattice& lattice, std::span<const Lattice> lattices,
                  std::span<std::uint32_t> axes, std::span<float> planes) {
  check_length(levels.size(), std::max<std::size_t>(trunk_keys.size(), 1) - 1, "levels");
  check_length(crowd.size(), trunk_keys.size(), "crowd");
  check_length(axes.size(), levels.size(), "axes");
  check_length(planes.size(), levels.size(), "planes");
  cpu::Backend backend(executor);
  check_each(backend, exactly(levels.size()), "crowd", [=](std::uint32_t node) {
    return levels[node] >= first_fine_level && crowd[node + 1] >= lattices.size();
  });
  const core::MortonCoder coder(lattice);
  const double unscaled = 1.0;
  backend.for_each(exactly(levels.size()),
                   core::PlaceSplitPlane<core::CrowdByTrunk>{trunk_keys.data(),
                                                             levels.data(),
                                                             &lattice,
                                                             &coder,
                                                             {crowd.data(), lattices.data()},
                                                             &unscaled,
                                                             {axes.data(), planes.data(), 1}});
}

}  // namespace zkd::stages
