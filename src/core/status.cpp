// SPDX-License-Identifier: Apache-2.0
//
// The texts of what stops a build: each names the offender and what would be right.
#include "core/status.hpp"

#include <string>

namespace zkd::core {
namespace {

std::string text_of(const BuildStatus& status, const TriangleView& triangles) {
  const std::string offender = std::to_string(status.offender);
  const std::string detail[2] = {std::to_string(status.detail[0]),
                                 std::to_string(status.detail[1])};
  switch (status.code) {
    case ErrorCode::index_out_of_range:
      return "triangle " + offender + " has index " + detail[1] + " at corner " + detail[0] +
             ", but there are " + std::to_string(triangles.position_count) + " positions";
    case ErrorCode::non_finite_vertex:
      return "triangle " + offender + " has a NaN or infinite coordinate (" + detail[0] +
             " such triangles; InvalidTriangles::skip leaves them out)";
    case ErrorCode::too_many_references:
      return "References::all needs " + offender + " references, and a tree holds at most " +
             std::to_string(max_count);
    case ErrorCode::reference_capacity:
      return "References::all needs " + offender +
             " references, and BuildOptions::reference_capacity is " + detail[0];
    default:
      return to_string(status.code);
  }
}

}  // namespace

void raise(const BuildStatus& status, const TriangleView& triangles) {
  if (status.failed != 0) throw Error(status.code, status.offender, text_of(status, triangles));
}

}  // namespace zkd::core
