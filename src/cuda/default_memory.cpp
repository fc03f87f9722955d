// SPDX-License-Identifier: Apache-2.0
#include "cuda/default_memory.hpp"

#include <map>
#include <mutex>

#include "cuda/current_device.hpp"

namespace zkd::cuda {
namespace {

class DefaultMemory final : public MemoryResource {
 public:
  explicit DefaultMemory(int device) : device_(device) {
    int supported = 0;
    ZKD_CUDA_CHECK(cudaDeviceGetAttribute(&supported, cudaDevAttrMemoryPoolsSupported, device));
    has_pools_ = supported != 0;
  }

  void* allocate(std::size_t bytes, Stream stream) override {
    const OnDevice on(device_);
    void* data = nullptr;
    const cudaError_t status =
        has_pools_ ? cudaMallocAsync(&data, bytes, stream) : cudaMalloc(&data, bytes);
    if (status == cudaErrorMemoryAllocation) {
      (void)cudaGetLastError();
      return nullptr;
    }
    check(status, "cudaMallocAsync", __FILE__, __LINE__);
    return data;
  }

  void deallocate(void* data, std::size_t, Stream stream) noexcept override {
    // Nobody could do anything about a failure; it must not come up in a later call either.
    try {
      const OnDevice on(device_);
      const cudaError_t status = has_pools_ ? cudaFreeAsync(data, stream) : cudaFree(data);
      if (status != cudaSuccess) (void)cudaGetLastError();
    } catch (const Error&) {
      return;
    }
  }

 private:
  int device_;
  bool has_pools_ = false;
};

}  // namespace

MemoryResource& default_memory(int device) {
  // Never destroyed: trees with static storage give memory back after they would have been.
  static auto& mutex = *new std::mutex;
  static auto& memories = *new std::map<int, DefaultMemory>;
  const std::lock_guard lock(mutex);
  return memories.try_emplace(device, device).first->second;
}

}  // namespace zkd::cuda
