// SPDX-License-Identifier: Apache-2.0
//
// Single stages on the CPU. All but the lattice, which needs no executor, are those of
// src/core/stages over the OpenMP backend.
#include <zkd/stages.hpp>

#include <string>

#include <zkd/error.hpp>

#include "core/frame.hpp"
#include "core/lattice.hpp"
#include "core/stages/instantiate.hpp"
#include "cpu/backend.hpp"
#include "cpu/float_environment.hpp"

template <>
struct zkd::core::BackendOf<zkd::cpu::Executor> {
  using type = cpu::Backend;
};

ZKD_INSTANTIATE_STAGES(cpu::Executor)

namespace zkd::stages {

Lattice make_lattice(const Box& bounds, std::uint32_t code_bits, AxisOrder order) {
  if (code_bits < 1 || code_bits > 64)
    throw Error(ErrorCode::invalid_option, code_bits,
                "code_bits is " + std::to_string(code_bits) + "; it must be 1 to 64");
  const cpu::FloatEnvironment environment;
  for (int a = 0; a < 3; ++a)
    if (!bounds.empty() && !(core::is_finite(bounds.lo[a]) && core::is_finite(bounds.hi[a])))
      throw Error(ErrorCode::invalid_view, static_cast<std::uint64_t>(a),
                  "bounds are not finite along axis " + std::to_string(a));
  return core::make_lattice(core::widen(bounds), code_bits, order, core::SceneFrame(bounds).finest);
}

}  // namespace zkd::stages
