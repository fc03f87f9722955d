// SPDX-License-Identifier: Apache-2.0
//
// Builds that name no executor: host memory in, host memory out, on a stream of their own.
#include <chrono>

#include <zkd/cuda/build.hpp>

#include "core/cuda_entry.hpp"
#include "core/outcome.hpp"
#include "cuda/error.hpp"

namespace zkd::cuda {
namespace {

class OwnStream {
 public:
  OwnStream() { ZKD_CUDA_CHECK(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  ~OwnStream() { (void)cudaStreamDestroy(stream_); }
  OwnStream(const OwnStream&) = delete;
  OwnStream& operator=(const OwnStream&) = delete;

  [[nodiscard]] Stream get() const { return stream_; }

 private:
  Stream stream_ = nullptr;
};

zkd::Tree build_for_host(const TriangleView& triangles, const BuildOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const OwnStream stream;
  StageTimer timer;
  const Executor executor{.stream = stream.get(), .timer = &timer};
  BuildOptions enough = options;
  if (options.references == References::all && options.reference_capacity == 0)
    enough.reference_capacity =
        analyse(Executor{.stream = stream.get()}, triangles, options).reference_capacity;
  zkd::Tree tree = build(executor, triangles, enough).to_host();
  Statistics& statistics = TreeAssembler::statistics(tree);
  statistics.stage_ms = timer.stage_ms();
  statistics.total_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return tree;
}

constexpr core::CudaEntry entry{&available, &build_for_host};

}  // namespace
}  // namespace zkd::cuda

const zkd::core::CudaEntry* zkd_cuda_entry() { return &zkd::cuda::entry; }
