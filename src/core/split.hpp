// SPDX-License-Identifier: Apache-2.0
//
// Between validation and encoding, for References::budget, and for `automatic` and `all` in uneven
// scenes: triangles whose boxes hold much besides them are cut on planes of the lattice, and
// fragments take their place in all later stages (Ernst,
// Greiner: Early Split Clipping for Bounding Volume Hierarchies, RT 2007; Karras, Aila: Fast
// Parallel Construction of High-Quality Bounding Volume Hierarchies, HPG 2013, section 4).
//
// How many cuts a triangle gets grows with its priority, and is scaled so that all of them stay
// within the budget. Priorities are counted in classes: so the scale is found without sorting, is
// the same for every grouping, and depends on no triangle's index.
#pragma once

#include <cstdint>

#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/traversal/arithmetic.hpp>
#include <zkd/traversal/triangle.hpp>

#include "core/area.hpp"
#include "core/arena.hpp"
#include "core/frame.hpp"
#include "core/lattice.hpp"
#include "core/rounding.hpp"
#include "core/status.hpp"
#include "core/unevenness.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

/// References that a tree over `triangles` may have under a budget of `factor` for each.
ZKD_HOST_DEVICE inline std::uint32_t budget_of(float factor, std::uint32_t triangles) {
  const double references = static_cast<double>(factor) * static_cast<double>(triangles);
  return references < static_cast<double>(max_count) ? static_cast<std::uint32_t>(references)
                                                     : max_count;
}

/// A plane of the lattice that cuts a box.
struct CutPlane {
  std::uint32_t axis = 3;  ///< 3: there is none
  double position = 0.0;
  std::int32_t exponent = 0;  ///< the nodes on its two sides are 2^exponent wide

  [[nodiscard]] ZKD_HOST_DEVICE bool is_none() const { return axis == 3; }
};

/// The most important plane of the lattice across the inside of a box: between the widest nodes of
/// the conceptual tree. The box lies inside the lattice.
ZKD_HOST_DEVICE inline CutPlane most_important_plane(const Lattice& lattice, const Box& box) {
  CutPlane best;
  for (int a = 0; a < 3; ++a) {
    if (lattice.bits[a] == 0) continue;
    const double inverse = power_of_two(-lattice.exponent[a]);
    const double lo = static_cast<double>(box.lo[a]) * inverse;
    const double hi = static_cast<double>(box.hi[a]) * inverse;
    const std::int32_t first = floor_to_int(lo) - lattice.origin[a];
    const std::int32_t last_touched = floor_to_int(hi) - lattice.origin[a];
    // A box that ends on a plane does not reach behind it.
    const bool on_plane = static_cast<double>(last_touched + lattice.origin[a]) == hi;
    const std::int32_t last = on_plane ? last_touched - 1 : last_touched;
    if (last <= first) continue;
    const auto differ = static_cast<std::uint64_t>(static_cast<std::uint32_t>(first ^ last));
    const int bit = 63 - static_cast<int>(leading_zeros(differ));
    const std::int32_t exponent = lattice.exponent[a] + bit;
    if (!best.is_none() && exponent <= best.exponent) continue;
    best = {static_cast<std::uint32_t>(a),
            plane_position(lattice, a, static_cast<std::uint32_t>(last >> bit << bit)), exponent};
  }
  return best;
}

/// Classes of priorities: two an octave, from 2^-64 to 1.
struct PriorityClasses {
  static constexpr std::uint32_t count = 128;

  /// The class of a priority in (0, 1]; `count` if it is too low for any.
  [[nodiscard]] static ZKD_HOST_DEVICE std::uint32_t of(double priority) {
    if (!(priority >= 0x1p-64)) return count;
    const std::uint32_t bits = bits_of(static_cast<float>(priority));
    const std::uint32_t half_octaves = (bits >> 22) - 2 * (127 - 64);
    return smaller(half_octaves, count - 1);
  }

