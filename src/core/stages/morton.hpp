// SPDX-License-Identifier: Apache-2.0
//
// Stage 3 by itself: Morton encoding.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <zkd/error.hpp>
#include <zkd/stages.hpp>

#include "core/morton.hpp"
#include "core/stages/backend.hpp"
#include "core/stages/input.hpp"
#include "core/validate.hpp"

namespace zkd::core {

template <class Code, class Executor>
void encode_alone(const Executor& executor, std::span<const Box> boxes, const Lattice& lattice,
                  std::span<Code> codes, std::span<std::uint32_t> ids) {
  check_length(ids.size(), codes.size(), "ids");
  if (lattice.code_bits > 8 * sizeof(Code))
    throw Error(ErrorCode::invalid_option, lattice.code_bits,
                "codes of " + std::to_string(lattice.code_bits) + " bits do not fit into " +
                    std::to_string(8 * sizeof(Code)));
  ExactBackendOf<Executor> backend(executor);
  // There may be more than the caller made room for.
  auto* listed = backend.template take_array<std::uint32_t>(boxes.size());
  auto* total = backend.keep(std::uint32_t{0});
  backend.select(exactly(boxes.size()), IsListed{boxes.data()}, listed, total);
  const Count count = exactly(backend.read(total));
  check_length(codes.size(), count.bound, "codes");
  const auto* coder = backend.keep(MortonCoder(lattice));
  backend.for_each(count, CopyTo<std::uint32_t>{listed, ids.data()});
  backend.for_each(count, EncodeTriangle<Code>{boxes.data(), ids.data(), coder, codes.data()});
  backend.wait();
}

}  // namespace zkd::core

namespace zkd::stages {

template <class Executor>
void morton_encode(const Executor& executor, std::span<const Box> boxes, const Lattice& lattice,
                   std::span<std::uint32_t> codes, std::span<std::uint32_t> ids) {
  core::encode_alone(executor, boxes, lattice, codes, ids);
}

template <class Executor>
void morton_encode(const Executor& executor, std::span<const Box> boxes, const Lattice& lattice,
                   std::span<std::uint64_t> codes, std::span<std::uint32_t> ids) {
  core::encode_alone(executor, boxes, lattice, codes, ids);
}

}  // namespace zkd::stages
