// SPDX-License-Identifier: Apache-2.0
//
// Where CPU work runs and whose memory it uses.
#pragma once

#include <memory_resource>

#include <zkd/config.hpp>

namespace zkd::cpu {

/// Which instructions the inner loops use. Every choice gives the same bits.
enum class InstructionSet {
  automatic,  ///< the best of those below that the processor has
  portable,   ///< what the library was compiled for
  avx2,       ///< AVX2, FMA and BMI2; falls back to portable where the processor lacks them
};

/// "auto", "portable" or "avx2": the names used on command lines and in JSON. Static storage.
ZKD_API const char* to_string(InstructionSet value) noexcept;

/// Passed to build(), to queries over spans and to stages. A value: copy it freely. One executor
/// may be used by several threads at once if its memory resource may.
struct Executor {
  /// OpenMP threads of a call; 0: as many as OpenMP would take (OMP_NUM_THREADS, or all cores).
  /// build() throws invalid_option for a negative number; everything else takes it for 0.
  int threads = 0;

  /// All arrays of a call come from here; null: the default resource at the time of the call
  /// (std::pmr::get_default_resource()). Only what OpenMP keeps for its threads and the text of an
  /// Error come from elsewhere. Not owned; it must outlive the trees built with it. It is only ever
  /// called from the calling thread.
  std::pmr::memory_resource* memory = nullptr;

  InstructionSet instructions = InstructionSet::automatic;
};

}  // namespace zkd::cpu
