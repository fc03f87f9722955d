// SPDX-License-Identifier: Apache-2.0
//
// Stage 5, crowded trunks: where more triangles share one code than a leaf should hold, they are
// coded again on a lattice over their own centres. A second round of the same stages (box, lattice,
// encoding, sort), for all crowded trunks at once and for their triangles alone.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>

#include "core/arena.hpp"
#include "core/frame.hpp"
#include "core/key.hpp"
#include "core/lattice.hpp"
#include "core/morton.hpp"
#include "core/search.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// Bits of a second-round code.
inline constexpr std::uint32_t fine_bits = 32;

/// Whether a crowded trunk begins with the i-th sorted triangle.
template <class Code>
struct BeginsCrowdedTrunk {
  const Code* codes;
  const std::uint32_t* code_count;
  std::uint32_t leaf_size;
  std::uint32_t count = 0;

  ZKD_HOST_DEVICE void load() { count = *code_count; }

  ZKD_HOST_DEVICE bool operator()(std::uint32_t i) const {
    if (i >= count - smaller(count, leaf_size) || codes[i] != codes[i + leaf_size]) return false;
    return i == 0 || codes[i - 1] != codes[i];
  }
};

/// Triangles in the c-th crowded trunk: codes are sorted, so gallop to its end.
template <class Code>
struct CrowdedTrunkLength {
  const Code* codes;
  const std::uint32_t* code_count;
  const std::uint32_t* first;
  std::uint32_t count = 0;

  ZKD_HOST_DEVICE void load() { count = *code_count; }

  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t c) const {
    const std::uint32_t begin = first[c];
    return 1 + run_length(count - 1 - begin, 4,
                          [&](std::uint32_t n) { return codes[begin + n] == codes[begin]; });
  }
};

/// The triangles of crowded trunks, numbered without the others, trunk by trunk: those of trunk c
/// from offsets[c] on.
struct CrowdedTriangles {
  const std::uint32_t* first;    ///< position of each crowded trunk
  const std::uint32_t* offsets;  ///< number of its first triangle
  const std::uint32_t* trunks;   ///< how many crowded trunks

  struct Place {
    std::uint32_t trunk;
    std::uint32_t position;
  };
  [[nodiscard]] ZKD_HOST_DEVICE Place operator[](std::uint32_t k) const {
    const std::uint32_t trunk = last_at_or_before(offsets, *trunks, k);
    return {trunk, position(trunk, k)};
  }

  /// Whether number k is in this trunk.
  [[nodiscard]] ZKD_HOST_DEVICE bool holds(std::uint32_t trunk, std::uint32_t k) const {
    return offsets[trunk] <= k && (trunk + 1 == *trunks || k < offsets[trunk + 1]);
  }

  /// Sorted position of number k, which is in this trunk.
  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t position(std::uint32_t trunk, std::uint32_t k) const {
    return first[trunk] + (k - offsets[trunk]);
  }
};

/// Adds the centre of triangle k of the crowded ones to the box of its crowded trunk.
struct IncludeCentre {
  const Box* boxes;
  const std::uint32_t* ids;
  const std::uint32_t* first;
  const std::uint32_t* offsets;

  ZKD_HOST_DEVICE void operator()(std::uint32_t trunk, std::uint32_t k, WideBox& box) const {
    const Box& triangle = boxes[ids[first[trunk] + (k - offsets[trunk])]];
    box.include({centre(triangle, 0), centre(triangle, 1), centre(triangle, 2)});
  }
};

/// The c-th crowded trunk: a lattice over its centres.
template <class Code>
struct CrowdedLattice {
  const WideBox* centres;
  const Code* codes;
  const std::uint32_t* first;
  const std::uint8_t* most_bits;  ///< by code; null: fine_bits
  AxisOrder order;
  const SceneFrame* frame;
  Lattice* lattices;
  MortonCoder* coders;

