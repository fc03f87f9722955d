// SPDX-License-Identifier: Apache-2.0
//
// Depth, largest leaf and SAH cost of a finished tree.
#pragma once

#include <zkd/statistics.hpp>
#include <zkd/tree.hpp>

namespace zkd::core {

/// Fills Statistics::depth, ::largest_leaf and ::sah_cost. One walk over the tree, one thread.
ZKD_API void measure_quality(const TreeView& tree, Statistics& statistics) noexcept;

}  // namespace zkd::core