  /// Cube root of the least priority of a class: cuts are proportional to it.
  [[nodiscard]] static ZKD_HOST_DEVICE double weight(std::uint32_t priority_class) {
    // Of 2^e and 1.5 * 2^e; e = -64 + 0, 1, 2 would leave thirds, -66 does not.
    constexpr double roots[6] = {1.0,
                                 1.1447142425533319,
                                 1.2599210498948732,
                                 1.4422495703074083,
                                 1.5874010519681994,
                                 1.8171205928321397};
    const std::uint32_t from = priority_class + 2 * (66 - 64);
    return roots[from % 6] * power_of_two(static_cast<int>(from / 6) - 22);
  }
};

/// Cuts of one triangle at most: it is cut by one thread.
inline constexpr std::uint32_t most_cuts = 1023;

/// Fragments that are made at most: all that a budget allows, or all that cuts can make.
ZKD_HOST_DEVICE inline std::uint32_t most_fragments(float factor, std::uint32_t triangles) {
  const std::uint64_t cut = std::uint64_t{triangles} * (most_cuts + 1);
  const std::uint32_t allowed = budget_of(factor, triangles);
  return cut < allowed ? static_cast<std::uint32_t>(cut) : allowed;
}

/// Cuts for each unit of weight, coarsely: 2^(step / 2).
struct Densities {
  static constexpr std::uint32_t coarse = 64;
  static constexpr std::uint32_t fine = 16;

  [[nodiscard]] static ZKD_HOST_DEVICE double of(std::uint32_t step) {
    return power_of_two(static_cast<int>(step / 2)) * (step % 2 == 0 ? 1.0 : 1.4142135623730951);
  }
  [[nodiscard]] static ZKD_HOST_DEVICE double between(double density, std::uint32_t step) {
    return density * (1.0 + static_cast<double>(step) * (0.4142135623730951 / fine));
  }
  [[nodiscard]] static ZKD_HOST_DEVICE std::uint32_t cuts(std::uint32_t priority_class,
                                                          double density) {
    const double wanted = density * PriorityClasses::weight(priority_class);
    return wanted < static_cast<double>(most_cuts) ? static_cast<std::uint32_t>(wanted) : most_cuts;
  }
};

/// What splitting has decided, in the backend's memory.
struct SplitState {
  double density = 0.0;
  std::uint64_t allowed = 0;  ///< cuts
  std::uint32_t classes[PriorityClasses::count];
  std::uint64_t cuts[Densities::coarse];
};

/// Priority of a triangle: by how much the surface of its box exceeds what cutting it again and
/// again would leave, as a part of the scene's; halved for every level that the most important
/// plane across it lies below the top.
struct ClassOfPriority {
  TriangleView triangles;
  const Box* boxes;
  const Lattice* scene_lattice;
  const Box* bounds;
  std::uint8_t* classes;  ///< noted for when the density is known
  Lattice lattice{};
  double inverse_area = 0.0;
  std::int32_t top = 0;

  ZKD_HOST_DEVICE void load() {
    lattice = *scene_lattice;
    const double area = half_area(*bounds);
    inverse_area = area > 0.0 ? 1.0 / area : 0.0;
    top = -4096;
    for (int a = 0; a < 3; ++a)
      if (lattice.bits[a] > 0)
        top = larger(top, lattice.exponent[a] + static_cast<std::int32_t>(lattice.bits[a]) - 1);
  }

  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t triangle) const {
    const std::uint32_t found = class_of(triangle);
    classes[triangle] = static_cast<std::uint8_t>(found);
    return found;
  }

  [[nodiscard]] ZKD_HOST_DEVICE std::uint32_t class_of(std::uint32_t triangle) const {
    const Box& box = boxes[triangle];
    if (box.empty()) return PriorityClasses::count;
    const double part = half_area(box) * inverse_area;
    if (!(part >= 0x1p-64)) return PriorityClasses::count;
    const CutPlane plane = most_important_plane(lattice, box);
    if (plane.is_none()) return PriorityClasses::count;
    const Corners c = corners_of(triangles, triangle);
    double edge[2][3];
    for (int i = 0; i < 2; ++i)
      for (int a = 0; a < 3; ++a)
        edge[i][a] = static_cast<double>(c.p[i + 1][a]) - static_cast<double>(c.p[0][a]);
    double projected = 0.0;
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      const int d = (a + 2) % 3;
      projected += magnitude(edge[0][b] * edge[1][d] - edge[0][d] * edge[1][b]);
    }
    const double waste = part - 0.5 * projected * inverse_area;
    return PriorityClasses::of(waste * power_of_two(larger(plane.exponent - top, -64)));
  }
};

