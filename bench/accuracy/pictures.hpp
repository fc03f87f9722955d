// SPDX-License-Identifier: Apache-2.0
//
// Where errors are: data for bench/accuracy/plot to draw.
#pragma once

#include <cstdint>
#include <filesystem>

#include <zkd/cpu/executor.hpp>

#include "scenes.hpp"

namespace zkd::bench::accuracy {

/// size * size primary rays of the scene's camera through the literal tree, held against the
/// oracle. Writes into `folder`:
///
///     <scene>-shade.pgm    what there is to see, 8 bits a ray
///     <scene>-literal.pgm  255: missed; 128: another triangle than the nearest; 0: right
void write_literal_errors(const std::filesystem::path& folder, const TestScene& scene,
                          const verify::Oracle& oracle, unsigned size,
                          const cpu::Executor& executor);

/// From inside a closed sphere, `rays` rays at each vertex that lies ahead. Writes
/// `<folder>/vertices.csv`: x, y, z of the vertex as seen from the centre, rays, and how many of
/// them zkd, and each Embree that this program has, let through.
void write_vertex_leaks(const std::filesystem::path& folder, unsigned rays, std::uint64_t seed,
                        const cpu::Executor& executor);

}  // namespace zkd::bench::accuracy
