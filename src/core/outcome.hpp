// SPDX-License-Identifier: Apache-2.0
//
// What the owner of a finished tree is told about its build, on every backend.
#pragma once

#include <cstdint>

#include <zkd/options.hpp>
#include <zkd/statistics.hpp>
#include <zkd/tree.hpp>

#include "core/host_block.hpp"
#include "core/pipeline.hpp"

namespace zkd {

/// Puts together the owner of a finished tree in host memory.
struct TreeAssembler {
  /// `tree_block` holds what `view` points to but for the references, which are in
  /// `reference_block`. The tree owns both from now on.
  ZKD_API static Tree assemble(const TreeView& view, const core::BuildState& state,
                               const BuildOptions& options, const Statistics& statistics,
                               core::HostBlock& tree_block, core::HostBlock& reference_block);

  static Statistics& statistics(Tree& tree) { return tree.statistics_; }
};

namespace core {

/// Whether codes are kept in 64 bits. More room than bits changes nothing in the tree, so the count
/// given may decide it, invalid triangles included.
inline bool needs_wide_codes(const BuildOptions& options, std::uint64_t triangle_count) {
  return choose_code_bits(options.code_bits, static_cast<std::uint32_t>(triangle_count)) > 32;
}

/// The options with everything automatic replaced by what was chosen.
inline BuildOptions used_options(const BuildState& state, const BuildOptions& options,
                                 Backend backend) {
  BuildOptions used = options;
  used.backend = backend;
  if (options.builder != Builder::morton) {
    used.references = References::all;
    return used;
  }
  used.code_bits = choose_code_bits(options.code_bits, state.report.valid);
  return used;
}

/// Counts, and what was skipped. No times, no bytes, no quality.
ZKD_API Statistics describe(const BuildState& state, const BuildOptions& options,
                            std::uint64_t triangles, std::uint32_t radix_passes_left_out);

}  // namespace core
}  // namespace zkd