/// Cuts that a coarse density would make in all.
struct CountCuts {
  SplitState* state;
  bool fine;

  ZKD_HOST_DEVICE void operator()(std::uint32_t step) const {
    const double density = fine ? Densities::between(state->density, step) : Densities::of(step);
    std::uint64_t sum = 0;
    for (std::uint32_t c = 0; c < PriorityClasses::count; ++c)
      if (state->classes[c] != 0)
        sum += std::uint64_t{state->classes[c]} * Densities::cuts(c, density);
    state->cuts[step] = sum;
  }
};

/// The largest density that stays within the budget; 0 if none does.
struct ChooseDensity {
  SplitState* state;
  bool fine;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    const std::uint32_t steps = fine ? Densities::fine : Densities::coarse;
    std::uint32_t step = steps;
    while (step > 0 && state->cuts[step - 1] > state->allowed) --step;
    const double from = state->density;
    state->density = 0.0;
    if (step > 0)
      state->density = fine ? Densities::between(from, step - 1) : Densities::of(step - 1);
  }
};

/// What the budget allows.
struct BeginSplitting {
  SplitState* state;
  const BuildCounts* counts;
  float budget;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    state->density = 0.0;
    state->allowed = counts->splits != 0 ? budget_of(budget, counts->listed) - counts->listed : 0;
  }
};

/// Fragments of a triangle: one more than cuts.
struct CountFragments {
  const Box* boxes;
  const std::uint8_t* classes;
  const SplitState* state;
  double density = 0.0;

  ZKD_HOST_DEVICE void load() { density = state->density; }

  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t triangle) const {
    if (boxes[triangle].empty()) return 0;
    const std::uint32_t c = classes[triangle];
    return c < PriorityClasses::count ? 1 + Densities::cuts(c, density) : 1;
  }
};

/// Boxes of what of a triangle lies in `box` on either side of a plane through it (Stich,
/// Friedrich, Dietrich: Spatial Splits in Bounding Volume Hierarchies, HPG 2009). A side on which
/// nothing lies is empty. Where an edge meets the plane is computed to 11 * 2^-53 of the scene's
/// largest coordinate, and made larger by `slack`, which is more.
struct Halves {
  Box side[2];

  ZKD_HOST_DEVICE Halves(const Corners& c, const Box& box, const CutPlane& plane, double slack) {
    const auto axis = plane.axis;
    const auto position = static_cast<float>(plane.position);
    for (int i = 0; i < 3; ++i) {
      const float* from = c.p[i];
      const float* to = c.p[(i + 1) % 3];
      const float f = from[axis];
      const float t = to[axis];
      for (int s = 0; s < 2; ++s)
        if (s == 0 ? f <= position : f >= position)
          for (int a = 0; a < 3; ++a) {
            side[s].lo[a] = smaller(side[s].lo[a], from[a] + 0.0F);
            side[s].hi[a] = larger(side[s].hi[a], from[a] + 0.0F);
          }
      if (!((f < position && t > position) || (f > position && t < position))) continue;
      const double along = (plane.position - static_cast<double>(f)) /
                           (static_cast<double>(t) - static_cast<double>(f));
      for (std::uint32_t a = 0; a < 3; ++a) {
        float lo = position;
        float hi = position;
        if (a != axis) {
          const double start = static_cast<double>(from[a]);
          const double met = start + along * (static_cast<double>(to[a]) - start);
          // The point lies on the edge, whatever rounding says.
          lo = larger(float_below(met - slack), smaller(from[a], to[a]) + 0.0F);
          hi = smaller(float_above(met + slack), larger(from[a], to[a]) + 0.0F);
        }
        for (Box& half : side) {
          half.lo[a] = smaller(half.lo[a], lo);
          half.hi[a] = larger(half.hi[a], hi);
        }
      }
    }
    for (int s = 0; s < 2; ++s) {
      for (int a = 0; a < 3; ++a) {
        side[s].lo[a] = larger(side[s].lo[a], box.lo[a]);
        side[s].hi[a] = smaller(side[s].hi[a], box.hi[a]);
      }
      if (side[s].empty()) side[s] = Box{};
    }
  }
};

