// SPDX-License-Identifier: Apache-2.0
//
// Other ways to walk a finished tree than the library's: what they cost, and what they miss. All
// of them call the library's watertight intersector, so a difference is the walk's alone.
#pragma once

#include <cstdint>
#include <span>

#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/query.hpp>
#include <zkd/tree.hpp>

namespace zkd::bench::accuracy {

enum class Walk {
  library,  ///< zkd::closest_hit
  slab,     ///< the library's walk and padding, with the boxes tested one coordinate at a time as
            ///< the next two do
  padded,   ///< boxes as they are, where a ray leaves them moved out by 3 ulp of t
  naive,    ///< boxes as they are, a hit accepted between entry and exit of its leaf's box only
  literal,  ///< the poster's text (literal_walk.hpp)
};

/// "library", ... Static storage.
[[nodiscard]] const char* to_string(Walk value) noexcept;

/// The nearest hit of each ray by that walk, on the executor's threads. `intersector` is for
/// Walk::library.
void closest_hit(Walk walk, Intersector intersector, const cpu::Executor& executor,
                 const TreeView& tree, const TriangleView& triangles, std::span<const Ray> rays,
                 std::span<Hit> hits);

/// Entries that wait at once, at most, while the library's walk answers these rays.
[[nodiscard]] std::uint32_t deepest_stack(const cpu::Executor& executor, const TreeView& tree,
                                          const TriangleView& triangles, std::span<const Ray> rays);

}  // namespace zkd::bench::accuracy
