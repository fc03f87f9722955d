// SPDX-License-Identifier: Apache-2.0
//
// Where CUDA work runs and whose memory it uses. No header of CUDA is needed to include this one.
#pragma once

#include <array>
#include <cstddef>

#include <zkd/config.hpp>
#include <zkd/statistics.hpp>

struct CUstream_st;
struct CUevent_st;

namespace zkd::cuda {

/// A cudaStream_t.
using Stream = CUstream_st*;

/// Device memory in the order of a stream: what is allocated may be used by work enqueued on
/// `stream` after the call, and what is deallocated is still used by work enqueued before it. A
/// program's own pool derives from this (rmm's stream_ordered resources have the same two
/// functions).
class ZKD_API MemoryResource {
 public:
  MemoryResource() = default;
  MemoryResource(const MemoryResource&) = default;
  MemoryResource& operator=(const MemoryResource&) = default;
  virtual ~MemoryResource();

  /// At least `bytes` (more than 0) bytes on the device that is current, aligned to 256. Throws
  /// std::bad_alloc, or anything else, where there are none: build() makes out_of_memory of it.
  [[nodiscard]] virtual void* allocate(std::size_t bytes, Stream stream) = 0;

  /// Takes back what allocate() gave for the same number of bytes.
  virtual void deallocate(void* data, std::size_t bytes, Stream stream) noexcept = 0;
};

/// How long each stage of a build took on the device. Takes its readings between stages, as events
/// on the stream: a few microseconds each, so total times are taken without it. Not for use by two
/// builds at once. A build that a graph captures is not timed.
class ZKD_API StageTimer {
 public:
  /// Makes its events on the current device. Throws Error backend_unavailable, device_failure.
  StageTimer();
  ~StageTimer();
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

  /// Milliseconds of each stage in the last build that had this timer; blocks until that build has
  /// ended. Zeros if there was none. Throws Error device_failure.
  [[nodiscard]] std::array<double, static_cast<std::size_t>(Stage::count)> stage_ms() const;

  /// For the build: `next` begins now on `stream`; Stage::count: the last one has ended.
  void mark(Stage next, Stream stream);

 private:
  static constexpr std::size_t events = static_cast<std::size_t>(Stage::count) + 1;
  CUevent_st* events_[events] = {};
  std::size_t marked_ = 0;  // events of the build that runs
  bool complete_ = false;
};

/// Passed to build(), to queries and to stages. A value: copy it freely. Work runs on the device
/// that is current when the call is made, which must be the stream's. A call may clear an error of
/// an earlier CUDA call that the program has not asked for yet (cudaGetLastError).
struct Executor {
  /// Work is enqueued here, in order. Null: the default stream.
  Stream stream = nullptr;

  /// What a build allocates comes from here; null: cudaMallocAsync from the device's default pool
  /// (cudaMalloc on devices that have no pools), which gives memory back to the system whenever the
  /// program synchronises, unless its release threshold is raised. Not owned; it must outlive the
  /// trees built with it.
  MemoryResource* memory = nullptr;

  /// Device memory for what a build needs besides its tree, aligned to 256; null: allocated for the
  /// call. memory_requirement() says how much is enough. It may be used again for anything that is
  /// enqueued on the stream afterwards. With it rebuild() allocates nothing.
  void* workspace = nullptr;
  std::size_t workspace_bytes = 0;

  /// Filled by builds; null: no stage is timed.
  StageTimer* timer = nullptr;
};

}  // namespace zkd::cuda