/// Cuts a triangle into the fragments that were counted for it. Where it cannot be cut so often,
/// the places of the others get an empty box, as triangles do that are left out.
struct SplitTriangle {
  TriangleView triangles;
  const Box* boxes;
  const std::uint32_t* first;  ///< fragment of each triangle
  const std::uint32_t* triangle_count;
  const std::uint32_t* fragment_count;
  const Lattice* scene_lattice;
  const Box* bounds;
  Box* fragments;
  std::uint32_t* owners;
  Lattice lattice{};
  double slack = 0.0;

  ZKD_HOST_DEVICE void load() {
    lattice = *scene_lattice;
    for (int a = 0; a < 3; ++a) {
      slack = larger(slack, static_cast<double>(magnitude(bounds->lo[a])));
      slack = larger(slack, static_cast<double>(magnitude(bounds->hi[a])));
    }
    slack *= 0x1p-46;
  }

  /// Without initialisers: a stack of them costs nothing.
  struct Piece {
    Box box;
    std::uint32_t at;
    std::uint32_t cuts;
  };

  ZKD_HOST_DEVICE void operator()(std::uint32_t triangle) const {
    const std::uint32_t begin = first[triangle];
    const std::uint32_t end =
        triangle + 1 < *triangle_count ? first[triangle + 1] : *fragment_count;
    if (begin == end) return;
    for (std::uint32_t i = begin; i < end; ++i) owners[i] = triangle;
    fragments[begin] = boxes[triangle];
    if (end - begin == 1) return;
    cut(corners_of(triangles, triangle), {boxes[triangle], begin, end - begin - 1});
  }

 private:
  static ZKD_HOST_DEVICE bool same(const Box& x, const Box& y) {
    bool equal = true;
    for (int a = 0; a < 3; ++a) equal = equal && x.lo[a] == y.lo[a] && x.hi[a] == y.hi[a];
    return equal;
  }
  static ZKD_HOST_DEVICE double longest_side(const Box& box) {
    double longest = 0.0;
    for (int a = 0; a < 3; ++a)
      longest = larger(longest, static_cast<double>(box.hi[a]) - static_cast<double>(box.lo[a]));
    return longest;
  }

  ZKD_HOST_DEVICE void cut(const Corners& corners, Piece piece) const {
    // The part with fewer cuts goes first, and so at most log2(most_cuts) parts wait.
    Piece stack[11];
    int waiting = 0;
    for (;;) {
      while (piece.cuts > 0) {
        const CutPlane plane = most_important_plane(lattice, piece.box);
        if (plane.is_none()) break;
        const Halves halves(corners, piece.box, plane, slack);
        if (halves.side[0].empty() || halves.side[1].empty()) {
          const Box& rest = halves.side[halves.side[0].empty() ? 1 : 0];
          if (rest.empty() || same(rest, piece.box))
            break;  // the same: no plane of a lattice over it
          piece.box = rest;
          continue;
        }
        const double below = longest_side(halves.side[0]);
        const double both = below + longest_side(halves.side[1]);
        const std::uint32_t left = piece.cuts - 1;
        const auto cuts_below =
            both > 0.0
                ? static_cast<std::uint32_t>(static_cast<double>(left) * (below / both) + 0.5)
                : 0;
        const Piece lower{halves.side[0], piece.at, smaller(cuts_below, left)};
        const Piece upper{halves.side[1], piece.at + lower.cuts + 1, left - lower.cuts};
        const bool lower_first = lower.cuts <= upper.cuts;
        stack[waiting++] = lower_first ? upper : lower;
        piece = lower_first ? lower : upper;
      }
      fragments[piece.at] = piece.box;
      for (std::uint32_t i = 1; i <= piece.cuts; ++i) fragments[piece.at + i] = Box{};
      if (waiting == 0) return;
      piece = stack[--waiting];
    }
  }
};

/// From here on fragments are what is listed. Places that stayed empty are found while encoding.
struct TakeFragments {
  BuildCounts* counts;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    counts->left_out = counts->given = counts->listed = counts->fragments;
  }
};

