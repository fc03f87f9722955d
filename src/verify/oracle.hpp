// SPDX-License-Identifier: Apache-2.0
//
// The exact oracle: what a ray hits when nothing is rounded.
//
// Coordinates are the float bits as given. A triangle is closed and has two sides. A ray whose
// determinant with the plane of a triangle is exactly zero does not hit it. Signs are decided in
// double where a forward error bound allows, with GMP integers elsewhere; t is an exact rational.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <zkd/geometry.hpp>

#include "verify/exact.hpp"

namespace zkd::verify {

/// Where the nearest hit lies in the triangles of its tie set.
enum class HitClass {
  interior,   ///< inside the only triangle there
  edge,       ///< on an edge of every triangle of the tie set, on a vertex of none
  vertex,     ///< on the boundary of every triangle of the tie set, on a vertex of at least one
  duplicate,  ///< several triangles, one of them hit inside: overlapping or crossing surfaces
};

/// "interior", ... Static storage.
const char* to_string(HitClass value) noexcept;

/// The nearest hit. On a miss t is infinite and ties is empty.
struct ExactHit {
  bool hit = false;
  double t = 0.0;  ///< the exact t, rounded to the nearest double
  HitClass hit_class = HitClass::interior;
  std::vector<std::uint32_t> ties;  ///< every triangle at exactly this t, ascending
};

/// True where a ray misses whatever the scene is: NaN anywhere, infinite origin or direction, zero
/// direction, or t_min > t_max.
[[nodiscard]] bool degenerate(const Ray& ray) noexcept;

/// Answers queries about one set of triangles, exactly. t_min <= t <= t_max is decided exactly
/// too, both ends included.
///
/// Copies what it needs: the view may go. Triangles with a non-finite vertex, an index out of range
/// or exactly zero area are left out. Up to 10^4 triangles every query is a loop over all; above, a
/// box tree in double leaves out what a ray cannot meet by a proven bound. Queries may be called
/// from any number of threads. Construction is O(n log n).
class Oracle {
 public:
  /// How triangles to test are found.
  enum class Search {
    automatic,    ///< by the number of triangles
    brute_force,  ///< a loop over all triangles
    box_tree,
  };

  explicit Oracle(const TriangleView& triangles, Search search = Search::automatic);
  Oracle(Oracle&&) noexcept;
  Oracle& operator=(Oracle&&) noexcept;
  ~Oracle();

  /// The nearest hit with its complete tie set.
  [[nodiscard]] ExactHit closest_hit(const Ray& ray) const;

  /// Whether anything is hit.
  [[nodiscard]] bool any_hit(const Ray& ray) const;

  /// Every triangle that the ray hits between its ends, near or far, ascending ids.
  [[nodiscard]] std::vector<std::uint32_t> all_hits(const Ray& ray) const;

  /// What the library's scaling may take off a coordinate (TreeView::scale): nothing unless the
  /// largest coordinate is above 2^32; then what underflows when that one is brought near 1.
  [[nodiscard]] double lost_by_scaling() const;

  /// The box of the triangles that can be hit, and the largest magnitude of a coordinate in it.
  /// Nothing to hit: an empty box (lo > hi), and 0.
  [[nodiscard]] const ExactBox& box() const;
  [[nodiscard]] double largest_coordinate() const;

 private:
  struct Scene;
  std::unique_ptr<const Scene> scene_;
};

}  // namespace zkd::verify