  ZKD_HOST_DEVICE void operator()(std::uint32_t c) const {
    const std::uint32_t bits = most_bits != nullptr ? most_bits[codes[first[c]]] : fine_bits;
    lattices[c] = make_lattice(centres[c], bits, order, frame->finest);
    coders[c] = MortonCoder(lattices[c]);
  }
};

/// Triangle k of the crowded ones: its trunk and second-round code as one number to sort by.
struct RecodeTriangle {
  const Box* boxes;
  const std::uint32_t* ids;
  CrowdedTriangles crowded;
  const Lattice* lattices;
  const MortonCoder* coders;
  std::uint64_t* fine_keys;
  std::uint32_t* fine_ids;
  std::uint32_t last_trunk = 0;  // of the triangle before: most follow in the same

  ZKD_HOST_DEVICE void operator()(std::uint32_t k) {
    const CrowdedTriangles::Place place =
        crowded.holds(last_trunk, k)
            ? CrowdedTriangles::Place{last_trunk, crowded.position(last_trunk, k)}
            : crowded[k];
    last_trunk = place.trunk;
    const std::uint32_t id = ids[place.position];
    const Box& box = boxes[id];
    const double point[3] = {centre(box, 0), centre(box, 1), centre(box, 2)};
    const std::uint64_t code = coders[place.trunk].encode<std::uint32_t>(point);
    fine_keys[k] = (static_cast<std::uint64_t>(place.trunk) << 32) |
                   (code << (fine_bits - lattices[place.trunk].code_bits));
    fine_ids[k] = id;
  }
};

/// Puts triangle k of the crowded ones, sorted, back among the others.
struct PlaceRecoded {
  CrowdedTriangles crowded;
  const std::uint64_t* fine_keys;
  const std::uint32_t* fine_ids;
  std::uint32_t* ids;
  std::uint32_t* fine;

  ZKD_HOST_DEVICE void operator()(std::uint32_t k) const {
    // Trunks are the keys' upper halves, and keep their numbers of triangles through the sort.
    const auto trunk = static_cast<std::uint32_t>(fine_keys[k] >> 32);
    const std::uint32_t position = crowded.position(trunk, k);
    ids[position] = fine_ids[k];
    fine[position] = static_cast<std::uint32_t>(fine_keys[k]);
  }
};

/// The number of its crowded trunk, for every position of the sorted order that has one: for those
/// who call the stage by itself.
struct NumberCrowd {
  CrowdedTriangles crowded;
  std::uint32_t* crowd;

  ZKD_HOST_DEVICE void operator()(std::uint32_t k) const {
    const CrowdedTriangles::Place place = crowded[k];
    crowd[place.position] = place.trunk;
  }
};

/// Memory of the second round; taken only where a trunk may be crowded.
struct RecodeWorkspace {
  std::uint32_t* first = nullptr;
  std::uint32_t* offsets = nullptr;
  WideBox* centres = nullptr;
  Lattice* lattices = nullptr;
  MortonCoder* coders = nullptr;
  SortBuffers<std::uint64_t> sort{};
  std::uint32_t* fine = nullptr;

  void lay_out(Arena& arena, std::size_t triangles, std::size_t trunks, std::size_t crowded) {
    first = arena.take<std::uint32_t>(trunks);
    offsets = arena.take<std::uint32_t>(trunks);
    centres = arena.take<WideBox>(trunks);
    lattices = arena.take<Lattice>(trunks);
    coders = arena.take<MortonCoder>(trunks);
    sort = {arena.take<std::uint64_t>(crowded), arena.take<std::uint32_t>(crowded),
            arena.take<std::uint64_t>(crowded), arena.take<std::uint32_t>(crowded)};
    fine = arena.take<std::uint32_t>(triangles);
  }
};

/// The crowded trunks, found and counted, and where the second round has its results.
template <class Code>
struct CrowdedTrunks {
  const Box* boxes;
  const Code* codes;
  std::uint32_t* ids;
  const std::uint8_t* most_bits;  ///< by code; null: fine_bits
  AxisOrder order;
  const SceneFrame* frame;
  RecodeWorkspace work;