/// Which fragments of a trunk are listed: of several of one triangle, the first.
struct TrunkOfFragments {
  const std::uint32_t* ids;    ///< fragments in the order of their keys
  const std::uint32_t* first;  ///< position of each trunk, and the end
  const std::uint32_t* owners;
  std::uint32_t leaf_size;

  /// Calls visit(triangle) for each triangle of a trunk, once.
  template <class Visit>
  ZKD_HOST_DEVICE void operator()(std::uint32_t trunk, Visit& visit) const {
    const std::uint32_t begin = first[trunk];
    const std::uint32_t end = first[trunk + 1];
    // In a larger trunk all keys are equal, and fragments stand in the order in which they were
    // made: those of one triangle side by side.
    const std::uint32_t look_back = end - begin > leaf_size ? 1 : leaf_size;
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint32_t owner = owners[ids[i]];
      bool is_new = true;
      for (std::uint32_t j = i; j > begin && i - j < look_back; --j)
        is_new = is_new && owners[ids[j - 1]] != owner;
      if (is_new) visit(owner);
    }
  }
};

struct CountOwners {
  TrunkOfFragments fragments;

  struct Counter {
    std::uint32_t count = 0;
    ZKD_HOST_DEVICE void operator()(std::uint32_t) { ++count; }
  };
  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t trunk) const {
    Counter counter;
    fragments(trunk, counter);
    return counter.count;
  }
};

struct ListOwners {
  TrunkOfFragments fragments;
  const std::uint32_t* leaf_offsets;
  std::uint32_t* references;

  struct Writer {
    std::uint32_t* to;
    ZKD_HOST_DEVICE void operator()(std::uint32_t triangle) { *to++ = triangle; }
  };
  ZKD_HOST_DEVICE void operator()(std::uint32_t trunk) const {
    Writer writer{references + leaf_offsets[trunk]};
    fragments(trunk, writer);
  }
};

/// Puts the end behind the first positions of all trunks.
struct CloseTrunks {
  const BuildCounts* counts;
  std::uint32_t* first;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const { first[counts->trunks] = counts->listed; }
};

/// For all references but `once`.
struct SplitWorkspace {
  SplitState* state;
  std::uint32_t* sizes;   ///< triangles in each of SizeClasses
  Box* boxes;             ///< of triangles
  std::uint8_t* classes;  ///< of triangles
  std::uint32_t* first;   ///< fragment of each triangle
  std::uint32_t* owners;  ///< triangle of each fragment

  void lay_out(Arena& arena, std::size_t triangles, std::size_t fragments) {
    state = arena.take<SplitState>(1);
    sizes = arena.take<std::uint32_t>(SizeClasses::count);
    boxes = arena.take<Box>(triangles);
    classes = arena.take<std::uint8_t>(triangles);
    first = arena.take<std::uint32_t>(triangles);
    owners = arena.take<std::uint32_t>(fragments);
  }
};

/// Splitting, start to end.
template <class Backend>
struct SplitAll {
  TriangleView triangles;
  SplitWorkspace work;
  const Lattice* lattice;
  const Box* bounds;
  BuildCounts* counts;
  float budget;
  Box* fragments;

  void run(Backend& backend) {
    const auto bound = static_cast<std::uint32_t>(triangles.triangle_count);
    const Count given{&counts->given, bound};
    SplitState* state = work.state;
    backend.for_each(one, BeginSplitting{state, counts, budget});
    backend.histogram(given, ClassOfPriority{triangles, work.boxes, lattice, bounds, work.classes},
                      PriorityClasses::count, state->classes);
    for (const bool fine : {false, true}) {
      backend.for_each(Count{nullptr, fine ? Densities::fine : Densities::coarse},
                       CountCuts{state, fine});
      backend.for_each(one, ChooseDensity{state, fine});
    }
    backend.exclusive_scan(given, CountFragments{work.boxes, work.classes, state}, work.first,
                           &counts->fragments);
    backend.for_each(
        given, SplitTriangle{triangles, work.boxes, work.first, &counts->given, &counts->fragments,
                             lattice, bounds, fragments, work.owners});
    backend.for_each(one, TakeFragments{counts});
  }
};

}  // namespace zkd::core
