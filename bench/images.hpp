// SPDX-License-Identifier: Apache-2.0
//
// --images: what the tree sees and what it costs, as pictures.
#pragma once

#include <filesystem>
#include <string>

#include <zkd/cpu/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/tree.hpp>

#include "scene/camera.hpp"

namespace zkd::bench {

/// Writes, size x size pixels, into `folder`:
///
///     <name>-shaded.png   flat shading with shadows, four samples a pixel
///     <name>-depth.png    distance, white near and dark far; black where nothing is
///     <name>-visits.png   node visits of the primary ray, scene::heat from 0 to white
///
/// Returns the number of visits drawn as white: the 99.9th percentile, so that a few dear rays do
/// not darken the rest. Throws std::runtime_error naming the file that cannot be written.
double write_images(const std::filesystem::path& folder, const std::string& name,
                    const TriangleView& triangles, const Tree& tree, const scene::Camera& camera,
                    unsigned size, const cpu::Executor& executor);

}  // namespace zkd::bench
