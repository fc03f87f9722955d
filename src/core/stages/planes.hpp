// SPDX-License-Identifier: Apache-2.0
//
// Stage 9 by itself: split planes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/key.hpp"
#include "core/morton.hpp"
#include "core/planes.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"

namespace zkd::core {

/// A node that splits the lattice of a crowded trunk that was not given.
struct LacksLattice {
  const std::uint8_t* levels;
  const std::uint32_t* crowd;
  std::size_t lattices;
  ZKD_HOST_DEVICE bool operator()(std::uint32_t node) const {
    return levels[node] >= first_fine_level && crowd[node + 1] >= lattices;
  }
};

}  // namespace zkd::core

namespace zkd::stages {

template <class Executor>
void split_planes(const Executor& executor, std::span<const TrunkKey> trunk_keys,
                  std::span<const std::uint8_t> levels, std::span<const std::uint32_t> crowd,
                  const Lattice& lattice, std::span<const Lattice> lattices,
                  std::span<std::uint32_t> axes, std::span<float> planes) {
  const core::Count nodes = core::nodes_between(trunk_keys.size());
  core::check_length(levels.size(), nodes.bound, "levels");
  core::check_length(crowd.size(), trunk_keys.size(), "crowd");
  core::check_length(axes.size(), nodes.bound, "axes");
  core::check_length(planes.size(), nodes.bound, "planes");
  core::ExactBackendOf<Executor> backend(executor);
  core::check_each(backend, nodes, "crowd",
                   core::LacksLattice{levels.data(), crowd.data(), lattices.size()});
  const double unscaled = 1.0;
  backend.for_each(nodes, core::PlaceSplitPlane<core::LatticePlanes, core::CrowdByTrunk>{
                              trunk_keys.data(),
                              levels.data(),
                              {backend.keep(lattice), backend.keep(core::MortonCoder(lattice))},
                              {crowd.data(), lattices.data()},
                              backend.keep(unscaled),
                              {axes.data(), planes.data(), 1}});
  backend.wait();
}

}  // namespace zkd::stages
