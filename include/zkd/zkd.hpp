// SPDX-License-Identifier: Apache-2.0
//
// Everything a program that builds and traces trees on the CPU needs.
#pragma once

#include <zkd/build.hpp>            // IWYU pragma: export
#include <zkd/config.hpp>           // IWYU pragma: export
#include <zkd/cpu/executor.hpp>     // IWYU pragma: export
#include <zkd/cpu/plane_tree.hpp>   // IWYU pragma: export
#include <zkd/cpu/wide_tree.hpp>    // IWYU pragma: export
#include <zkd/error.hpp>            // IWYU pragma: export
#include <zkd/geometry.hpp>         // IWYU pragma: export
#include <zkd/hits.hpp>             // IWYU pragma: export
#include <zkd/lattice.hpp>          // IWYU pragma: export
#include <zkd/options.hpp>          // IWYU pragma: export
#include <zkd/query.hpp>            // IWYU pragma: export
#include <zkd/statistics.hpp>       // IWYU pragma: export
#include <zkd/tree.hpp>             // IWYU pragma: export
#include <zkd/tree_statistics.hpp>  // IWYU pragma: export
