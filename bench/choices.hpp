// SPDX-License-Identifier: Apache-2.0
//
// Everything that can be chosen by name on more than one command line.
#pragma once

#include <array>

#include <zkd/options.hpp>
#include <zkd/query.hpp>

namespace zkd::bench {

inline constexpr std::array all_backends{Backend::automatic, Backend::cpu, Backend::cuda};

inline constexpr std::array all_intersectors{Intersector::watertight, Intersector::fast,
                                             Intersector::single_precision,
                                             Intersector::double_precision, Intersector::exact};

}  // namespace zkd::bench
