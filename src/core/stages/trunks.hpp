// SPDX-License-Identifier: Apache-2.0
//
// Stage 6 by itself: trunks.
#pragma once

#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"
#include "core/trunks.hpp"

namespace zkd::core {

/// Keys that are already made, in the place of SortedKeys.
struct GivenKeys {
  const TrunkKey* keys;
  ZKD_HOST_DEVICE void load() {}
  ZKD_HOST_DEVICE const TrunkKey& operator[](std::uint32_t i) const { return keys[i]; }
};

}  // namespace zkd::core

namespace zkd::stages {

template <class Executor>
std::uint32_t find_trunks(const Executor& executor, std::span<const TrunkKey> keys,
                          std::uint32_t leaf_size, std::span<std::uint32_t> first) {
  core::check_leaf_size(leaf_size);
  core::check_length(first.size(), keys.size(), "first");
  const core::Count count = core::exactly(keys.size());
  core::ExactBackendOf<Executor> backend(executor);
  const auto* key_count = backend.keep(count.bound);
  auto* trunks = backend.keep(std::uint32_t{0});
  backend.select(
      count, core::BeginsTrunk<core::GivenKeys>{core::GivenKeys{keys.data()}, key_count, leaf_size},
      first.data(), trunks);
  return backend.read(trunks);
}

}  // namespace zkd::stages
