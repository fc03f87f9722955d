// SPDX-License-Identifier: Apache-2.0
//
// What must hold for every build. See check_build.hpp.
#include "fuzz/check_build.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include <zkd/zkd.hpp>

#include "fuzz/fail.hpp"
#include "scene/generate.hpp"
#include "support/composition.hpp"
#include "support/memory.hpp"
#include "verify/exact.hpp"
#include "verify/properties.hpp"
#include "verify/tree_hash.hpp"

namespace zkd::fuzz {
namespace {

// Planes strictly increase, are floats without rounding, and P(k(x)) <= x < P(k(x) + 1) for the two
// ends of the scene box, which therefore lie in the lattice.
void check_lattice(const Tree& tree) {
  const Lattice& lattice = tree.lattice();
  require(lattice.bits[0] + lattice.bits[1] + lattice.bits[2] == lattice.code_bits,
          "the bits of the axes are not those of the code");
  if (tree.view().empty()) return;
  const Box box = tree.view().bounds();
  const auto scale = static_cast<double>(tree.view().scale());
  for (int a = 0; a < 3; ++a) {
    if (lattice.bits[a] == 0) continue;
    const auto plane = [&](double k) {
      return std::ldexp(lattice.origin[a] + k, lattice.exponent[a]);
    };
    const double cells = std::ldexp(1.0, static_cast<int>(lattice.bits[a]));
    for (const float end : {box.lo[a], box.hi[a]}) {
      const auto x = static_cast<double>(end);
      const double k = std::floor(std::ldexp(x, -lattice.exponent[a])) - lattice.origin[a];
      require(k >= 0.0 && k < cells, "the scene box reaches out of the lattice");
      require(plane(k) <= x && x < plane(k + 1.0), "a coordinate is not in its cell");
      const double in_tree_space = plane(k) * scale;
      require(static_cast<double>(static_cast<float>(in_tree_space)) == in_tree_space,
              "a plane is no float");
    }
  }
}

bool same_arrays(const test::Composition& stages, const TreeView& view) {
  const std::size_t offsets = view.empty() ? 0 : view.leaf_count() + std::size_t{1};
  return view.leaf_count() + std::size_t{1} == stages.leaf_offsets.size() &&
         view.root() == stages.root && view.reference_count() == stages.references.size() &&
         std::equal(view.leaf_offsets, view.leaf_offsets + offsets, stages.leaf_offsets.begin()) &&
         std::equal(view.references, view.references + view.reference_count(),
                    stages.references.begin()) &&
         view.node_count() == stages.nodes.size() &&
         (view.node_count() == 0 ||
          std::memcmp(view.nodes, stages.nodes.data(), view.node_count() * sizeof(Node)) == 0);
}

// Zero area far outside, NaN and infinity, at the front, between and at the end.
scene::Mesh with_invalid_triangles(const scene::Mesh& mesh, std::vector<std::uint32_t>& old_ids) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
  scene::Mesh more = mesh;
  more.faces.clear();
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  more.positions.insert(
      more.positions.end(),
      {{1e30F, 1e30F, 1e30F}, {-1e30F, 1e20F, 3}, {nan_value, 0, 0}, {0, -infinity, 0}});
  const auto add = [&](const glm::uvec3& face, std::uint32_t old_id) {
    more.faces.push_back(face);
    old_ids.push_back(old_id);
  };
  add({first, first, first + 1}, no_triangle);
  for (std::uint32_t i = 0; i < mesh.faces.size(); ++i) {
    if (i % 7 == 3) add({first, first + 1, first + 2 + i % 2}, no_triangle);
    add(mesh.faces[i], i);
  }
  add({first + 1, first + 1, first + 1}, no_triangle);
  return more;
}

}  // namespace

