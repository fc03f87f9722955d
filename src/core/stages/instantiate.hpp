// SPDX-License-Identifier: Apache-2.0
//
// All stages that run on an executor, and how a backend makes them its own: it specialises
// core::BackendOf for its executor, then says ZKD_INSTANTIATE_STAGES(its executor).
#pragma once

#include <cstdint>
#include <span>

#include <zkd/stages.hpp>

#include "core/stages/boxes.hpp"       // IWYU pragma: export
#include "core/stages/compress.hpp"    // IWYU pragma: export
#include "core/stages/essential.hpp"   // IWYU pragma: export
#include "core/stages/morton.hpp"      // IWYU pragma: export
#include "core/stages/planes.hpp"      // IWYU pragma: export
#include "core/stages/recode.hpp"      // IWYU pragma: export
#include "core/stages/references.hpp"  // IWYU pragma: export
#include "core/stages/sort.hpp"        // IWYU pragma: export
#include "core/stages/split.hpp"       // IWYU pragma: export
#include "core/stages/trunks.hpp"      // IWYU pragma: export
#include "core/stages/validate.hpp"    // IWYU pragma: export

// At file scope.
#define ZKD_INSTANTIATE_STAGES(Executor)                                                        \
  namespace zkd::stages {                                                                       \
  template ZKD_API SceneSummary triangle_boxes(const Executor&, const TriangleView&,            \
                                               InvalidTriangles, std::span<Box>);               \
  template ZKD_API bool pays_to_split(const Executor&, std::span<const Box>, References);       \
  template ZKD_API Fragments split_triangles(const Executor&, const TriangleView&,              \
                                             std::span<const Box>, const Lattice&, float,       \
                                             std::span<Box>, std::span<std::uint32_t>);         \
  template ZKD_API void morton_encode(const Executor&, std::span<const Box>, const Lattice&,    \
                                      std::span<std::uint32_t>, std::span<std::uint32_t>);      \
  template ZKD_API void morton_encode(const Executor&, std::span<const Box>, const Lattice&,    \
                                      std::span<std::uint64_t>, std::span<std::uint32_t>);      \
  template ZKD_API std::uint32_t radix_sort(const Executor&, std::span<std::uint32_t>,          \
                                            std::span<std::uint32_t>, std::uint32_t);           \
  template ZKD_API std::uint32_t radix_sort(const Executor&, std::span<std::uint64_t>,          \
                                            std::span<std::uint32_t>, std::uint32_t);           \
  template ZKD_API std::uint32_t recode_crowded(const Executor&, std::span<const Box>,          \
                                                const Lattice&, std::span<const std::uint64_t>, \
                                                std::span<std::uint32_t>, std::uint32_t,        \
                                                AxisOrder, bool, std::span<TrunkKey>,           \
                                                std::span<std::uint32_t>, std::span<Lattice>);  \
  template ZKD_API std::uint32_t find_trunks(const Executor&, std::span<const TrunkKey>,        \
                                             std::uint32_t, std::span<std::uint32_t>);          \
  template ZKD_API void essential_nodes(const Executor&, std::span<const TrunkKey>,             \
                                        std::span<std::uint8_t>);                               \
  template ZKD_API Link path_compression(const Executor&, std::span<const TrunkKey>,            \
                                         std::span<const std::uint8_t>, std::span<Link>);       \
  template ZKD_API void split_planes(const Executor&, std::span<const TrunkKey>,                \
                                     std::span<const std::uint8_t>,                             \
                                     std::span<const std::uint32_t>, const Lattice&,            \
                                     std::span<const Lattice>, std::span<std::uint32_t>,        \
                                     std::span<float>);                                         \
  template ZKD_API std::uint64_t list_references(const Executor&, const TriangleView&,          \
                                                 std::span<const Box>, const Skeleton&,         \
                                                 const Lattice&, References,                    \
                                                 std::span<std::uint32_t>,                      \
                                                 std::span<std::uint32_t>, std::span<Box>);     \
  template ZKD_API SplitLeaves split_crowded_leaves(                                            \
      const Executor&, const TriangleView&, std::span<const Box>, std::span<const TrunkKey>,    \
      const Skeleton&, std::span<const std::uint32_t>, std::span<const std::uint32_t>,          \
      std::span<const Box>, std::uint32_t, AxisOrder, const StrictArrays&);                     \
  template ZKD_API void tight_boxes(const Executor&, std::span<const Box>, const Skeleton&,     \
                                    std::span<const std::uint32_t>,                             \
                                    std::span<const std::uint32_t>, std::span<Node>);           \
  template ZKD_API void tight_boxes(const Executor&, Link, std::span<const std::uint32_t>,      \
                                    std::span<const Box>, std::span<Node>);                     \
  }
