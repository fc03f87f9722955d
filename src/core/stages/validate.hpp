// SPDX-License-Identifier: Apache-2.0
//
// Stage 1 by itself: validation and scene box.
#pragma once

#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/check_input.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"
#include "core/status.hpp"
#include "core/validate.hpp"

namespace zkd::core {

/// Passes judgement where the triangles are.
struct Judge {
  const ValidationReport* report;
  TriangleView triangles;
  InvalidTriangles invalid;
  BuildCounts* counts;

  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    judge(*report, triangles, invalid, *counts);
  }
};

}  // namespace zkd::core

namespace zkd::stages {

template <class Executor>
SceneSummary triangle_boxes(const Executor& executor, const TriangleView& triangles,
                            InvalidTriangles invalid, std::span<Box> boxes) {
  core::check_view(triangles);
  core::check_length(boxes.size(), triangles.triangle_count, "boxes");
  core::ExactBackendOf<Executor> backend(executor);
  auto* found = backend.keep(core::ValidationReport{});
  auto* counts = backend.keep(core::BuildCounts{});
  backend.reduce(core::exactly(boxes.size()), found,
                 core::ValidateTriangle{triangles, boxes.data()});
  backend.for_each(core::one, core::Judge{found, triangles, invalid, counts});
  backend.raise(&counts->status, triangles);
  const core::ValidationReport report = backend.read(found);
  return {report.bounds, report.valid, report.zero_area, report.non_finite};
}

}  // namespace zkd::stages
