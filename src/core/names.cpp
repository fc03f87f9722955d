// SPDX-License-Identifier: Apache-2.0
//
// The names of options, intersectors, stages and skips, and the reasons for those.
#include <zkd/cpu/executor.hpp>
#include <zkd/options.hpp>
#include <zkd/query.hpp>
#include <zkd/statistics.hpp>

#include <array>
#include <cstddef>

namespace zkd {
namespace {

template <class Enum, std::size_t n>
const char* name_of(const std::array<const char*, n>& names, Enum value) noexcept {
  const auto index = static_cast<std::size_t>(value);
  return index < n ? names[index] : "unknown";
}

}  // namespace

const char* to_string(Backend value) noexcept {
  return name_of(std::array{"auto", "cpu", "cuda"}, value);
}
const char* to_string(References value) noexcept {
  return name_of(std::array{"once", "budget", "all", "auto"}, value);
}
const char* to_string(Builder value) noexcept {
  return name_of(std::array{"morton", "sah", "wu2011"}, value);
}
const char* to_string(Quality value) noexcept {
  return name_of(std::array{"fast", "balanced", "high"}, value);
}
const char* to_string(InvalidTriangles value) noexcept {
  return name_of(std::array{"error", "skip"}, value);
}
const char* to_string(AxisOrder value) noexcept {
  return name_of(std::array{"extent", "cyclic"}, value);
}
const char* to_string(SahAreas value) noexcept {
  return name_of(std::array{"tight", "cells"}, value);
}
const char* to_string(Intersector value) noexcept {
  return name_of(std::array{"watertight", "fast", "single", "double", "exact"}, value);
}
const char* cpu::to_string(InstructionSet value) noexcept {
  return name_of(std::array{"auto", "portable", "avx2"}, value);
}
const char* to_string(Stage stage) noexcept {
  return name_of(std::array{"validate", "split", "encode", "sort", "clusters", "recode", "trunks",
                            "essential_nodes", "path_compression", "split_planes", "references",
                            "tight_boxes"},
                 stage);
}
const char* to_string(Skip skip) noexcept {
  return name_of(std::array{"radix passes", "flat axes", "wide codes", "splitting", "recoding",
                            "compaction", "subtrees"},
                 skip);
}
const char* reason(Skip skip, bool taken) noexcept {
  return taken ? name_of(
                     std::array{"every code has the same digit there", "nothing extends along them",
                                "few triangles: short codes tell them apart",
                                "boxes of much the same size, or all in each other",
                                "no crowded trunk", "no triangle left out", "no crowded leaf"},
                     skip)
               : name_of(
                     std::array{"codes differ in every digit", "the scene extends along every axis",
                                "many triangles: short codes would crowd them",
                                "boxes of different sizes: triangles were split",
                                "trunks are crowded", "triangles were left out or split",
                                "crowded leaves were split"},
                     skip);
}

}  // namespace zkd
