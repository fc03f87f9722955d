// SPDX-License-Identifier: Apache-2.0
//
// The device that calls to CUDA go to.
#pragma once

#include "cuda/error.hpp"

namespace zkd::cuda {

inline int current_device() {
  int device = 0;
  ZKD_CUDA_CHECK(cudaGetDevice(&device));
  return device;
}

/// Makes a device current, and at the end of its life the one that was.
class OnDevice {
 public:
  explicit OnDevice(int device) : before_(current_device()), changed_(device != before_) {
    if (changed_) ZKD_CUDA_CHECK(cudaSetDevice(device));
  }
  ~OnDevice() {
    if (changed_) (void)cudaSetDevice(before_);
  }
  OnDevice(const OnDevice&) = delete;
  OnDevice& operator=(const OnDevice&) = delete;

 private:
  int before_;
  bool changed_;
};

}  // namespace zkd::cuda
