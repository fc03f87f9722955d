// SPDX-License-Identifier: Apache-2.0
//
// What a build may be asked for. Every default has its reason beside it.
#pragma once

#include <cstdint>

#include <zkd/config.hpp>

namespace zkd {

/// Where a build without an executor runs.
enum class Backend {
  automatic,  ///< CUDA where the program links zkd::cuda and a device answers, else the CPU
  cpu,
  cuda,
};

/// In which leaves a triangle is listed.
enum class References {
  once,    ///< in the trunk of its centre only; boxes of siblings may overlap. Fastest to build
  budget,  ///< triangles whose boxes hold much besides them are split on planes of the lattice, the
           ///< most useful first, until BuildOptions::budget is used (Karras, Aila, HPG 2013); each
           ///< part is then listed once, as a triangle of its own would be
  all,     ///< in every leaf cell it touches: a strict kd-tree with disjoint cells. Where large
           ///< triangles lie among small ones, cells are those of the fragments that `budget` would
           ///< list. (Builder::sah and wu2011: in every cell that a piece of it with an area lies
           ///< in; if it lies in a plane, on one side)
  automatic,  ///< `budget` where the boxes of the scene are so uneven that splitting pays, else
              ///< `once`: scans keep one reference each. Tree::options() says which it was
};

/// Which algorithm decides the planes.
enum class Builder {
  morton,  ///< all nodes at once from Morton codes (Li, Wang, Deng, I3D 2014)
  sah,     ///< exact surface-area heuristic (Wald, Havran 2006; see SahOptions). CPU only
  wu2011,  ///< the tree of `sah`, level by level on any backend (Wu, Zhao, Liu, HPG 2011)
};

/// How much time the Morton builder may spend on a better tree.
enum class Quality {
  fast,      ///< one sweep
  balanced,  ///< the upper part of the tree by the surface-area heuristic, over clusters of
             ///< triangles that are near each other in the order of their codes; below, as `fast`
  high,      ///< hands over to Builder::sah, with all that is said there
};

/// What happens to a triangle with a NaN or infinite coordinate. (An index out of range is always
/// an error; a triangle of exactly zero area can never be hit, and is always left out and counted.)
enum class InvalidTriangles {
  error,  ///< ErrorCode::non_finite_vertex, naming the first
  skip,   ///< left out of the tree and counted; ids of the others are kept
};

/// Which boxes the surface-area heuristic takes the areas of.
enum class SahAreas {
  tight,  ///< what a walk here tests: the tight boxes of both children
  cells,  ///< of Wald and Havran: the halves of the cell, whatever is in them
};

/// In which order the bits of the axes enter the Morton code.
enum class AxisOrder {
  by_extent,  ///< the longest remaining side first: squarer cells
  cyclic,     ///< x, y, z in turn, as in the poster
};

/// What Builder::sah and wu2011 weigh: a split costs `visit_cost` and the expected triangle tests
/// on its two sides, a leaf its triangle tests (MacDonald and Booth 1990), and the cheapest is
/// taken.
struct SahOptions {
  /// Of a ray that visits an inner node, in any unit; 1/1024 to 1024. With both costs 1 the builder
  /// minimises what Statistics::sah_cost measures.
  float visit_cost = 1.0F;

  /// Of a triangle test, in the same unit; 1/1024 to 1024. A wide tree tests eight at once: with
  /// 0.5 in place of 1 it was traced 0 to 9 % faster and built in 0.6 to 0.8 of the time (Bunny,
  /// Sibenik, Conference), and a binary one, of half the memory, as fast within 4 % (Bunny,
  /// Sibenik); with 0.25 binary ones were 13 and 19 % slower.
  float test_cost = 0.5F;

  /// `tight`: a ray enters a child by its tight box, so that this is what its cost depends on. The
  /// box of a side is that of its triangles, cut at the plane; what more a cut takes off a triangle
  /// is only known once the split is chosen.
  SahAreas areas = SahAreas::tight;

  /// For `cells`: by how much of itself a split is cheaper that cuts off an empty cell; at least 0,
  /// below 1 (Wald and Havran take 0.2). 0, since a tight box has no empty space to cut off, and
  /// `tight` counts what lies between the boxes of both sides.
  float empty_bonus = 0.0F;
};

/// Options of build(). A value outside its range is ErrorCode::invalid_option.
struct BuildOptions {
  Backend backend = Backend::automatic;  ///< ignored where an executor is given

