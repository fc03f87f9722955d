// SPDX-License-Identifier: Apache-2.0
//
// What a build counts and what stops it, in the backend's memory.
//
// A build that fails goes on with nothing: the counts that size its passes become 0, the tree is
// left empty, and the status says why. The CPU looks at once and throws; on a device nobody waits,
// and the tree's owner throws when asked (raise).
#pragma once

#include <cstdint>

#include <zkd/error.hpp>
#include <zkd/geometry.hpp>
#include <zkd/options.hpp>
#include <zkd/tree.hpp>

#include "core/validate.hpp"

namespace zkd::core {

/// Why a build came to no tree.
struct BuildStatus {
  std::uint32_t failed = 0;  ///< 1: yes
  ErrorCode code{};
  std::uint64_t offender = 0;    ///< as Error::offender
  std::uint64_t detail[2] = {};  ///< what else the message tells; see raise
};

/// Throws the Error that `status` stands for, if any. For a build over `triangles`.
ZKD_API void raise(const BuildStatus& status, const TriangleView& triangles);

/// Numbers that the scene decides.
struct BuildCounts {
  BuildStatus status;
  std::uint32_t given = 0;   ///< triangles; 0 after a failure
  std::uint32_t listed = 0;  ///< triangles that go into the tree
  std::uint32_t left_out = 0;
  std::uint32_t crowded_trunks = 0;
  std::uint32_t crowded_triangles = 0;
  std::uint32_t trunks = 0;
  std::uint32_t nodes = 0;
  std::uint32_t references = 0;
  std::uint32_t fragments = 0;         ///< places that stay empty included
  std::uint32_t splits = 0;            ///< 1: triangles are split
  std::uint32_t first_trunks = 0;      ///< `all`: before crowded leaves are split
  std::uint32_t first_references = 0;  ///< likewise
  std::uint32_t crowded_leaves = 0;
  std::uint32_t crowded_references = 0;  ///< in them
  std::uint32_t reference_trunks = 0;    ///< leaves after that
  std::uint32_t found_again = 0;         ///< references in those that crowded leaves became
  std::uint64_t references_needed = 0;
  std::uint64_t found_again_needed = 0;

  ZKD_HOST_DEVICE void fail(ErrorCode code, std::uint64_t offender, std::uint64_t first = 0,
                            std::uint64_t second = 0) {
    status = {1, code, offender, {first, second}};
    given = listed = left_out = trunks = nodes = references = fragments = first_references = 0;
    first_trunks = crowded_leaves = crowded_references = reference_trunks = found_again = 0;
  }
};

/// Stops a build that validation has found wrong. Out of range before not finite; of several
/// triangles, the first.
ZKD_HOST_DEVICE inline void judge(const ValidationReport& report, const TriangleView& triangles,
                                  InvalidTriangles invalid, BuildCounts& counts) {
  if (report.first_out_of_range != none_found) {
    const std::uint32_t first = report.first_out_of_range;
    int corner = 0;
    while (triangles.index(first, corner) < triangles.position_count) ++corner;
    counts.fail(ErrorCode::index_out_of_range, first, static_cast<std::uint64_t>(corner),
                triangles.index(first, corner));
  } else if (report.non_finite != 0 && invalid == InvalidTriangles::error) {
    counts.fail(ErrorCode::non_finite_vertex, report.first_non_finite, report.non_finite);
  }
}

/// Whether a tree may have as many references as it needs; stops the build if not.
struct AdmitReferences {
  BuildCounts* counts;
  std::uint32_t* references;  ///< in `counts`: how many there are
  std::uint64_t capacity;     ///< max_count, or less where room was made beforehand

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    const std::uint64_t needed = counts->references_needed;
    if (needed > max_count)
      counts->fail(ErrorCode::too_many_references, needed);
    else if (needed > capacity)
      counts->fail(ErrorCode::reference_capacity, needed, capacity);
    else
      *references = static_cast<std::uint32_t>(needed);
  }
};

/// The same for what is found below crowded leaves, before all are counted: stops the build only
/// where no tree can hold those alone. All are these and those of the other leaves.
struct AdmitFoundAgain {
  BuildCounts* counts;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    if (counts->found_again_needed > max_count)
      counts->fail(
          ErrorCode::too_many_references,
          counts->found_again_needed + (counts->first_references - counts->crowded_references));
    else
      counts->found_again = static_cast<std::uint32_t>(counts->found_again_needed);
  }
};

}  // namespace zkd::core
