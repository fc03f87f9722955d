// SPDX-License-Identifier: Apache-2.0
//
// A row of the stress matrix, its cases, and what is expected of each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <zkd/error.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/query.hpp>
#include <zkd/tree.hpp>

#include "scene/mesh.hpp"
#include "stress/findings.hpp"

namespace zkd::stress {

/// Small: all rows within a minute or two, for the test suite. Large: as the matrix has it.
enum class Size { small, large };

/// How a row is run.
struct Setting {
  Size size = Size::small;
  std::uint64_t seed = 1;
  int threads = 0;  ///< of queries and of what is timed; 0: all. Trees are built with 1, 2, 3 too

  /// The number for this size.
  template <class Number>
  [[nodiscard]] Number pick(Number small, Number large) const {
    return size == Size::small ? small : large;
  }
};

struct Case;

/// A case after its rays were traced. All trees gave the same answers, or the row has failed.
struct Traced {
  const Case& of;
  std::span<const Tree* const> trees;  ///< one for each of Case::options
  std::span<const Ray> rays;
  std::span<const Hit> hits;
  std::span<const TraversalCost> costs;  ///< through the first tree
  int threads;
};

/// `count` rays at the mesh, of which the tree was built.
using RaySource = std::function<std::vector<Ray>(const scene::Mesh&, const TreeView&,
                                                 std::uint32_t count, std::uint64_t seed)>;

/// A mesh, rays at it, and what must hold. Every case is held to what holds for all of them (see
/// run_case); a case may ask for more, or be a piece of work of its own.
struct Case {
  std::string name;
  scene::Mesh mesh;

  /// A tree is built with each. See usual_options() and others below.
  std::vector<BuildOptions> options;

  /// Made for each tree, ray_count of them in all: see hard_rays of scene/hard_rays.hpp.
  RaySource rays;
  std::uint32_t ray_count = 0;

  /// How many of them the oracle sees, 0: all. For scenes where each ray meets most triangles.
  std::uint32_t oracle_rays = 0;

  enum class Hits { some, none, all } hits = Hits::some;

  /// What is asked besides.
  std::function<void(const Traced&, Findings&)> also;

  /// How many times the time of an even scene its build may take; 0: any.
  double build_limit = 0.0;
  /// How many times the time of an even scene its rays may take; 0: any.
  double trace_limit = 0.0;
  /// Rays that are timed instead of `rays`, where those would say little: for this mesh, and for
  /// the even one.
  RaySource timed_rays;
  RaySource timed_even_rays;

  /// The whole case, where it is not triangles and rays. Nothing else is looked at then.
  std::function<void(const Setting&, Findings&)> own;
};

using Yield = std::function<void(Case)>;

/// One row.
struct Row {
  int number;
  const char* name;
  /// Hands over its cases, one by one. The same for the same seed on every machine.
  void (*cases)(const Setting&, const Yield&);
};

/// All rows, ascending.
[[nodiscard]] std::span<const Row> rows();

/// Rows of one file each.
[[nodiscard]] std::vector<Row> input_rows();    ///< 1 to 9
[[nodiscard]] std::vector<Row> crowd_rows();    ///< 10 to 15
[[nodiscard]] std::vector<Row> place_rows();    ///< 16, 17
[[nodiscard]] std::vector<Row> plane_rows();    ///< 18 to 21
[[nodiscard]] std::vector<Row> shape_rows();    ///< 22 to 24
[[nodiscard]] std::vector<Row> surface_rows();  ///< 25 to 29
[[nodiscard]] std::vector<Row> tree_rows();     ///< 30 to 32
[[nodiscard]] std::vector<Row> ray_rows();      ///< 33 to 40, 46 to 48
[[nodiscard]] std::vector<Row> rule_rows();     ///< 41 to 45, 49
[[nodiscard]] std::vector<Row> memory_rows();   ///< 50 to 52

// ---- Options ------------------------------------------------------------------------------------

/// Invalid triangles are skipped in all of these.
[[nodiscard]] BuildOptions with(References references, std::uint32_t leaf_size = 4,
                                std::uint32_t code_bits = 0);
[[nodiscard]] std::vector<BuildOptions> only_once();
[[nodiscard]] std::vector<BuildOptions> once_and_all();
/// Both policies with other leaf sizes, code widths and axis orders too.
[[nodiscard]] std::vector<BuildOptions> many_options();

// ---- What rows are made of ----------------------------------------------------------------------

/// A case with scene::hard_rays.
[[nodiscard]] Case hard_case(std::string name, scene::Mesh mesh, std::vector<BuildOptions> options,
                             std::uint32_t ray_count);

/// A case that is a piece of work.
[[nodiscard]] Case own_case(std::string name, std::function<void(const Setting&, Findings&)> own);

/// Fails unless `work` throws zkd::Error with this code and offender, and a message that names it.
void expect_error(Findings& findings, const std::string& what, ErrorCode code,
                  std::uint64_t offender, const std::function<void()>& work);

/// The same triangles without those for which `leave_out` says so, and for each that is left its
/// id in `mesh`.
[[nodiscard]] scene::Mesh without(const scene::Mesh& mesh, const std::vector<bool>& leave_out,
                                  std::vector<std::uint32_t>& ids);

}  // namespace zkd::stress
