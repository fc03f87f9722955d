// SPDX-License-Identifier: Apache-2.0
//
// Putting together what is said and owned once a tree is finished.
#include "core/outcome.hpp"

namespace zkd {

Tree TreeAssembler::assemble(const TreeView& view, const core::BuildState& state,
                             const BuildOptions& options, const Statistics& statistics,
                             core::HostBlock& tree_block, core::HostBlock& reference_block) {
  Tree tree;
  tree.view_ = view;
  tree.lattice_ = state.lattice;
  tree.options_ = options;
  tree.statistics_ = statistics;
  tree.statistics_.tree_bytes = tree_block.bytes() + reference_block.bytes();
  tree.memory_ = tree_block.memory();
  tree.node_block_.bytes = tree_block.bytes();
  tree.node_block_.data = tree_block.release();
  tree.reference_block_.bytes = reference_block.bytes();
  tree.reference_block_.data = reference_block.release();
  return tree;
}

namespace core {

Statistics describe(const BuildState& state, const BuildOptions& options, std::uint64_t triangles,
                    std::uint32_t radix_passes_left_out) {
  const BuildCounts& counts = state.counts;
  Statistics statistics;
  statistics.triangles = triangles;
  statistics.skipped_zero_area = state.report.zero_area;
  statistics.skipped_non_finite = state.report.non_finite;
  statistics.code_bits = state.lattice.code_bits;
  statistics.crowded_trunks = counts.crowded_trunks;
  statistics.crowded_triangles = counts.crowded_triangles;
  statistics.crowded_leaves = counts.crowded_leaves;
  statistics.crowded_references = counts.crowded_references;
  statistics.nodes = counts.nodes;
  statistics.leaves = counts.trunks;
  statistics.references = counts.references;

  if (options.builder != Builder::morton) return statistics;  // the skips are of codes

  const auto report = [&statistics](Skip what, bool considered, std::uint32_t amount) {
    statistics.skips[static_cast<std::size_t>(what)] = {considered, amount != 0, amount, {}};
  };
  std::uint32_t flat = 0;
  for (int a = 0; a < 3; ++a)
    flat += state.report.bounds.lo[a] == state.report.bounds.hi[a] ? 1 : 0;
  const bool may_be_narrow = options.code_bits == 0 && options.quality == Quality::fast;
  report(Skip::radix_passes, radix_passes_left_out != 0, radix_passes_left_out);
  report(Skip::flat_axes, true, flat);
  report(Skip::wide_codes, may_be_narrow,
         may_be_narrow && state.report.valid < wide_code_threshold ? 32 : 0);
  const bool may_split = splits_if_uneven(options.references);
  report(Skip::splitting, may_split, may_split && counts.splits == 0 ? 1 : 0);
  report(Skip::recoding, options.recode_crowded,
         options.recode_crowded && counts.crowded_trunks == 0 ? 1 : 0);
  report(Skip::compaction, true, state.report.valid == triangles && counts.splits == 0 ? 1 : 0);
  const bool strict = options.references == References::all;
  report(Skip::subtrees, strict, strict && counts.crowded_leaves == 0 ? 1 : 0);
  return statistics;
}

}  // namespace core
}  // namespace zkd