  /// `sah` makes the best trees and takes some fifty times as long: for scenes that stay as they
  /// are, and as the measure of other trees. It lists a triangle in every cell that it enters,
  /// whatever `references` says (Tree::options() then says `all`), ends where no split is cheaper
  /// (`leaf_size` is not looked at), and has no use for codes: `code_bits`, `axis_order`,
  /// `recode_crowded` and `reference_capacity` are not looked at either. In a device build it is
  /// ErrorCode::unsupported_option; without an executor, Backend::automatic takes the CPU for it.
  ///
  /// `wu2011` makes the very tree of `sah`, byte for byte, on every backend: Wu, Zhao, Liu, SAH
  /// KD-Tree Construction on GPU (HPG 2011), breadth first, all nodes of a level at once. It is
  /// there to measure the Morton builder by, and for SAH trees on a device; on the CPU `sah` is
  /// quicker. The same options count. A level may have 2^31 / 6 references at most
  /// (too_many_references). On a device it waits twice a level for a few counts, by which it takes
  /// memory for the next: build() throws what goes wrong at once, takes everything from
  /// Executor::memory and nothing from Executor::workspace, and cannot be captured by a CUDA graph;
  /// rebuild() and memory_requirement() are ErrorCode::unsupported_option.
  Builder builder = Builder::morton;
  SahOptions sah{};  ///< for Builder::sah and wu2011

  /// `balanced` takes a part of the node visits of `fast` off primary rays (Bunny 15 of 100,
  /// Sibenik 26, Conference 41) for 1.2 to 2.6 times the time to build. Codes then have 46 to 51
  /// bits at most.
  Quality quality = Quality::fast;

  /// `all` takes four to nine times as long to build as `once`. It has what only a strict kd-tree
  /// gives: disjoint cells, and so fewer node visits.
  References references = References::once;

  /// References per valid triangle that `budget` may use, counted over the whole scene and never
  /// exceeded; finite, at least 1. 1.3 took a third off the node visits and half off the triangle
  /// tests in Conference; twice as much gained little more. No triangle is cut into more than
  /// 1024. Room for all that this allows is made before the scene is known. `all` is not bounded by
  /// it: so many fragments decide where its cells are.
  float budget = 1.3F;

  /// References that a CUDA build of `all` makes room for, at most max_count: there memory is taken
  /// before anything is known of the scene. analyse() (zkd/cuda/build.hpp) finds it. Too little is
  /// ErrorCode::reference_capacity, which says how many are needed (with too little even before
  /// crowded leaves are split, how many for that); more changes nothing but the memory. On the CPU,
  /// and with `once`, it is not looked at.
  std::uint64_t reference_capacity = 0;

  /// A trunk is the largest range of neighbouring codes with at most this many triangles; 1 to
  /// 1024, or 0: 4, with `all` 12. With `all` a leaf that lists more than eight times as many is
  /// split again, by what lies in its cell, into trunks of twice as many, unless the boxes of what
  /// lies there are nearly the same. Of 1, 2, 4 and 8, 4 was
  /// within 3 % of the best for build plus trace on Bunny and the best on Sibenik; as a wide tree,
  /// none of 8, 12 and 16 was ahead in most scenes for `all`, as a binary one 12 had 0.81 to 1.02
  /// of the speed of 8 (five scenes). Time of the trunk stage grows with it.
  std::uint32_t leaf_size = 0;

  /// Bits of a Morton code, 1 to 64, or 0: 32 below 2^22 valid triangles, 64 from there on. With 32
  /// bits rays visit as many nodes as with 63, within 1 % (Bunny, Conference, Dragon), and the sort
  /// takes little more than half the time. Fewer may be used: an axis gets no bits below the
  /// resolution of its floats.
  std::uint32_t code_bits = 0;

  /// By extent: fewer triangle tests per ray than cyclic on each of seven scenes (1 to 11 %), and 8
  /// to 11 % fewer node visits on scanned models, though 5 to 9 % more in rooms.
  AxisOrder axis_order = AxisOrder::by_extent;

  /// Codes the triangles of a crowded trunk (one code, more than leaf_size triangles) again, in
  /// their own box, with 32 more bits. Costs one pass over the codes where no trunk is crowded;
  /// without it a small model in a large scene becomes one leaf.
  bool recode_crowded = true;

  InvalidTriangles invalid_triangles = InvalidTriangles::error;

  /// Fills Statistics::depth, ::largest_leaf and ::sah_cost: one more pass over the nodes, on one
  /// thread, for which most programs have no use.
  bool measure_quality = false;
};

/// The names used on command lines and in JSON: "once", "morton", ... `automatic` is "auto".
ZKD_API const char* to_string(Backend value) noexcept;
ZKD_API const char* to_string(References value) noexcept;
ZKD_API const char* to_string(Builder value) noexcept;
ZKD_API const char* to_string(Quality value) noexcept;
ZKD_API const char* to_string(InvalidTriangles value) noexcept;
ZKD_API const char* to_string(AxisOrder value) noexcept;
ZKD_API const char* to_string(SahAreas value) noexcept;

}  // namespace zkd