  /// Of a second-round code in the c-th.
  [[nodiscard]] std::uint32_t bits(std::uint32_t c) const {
    return most_bits != nullptr ? most_bits[codes[work.first[c]]] : fine_bits;
  }
};

/// A backend that goes through them trunk by trunk, to the same bytes.
template <class Backend>
concept RecodesByTrunk = requires(Backend& backend, const CrowdedTrunks<std::uint32_t>& trunks,
                                  Count count) {
  backend.recode(trunks, count, count);
};

/// The most crowded trunks that `triangles` can make.
inline std::uint32_t most_crowded_trunks(std::uint32_t triangles, std::uint32_t leaf_size) {
  return triangles / (leaf_size + 1);
}

/// The second round, start to end.
template <class Code, class Backend>
class SecondRound {
 public:
  const Box* boxes;
  const Code* codes;   ///< sorted
  std::uint32_t* ids;  ///< of the triangles, in that order; permuted within crowded trunks
  Count triangles;
  std::uint32_t leaf_size;
  AxisOrder order;
  const SceneFrame* frame;
  std::uint32_t* trunk_count;               ///< out: crowded trunks
  std::uint32_t* triangle_count;            ///< out: triangles in them
  std::uint32_t* first_scratch;             ///< room for one number per triangle
  std::uint32_t* offsets_scratch;           ///< likewise
  const std::uint8_t* most_bits = nullptr;  ///< of codes again, by code; null: fine_bits

  RecodeWorkspace work{};

  [[nodiscard]] CrowdedTriangles members() const { return {work.first, work.offsets, trunk_count}; }

  /// Leaves `work` empty where no trunk can be crowded.
  void run(Backend& backend) {
    // load() reads counts through a pointer: to the bound itself where that is exact.
    const std::uint32_t* count = triangles.actual != nullptr ? triangles.actual : &triangles.bound;
    backend.select(triangles, BeginsCrowdedTrunk<Code>{codes, count, leaf_size}, first_scratch,
                   trunk_count);
    const Count trunks{trunk_count, most_crowded_trunks(triangles.bound, leaf_size)};
    if (!backend.may_exist(trunks)) return;

    backend.exclusive_scan(trunks, CrowdedTrunkLength<Code>{codes, count, first_scratch},
                           offsets_scratch, triangle_count);
    const Count crowded{triangle_count, triangles.bound};
    backend.take(work, triangles.bound, backend.size(trunks), backend.size(crowded));
    backend.for_each(trunks, CopyTo<std::uint32_t>{first_scratch, work.first});
    backend.for_each(trunks, CopyTo<std::uint32_t>{offsets_scratch, work.offsets});

    backend.for_each(triangles, Fill{work.fine, 0});
    if constexpr (RecodesByTrunk<Backend>)
      backend.recode(CrowdedTrunks<Code>{boxes, codes, ids, most_bits, order, frame, work}, trunks,
                     crowded);
    else
      run_in_passes(backend, trunks, crowded);
  }

 private:
  void run_in_passes(Backend& backend, Count trunks, Count crowded) {
    backend.segmented_reduce(trunks, work.offsets, crowded, work.centres,
                             IncludeCentre{boxes, ids, work.first, work.offsets});
    backend.for_each(trunks, CrowdedLattice<Code>{work.centres, codes, work.first, most_bits, order,
                                                  frame, work.lattices, work.coders});
    backend.for_each(crowded, RecodeTriangle{boxes, ids, members(), work.lattices, work.coders,
                                             work.sort.keys, work.sort.values});
    work.sort =
        backend.radix_sort(work.sort, crowded, fine_bits + bits_to_count(backend.size(trunks)));
    backend.for_each(crowded,
                     PlaceRecoded{members(), work.sort.keys, work.sort.values, ids, work.fine});
  }
};

}  // namespace zkd::core
