// SPDX-License-Identifier: Apache-2.0
//
// Stage 5 by itself: crowded trunks.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/key.hpp"
#include "core/recode.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/frame.hpp"
#include "core/stages/input.hpp"
#include "core/verbs.hpp"

namespace zkd::stages {

template <class Executor>
std::uint32_t recode_crowded(const Executor& executor, std::span<const Box> boxes,
                             const Lattice& lattice, std::span<const std::uint64_t> codes,
                             std::span<std::uint32_t> ids, std::uint32_t leaf_size, AxisOrder order,
                             bool enabled, std::span<TrunkKey> keys, std::span<std::uint32_t> crowd,
                             std::span<Lattice> lattices) {
  core::check_leaf_size(leaf_size);
  core::check_length(ids.size(), codes.size(), "ids");
  core::check_length(keys.size(), codes.size(), "keys");
  core::check_length(crowd.size(), codes.size(), "crowd");
  const core::Count count = core::exactly(codes.size());
  using Backend = core::ExactBackendOf<Executor>;
  Backend backend(executor);
  core::check_each(backend, count, "ids", core::IsNotBelow{ids.data(), boxes.size()});

  auto* trunks = backend.keep(std::uint32_t{0});
  auto* crowded = backend.keep(std::uint32_t{0});
  core::SecondRound<std::uint64_t, Backend> round{
      boxes.data(),
      codes.data(),
      ids.data(),
      {backend.keep(count.bound), count.bound},
      leaf_size,
      order,
      core::frame_of(backend, boxes),
      trunks,
      crowded,
      backend.template take_array<std::uint32_t>(count.bound),
      backend.template take_array<std::uint32_t>(count.bound)};
  if (enabled) round.run(backend);

  backend.for_each(count, core::Fill{crowd.data(), no_crowd});
  backend.for_each(core::Count{crowded, count.bound},
                   core::NumberCrowd{round.members(), crowd.data()});
  const auto* code_bits = backend.keep(lattice.code_bits);
  const core::SortedKeys<std::uint64_t> sorted{codes.data(), round.work.fine, code_bits};
  backend.for_each(count, core::WriteKey<std::uint64_t>{sorted, keys.data()});
  const std::uint32_t found = backend.read(trunks);
  const std::size_t fit = std::min<std::size_t>(found, lattices.size());
  backend.for_each(core::exactly(fit), core::CopyTo<Lattice>{round.work.lattices, lattices.data()});
  backend.wait();
  return found;
}

}  // namespace zkd::stages
