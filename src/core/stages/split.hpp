// SPDX-License-Identifier: Apache-2.0
//
// Between stages 2 and 3 by itself: whether triangles are worth splitting, and their fragments.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/area.hpp"
#include "core/check_input.hpp"
#include "core/split.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"
#include "core/status.hpp"
#include "core/unevenness.hpp"
#include "core/validate.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

struct ClassOfSize {
  const Box* boxes;
  ZKD_HOST_DEVICE std::uint32_t operator()(std::uint32_t triangle) const {
    const Box& box = boxes[triangle];
    return box.empty() ? SizeClasses::count : SizeClasses::of(half_area(box));
  }
};

struct MeasureUnevenness {
  const std::uint32_t* classes;
  const ValidationReport* scene;
  double* unevenness;
  ZKD_HOST_DEVICE void operator()(std::uint32_t) const {
    *unevenness = unevenness_of(classes, scene->bounds, scene->valid);
  }
};

}  // namespace zkd::core

namespace zkd::stages {

template <class Executor>
bool pays_to_split(const Executor& executor, std::span<const Box> boxes, References policy) {
  core::check_policy(policy);
  if (!core::splits_if_uneven(policy)) return policy == References::budget;
  const core::Count count = core::exactly(boxes.size());
  core::ExactBackendOf<Executor> backend(executor);
  auto* scene = backend.keep(core::ValidationReport{});
  auto* unevenness = backend.keep(0.0);
  auto* classes = backend.template take_array<std::uint32_t>(core::SizeClasses::count);
  backend.reduce(count, scene, core::IncludeBox{boxes.data()});
  backend.histogram(count, core::ClassOfSize{boxes.data()}, core::SizeClasses::count, classes);
  backend.for_each(core::one, core::MeasureUnevenness{classes, scene, unevenness});
  return core::is_uneven(policy, backend.read(unevenness));
}

template <class Executor>
Fragments split_triangles(const Executor& executor, const TriangleView& triangles,
                          std::span<const Box> boxes, const Lattice& lattice, float budget,
                          std::span<Box> fragments, std::span<std::uint32_t> owners) {
  BuildOptions options;
  options.references = References::budget;
  options.budget = budget;
  core::check_options(options);
  core::check_view(triangles);
  core::check_length(boxes.size(), triangles.triangle_count, "boxes");
  const core::Count given = core::exactly(boxes.size());
  using Backend = core::ExactBackendOf<Executor>;
  Backend backend(executor);
  auto* scene = backend.keep(core::ValidationReport{});
  backend.reduce(given, scene, core::IncludeBox{boxes.data()});
  core::BuildCounts known;
  known.given = given.bound;
  known.listed = backend.read(scene).valid;
  known.splits = 1;
  auto* counts = backend.keep(known);

  const std::uint32_t most = core::most_fragments(budget, given.bound);
  core::SplitWorkspace work{};
  backend.take(work, given.bound, most);
  backend.for_each(given, core::CopyTo<Box>{boxes.data(), work.boxes});
  auto* made = backend.template take_array<Box>(most);
  core::SplitAll<Backend>{triangles, work, backend.keep(lattice), &scene->bounds, counts,
                          budget,    made}
      .run(backend);
  const core::Count places = core::exactly(backend.read(&counts->fragments));
  auto* result = backend.keep(core::ValidationReport{});
  backend.reduce(places, result, core::IncludeBox{made});
  const auto fitting = [&](std::size_t room) {
    return core::exactly(std::min<std::size_t>(room, places.bound));
  };
  backend.for_each(fitting(fragments.size()), core::CopyTo<Box>{made, fragments.data()});
  backend.for_each(fitting(owners.size()), core::CopyTo<std::uint32_t>{work.owners, owners.data()});
  return {places.bound, backend.read(result).valid};
}

}  // namespace zkd::stages