void check_properties(const Tree& tree, const scene::Mesh& mesh) {
  const std::vector<std::string> violated = verify::check_tree(tree, mesh.view());
  if (!violated.empty()) fail(violated.front());
  check_lattice(tree);

  const Statistics& statistics = tree.statistics();
  std::uint64_t valid = 0;
  std::uint64_t finite = 0;
  for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
    valid += verify::valid_triangle(mesh.view(), i) ? 1 : 0;
    finite += verify::finite_corners(mesh.view(), i).has_value() ? 1 : 0;
  }
  require(statistics.triangles == mesh.faces.size(), "statistics: triangles");
  require(statistics.skipped_non_finite == mesh.faces.size() - finite, "statistics: non-finite");
  require(statistics.skipped_zero_area == finite - valid, "statistics: zero area");
  require(statistics.leaves == tree.view().leaf_count(), "statistics: leaves");
  require(statistics.nodes == tree.view().node_count(), "statistics: nodes");
  require(statistics.references == tree.view().reference_count(), "statistics: references");
  if (tree.options().measure_quality) {
    require(statistics.depth == verify::tree_depth(tree.view()), "statistics: depth");
    require(statistics.depth <= max_depth, "deeper than the stack of a walk");
  }
}

void check_same(const Tree& tree, const scene::Mesh& mesh, const BuildOptions& options,
                std::uint64_t seed) {
  const std::string hash = verify::tree_hash(tree.view());
  for (const int threads : {1, 2, 3}) {
    for (const auto set : {cpu::InstructionSet::portable, cpu::InstructionSet::avx2}) {
      const Tree again = build({.threads = threads, .instructions = set}, mesh.view(), options);
      require(verify::tree_hash(again.view()) == hash,
              "another tree with other threads or instructions");
    }
  }
  require(verify::tree_hash(tree.clone().view()) == hash, "the clone is another tree");
  if (tree.options().builder == Builder::wu2011) {
    BuildOptions sah = options;
    sah.builder = Builder::sah;
    require(verify::tree_hash(build({.threads = 1}, mesh.view(), sah).view()) == hash,
            "sah and wu2011 make different trees");
  }
  if (tree.options().builder == Builder::morton && options.quality == Quality::fast &&
      options.references != References::automatic) {
    if (!same_arrays(test::compose({.threads = 2}, mesh.view(), options), tree.view())) {
      fail(std::string("the stages one by one give another tree: references ") +
           to_string(options.references) + ", leaf size " + std::to_string(options.leaf_size) +
           ", code bits " + std::to_string(options.code_bits) + ", recoded " +
           std::to_string(static_cast<int>(options.recode_crowded)) + ", " +
           std::to_string(tree.view().leaf_count()) + " leaves");
    }
  }

  const std::string mapped = verify::tree_hash_mapped(tree.view(), {});
  std::vector<std::uint32_t> old_ids;
  const scene::Mesh shuffled = scene::shuffled(mesh, seed, &old_ids);
  require(verify::tree_hash_mapped(build(shuffled.view(), options).view(), old_ids) == mapped,
          "another tree for permuted triangles");
  old_ids.clear();
  const scene::Mesh more = with_invalid_triangles(mesh, old_ids);
  require(verify::tree_hash_mapped(build(more.view(), options).view(), old_ids) == mapped,
          "another tree with invalid triangles added");
}

void check_memory(const scene::Mesh& mesh, const BuildOptions& options, std::uint32_t refused) {
  test::CountingResource memory;
  memory.refuse_at = refused;
  const cpu::Executor executor{.threads = 2, .memory = &memory};
  bool threw = false;
  try {
    const Tree tree = build(executor, mesh.view(), options);
    require(memory.live_bytes() == tree.statistics().tree_bytes, "more is held than the tree");
  } catch (const Error& error) {
    threw = true;
    if (error.code() != ErrorCode::out_of_memory) fail(std::string("refused: ") + error.what());
  }
  require(threw == (refused != 0 && memory.allocations() >= refused), "a refusal went unnoticed");
  require(memory.live_bytes() == 0 && memory.live_blocks() == 0, "leaked");
  require(!memory.misused(), "memory given back in another size or by another thread");

  const bool morton = options.builder == Builder::morton && options.quality == Quality::fast;
  if (!morton) return;  // what it takes is not known beforehand
  test::CountingResource whole;
  std::uint64_t references = 0;
  {
    const Tree tree = build({.threads = 2, .memory = &whole}, mesh.view(), options);
    references = tree.statistics().references;
  }
  const MemoryRequirement need =
      memory_requirement({.threads = 2}, mesh.faces.size(), options, references);
  require(whole.peak_bytes() <= need.tree_bytes + need.workspace_bytes,
          "more memory than was asked for beforehand");
}

}  // namespace zkd::fuzz
