// SPDX-License-Identifier: Apache-2.0
#include "cuda/default_memory.hpp"

#include "cuda/error.hpp"

namespace zkd::cuda {
namespace {

bool has_pools() {
  int device = 0;
  int supported = 0;
  ZKD_CUDA_CHECK(cudaGetDevice(&device));
  ZKD_CUDA_CHECK(cudaDeviceGetAttribute(&supported, cudaDevAttrMemoryPoolsSupported, device));
  return supported != 0;
}

class DefaultMemory final : public MemoryResource {
 public:
  void* allocate(std::size_t bytes, Stream stream) override {
    void* data = nullptr;
    const cudaError_t status =
        has_pools() ? cudaMallocAsync(&data, bytes, stream) : cudaMalloc(&data, bytes);
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
      const cudaError_t status = has_pools() ? cudaFreeAsync(data, stream) : cudaFree(data);
      if (status != cudaSuccess) (void)cudaGetLastError();
    } catch (const Error&) {
      return;
    }
  }
};

}  // namespace

MemoryResource& default_memory() {
  // Never destroyed: trees with static storage give memory back after it would have been.
  static auto& memory = *new DefaultMemory;
  return memory;
}

}  // namespace zkd::cuda
