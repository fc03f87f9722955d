// SPDX-License-Identifier: Apache-2.0
//
// Whether a device answers, and clocks for the stages of a build.
#include <zkd/cuda/executor.hpp>

#include <exception>
#include <string>

#include <zkd/cuda/build.hpp>

#include "cuda/error.hpp"

namespace zkd::cuda {
namespace {

/// What the library has code for: 10 * major + minor, after a 0. Machine code runs on devices of
/// the same major version from its minor version on, PTX on all later ones.
constexpr int machine_code[] = {ZKD_CUDA_MACHINE_CODE};
constexpr int ptx[] = {ZKD_CUDA_PTX};

bool has_code_for(int capability) {
  for (const int code : machine_code)
    if (code / 10 == capability / 10 && code <= capability) return true;
  for (const int code : ptx)
    if (code != 0 && code <= capability) return true;
  return false;
}

void find_device() {
  int count = 0;
  ZKD_CUDA_CHECK(cudaGetDeviceCount(&count));
  int device = 0;
  int major = 0;
  int minor = 0;
  ZKD_CUDA_CHECK(cudaGetDevice(&device));
  ZKD_CUDA_CHECK(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
  ZKD_CUDA_CHECK(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device));
  if (!has_code_for(10 * major + minor))
    throw Error(ErrorCode::backend_unavailable, 0,
                "the device has compute capability " + std::to_string(major) + "." +
                    std::to_string(minor) + ", for which this zkd was not compiled");
}

}  // namespace

bool available(std::string* why) noexcept {
  try {
    find_device();
    return true;
  } catch (const std::exception& error) {
    try {
      if (why != nullptr) *why = error.what();
    } catch (const std::exception&) {
      return false;  // no memory for the reason
    }
    return false;
  }
}

StageTimer::StageTimer() {
  try {
    for (CUevent_st*& event : events_) ZKD_CUDA_CHECK(cudaEventCreate(&event));
  } catch (...) {
    for (CUevent_st* event : events_)
      if (event != nullptr) (void)cudaEventDestroy(event);
    throw;
  }
}

StageTimer::~StageTimer() {
  for (CUevent_st* event : events_) (void)cudaEventDestroy(event);
}

void StageTimer::mark(Stage next, Stream stream) {
  cudaStreamCaptureStatus capture = cudaStreamCaptureStatusNone;
  ZKD_CUDA_CHECK(cudaStreamIsCapturing(stream, &capture));
  complete_ = next == Stage::count && capture == cudaStreamCaptureStatusNone;
  if (capture != cudaStreamCaptureStatusNone) return;
  // Stages that a builder does not have begin and end here.
  if (next == Stage::validate) marked_ = 0;
  for (; marked_ <= static_cast<std::size_t>(next); ++marked_)
    ZKD_CUDA_CHECK(cudaEventRecord(events_[marked_], stream));
}

std::array<double, static_cast<std::size_t>(Stage::count)> StageTimer::stage_ms() const {
  std::array<double, static_cast<std::size_t>(Stage::count)> times{};
  if (!complete_) return times;
  ZKD_CUDA_CHECK(cudaEventSynchronize(events_[events - 1]));
  for (std::size_t stage = 0; stage + 1 < events; ++stage) {
    float ms = 0.0F;
    ZKD_CUDA_CHECK(cudaEventElapsedTime(&ms, events_[stage], events_[stage + 1]));
    times[stage] = static_cast<double>(ms);
  }
  return times;
}

}  // namespace zkd::cuda
