// SPDX-License-Identifier: Apache-2.0
//
// Which device answers, and what drives it.
#include <cuda_runtime_api.h>
#include <dlfcn.h>

#include <array>
#include <string>

#include <zkd/cuda/build.hpp>

#include "cuda.hpp"

namespace zkd::bench {
namespace {

// 13000 as `13.0`.
std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

// The driver's own version, from the management library that comes with it. It is loaded by hand:
// a program linked to it would not start on a machine without a driver.
std::optional<std::string> driver_version() {
  void* const library = dlopen("libnvidia-ml.so.1", RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return std::nullopt;
  using Init = int (*)();
  using Version = int (*)(char*, unsigned);
  const auto init = reinterpret_cast<Init>(dlsym(library, "nvmlInit_v2"));
  const auto version = reinterpret_cast<Version>(dlsym(library, "nvmlSystemGetDriverVersion"));
  const auto shutdown = reinterpret_cast<Init>(dlsym(library, "nvmlShutdown"));
  std::optional<std::string> text;
  if (init != nullptr && version != nullptr && shutdown != nullptr && init() == 0) {
    std::array<char, 96> buffer{};
    if (version(buffer.data(), static_cast<unsigned>(buffer.size() - 1)) == 0) text = buffer.data();
    (void)shutdown();
  }
  dlclose(library);
  return text;
}

}  // namespace

std::string why_no_cuda() {
  std::string why;
  if (cuda::available(&why)) return "";
  return why.empty() ? "no CUDA device answers" : why;
}

void describe_device(Machine& machine) {
  int device = 0;
  cudaDeviceProp properties{};
  if (cudaGetDevice(&device) == cudaSuccess &&
      cudaGetDeviceProperties(&properties, device) == cudaSuccess) {
    machine.gpu = properties.name;
    machine.compute_capability =
        std::to_string(properties.major) + "." + std::to_string(properties.minor);
    machine.multiprocessors = static_cast<std::uint64_t>(properties.multiProcessorCount);
    machine.gpu_memory_bytes = properties.totalGlobalMem;
  }
  int version = 0;
  if (cudaRuntimeGetVersion(&version) == cudaSuccess) machine.cuda = version_text(version);
  machine.driver = driver_version();
  if (cudaDriverGetVersion(&version) == cudaSuccess && version > 0) {
    const std::string supports = "CUDA " + version_text(version);
    machine.driver = machine.driver ? *machine.driver + " (" + supports + ")" : supports;
  }
  (void)cudaGetLastError();
}

}  // namespace zkd::bench
