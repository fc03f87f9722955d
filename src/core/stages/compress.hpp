// SPDX-License-Identifier: Apache-2.0
//
// Stage 8 by itself: path compression.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/compress.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"

namespace zkd::stages {

template <class Executor>
Link path_compression(const Executor& executor, std::span<const TrunkKey> trunk_keys,
                      std::span<const std::uint8_t> levels, std::span<Link> children) {
  const core::Count trunks = core::exactly(trunk_keys.size());
  const core::Count nodes = core::nodes_between(trunk_keys.size());
  core::check_length(levels.size(), nodes.bound, "levels");
  core::check_length(children.size(), std::size_t{nodes.bound} * 2, "children");
  core::ExactBackendOf<Executor> backend(executor);
  auto* root = backend.keep(Link{});
  const core::LinkWriter writer{children.data(), 2,    nullptr,
                                nullptr,         root, backend.keep(trunks.bound)};
  backend.for_each(trunks, core::LinkTrunk{levels.data(), writer});
  backend.for_each(nodes, core::LinkEssentialNode{trunk_keys.data(), levels.data(), writer});
  return backend.read(root);
}

}  // namespace zkd::stages
