// SPDX-License-Identifier: Apache-2.0
//
// The scene's frame, made again from boxes: what a stage in the middle needs from the first.
#pragma once

#include <cstdint>
#include <span>

#include <zkd/geometry.hpp>

#include "core/frame.hpp"
#include "core/stages/input.hpp"
#include "core/validate.hpp"
#include "core/verbs.hpp"

namespace zkd::core {

struct MakeFrame {
  const ValidationReport* scene;
  SceneFrame* frame;
  ZKD_HOST_DEVICE void operator()(std::uint32_t) const { *frame = SceneFrame(scene->bounds); }
};

/// The frame of the scene that these boxes are of, in the backend's memory.
template <class Backend>
const SceneFrame* frame_of(Backend& backend, std::span<const Box> boxes) {
  auto* scene = backend.keep(ValidationReport{});
  auto* frame = backend.keep(SceneFrame{});
  backend.reduce(exactly(boxes.size()), scene, IncludeBox{boxes.data()});
  backend.for_each(one, MakeFrame{scene, frame});
  return frame;
}

}  // namespace zkd::core
