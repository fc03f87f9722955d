// SPDX-License-Identifier: Apache-2.0
//
// Builds on a CUDA device, and what a tree there says about its build.
#include <zkd/cuda/build.hpp>

#include "cuda/build_steps.hpp"
#include "cuda/current_device.hpp"
#include "cuda/device.cuh"
#include "cuda/transfer.hpp"

namespace zkd {

cuda::Tree build(const cuda::Executor& executor, const TriangleView& triangles,
                 const BuildOptions& options) {
  cuda::Device device(executor);
  return cuda::build_on(device, executor, triangles, options);
}

void rebuild(const cuda::Executor& executor, cuda::Tree& tree, const TriangleView& triangles) {
  cuda::Device device(executor);
  cuda::rebuild_on(device, executor, tree, triangles);
}

BuildOptions analyse(const cuda::Executor& executor, const TriangleView& triangles,
                     const BuildOptions& options) {
  cuda::Device device(executor);
  return cuda::analyse_on(device, executor, triangles, options);
}

MemoryRequirement memory_requirement(const cuda::Executor& executor, std::uint64_t triangle_count,
                                     const BuildOptions& options) {
  cuda::Device device(executor);
  return cuda::requirement(device, triangle_count, options);
}

namespace cuda {

Tree to_device(const Executor& executor, const zkd::Tree& tree, const TriangleView& triangles) {
  core::check_view(triangles);
  Device device(executor);
  return copy_to_device(device, tree, triangles);
}

namespace {

/// The device of a tree, to ask what its last build came to.
class TreeDevice {
 public:
  TreeDevice(int number, Stream stream, bool incomplete)
      : on_(number), device_(Executor{.stream = stream}) {
    if (incomplete)
      throw Error(ErrorCode::device_failure, 0, "the last rebuild of this tree threw half-way");
  }
  operator Device&() { return device_; }

 private:
  OnDevice on_;
  Device device_;
};

}  // namespace

void Tree::check() const { check(stream_); }

void Tree::check(Stream stream) const {
  if (record_ == nullptr) return;
  TreeDevice device(device_, stream, incomplete_);
  (void)checked_state<Device>(device, *this, record_);
}

Statistics Tree::statistics() const {
  if (record_ == nullptr) return {};
  TreeDevice device(device_, stream_, incomplete_);
  return statistics_of(*this, checked_state<Device>(device, *this, record_), workspace_bytes_);
}

Lattice Tree::lattice() const {
  if (record_ == nullptr) return {};
  TreeDevice device(device_, stream_, incomplete_);
  return checked_state<Device>(device, *this, record_).lattice;
}

zkd::Tree Tree::to_host(std::pmr::memory_resource* memory) const {
  if (record_ == nullptr) return {};
  TreeDevice device(device_, stream_, incomplete_);
  return copy_to_host<Device>(device, *this, record_, workspace_bytes_, memory);
}

}  // namespace cuda
}  // namespace zkd
