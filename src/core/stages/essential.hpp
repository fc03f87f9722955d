// SPDX-License-Identifier: Apache-2.0
//
// Stage 7 by itself: essential nodes.
#pragma once

#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/essential.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"

namespace zkd::stages {

template <class Executor>
void essential_nodes(const Executor& executor, std::span<const TrunkKey> trunk_keys,
                     std::span<std::uint8_t> levels) {
  const core::Count nodes = core::nodes_between(trunk_keys.size());
  core::check_length(levels.size(), nodes.bound, "levels");
  core::ExactBackendOf<Executor> backend(executor);
  backend.for_each(nodes, core::EssentialLevel{trunk_keys.data(), levels.data()});
  backend.wait();
}

}  // namespace zkd::stages
