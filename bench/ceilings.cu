// SPDX-License-Identifier: Apache-2.0
//
// zkd-bench-ceilings: what this device does at best with the pieces a build is made of, to hold
// zkd's times against. Bandwidth of a large copy, CUB's radix sort at the sizes of the scenes, and
// what launching costs when there is no work at all. JSON on standard output.
//
//     zkd-bench-ceilings [PAIRS ...]      sizes of the sorts; default: triangles of the paper
//
// Exit status 0: done; 2: bad usage; 3: no device, or CUDA failed. One line on stderr.
#include <cuda_runtime.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cub/device/device_radix_sort.cuh>
#include <vector>

namespace {

void check(cudaError_t status, const char* call) {
  if (status == cudaSuccess) return;
  std::fprintf(stderr, "zkd-bench-ceilings: error: %s: %s\n", call, cudaGetErrorString(status));
  std::exit(3);
}
#define ZKD_CHECK(call) check(call, #call)

struct Spread {
  double median, least, most;
};

Spread spread_of(std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  return {ms[ms.size() / 2], ms.front(), ms.back()};
}

class Stopwatch {
 public:
  double ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

cudaStream_t stream;
cudaEvent_t begin_event;
cudaEvent_t end_event;

// Milliseconds by the device's clock of what `work` enqueues on the stream, which is idle before.
template <class Work>
double time(const Work& work) {
  ZKD_CHECK(cudaStreamSynchronize(stream));
  ZKD_CHECK(cudaEventRecord(begin_event, stream));
  work();
  ZKD_CHECK(cudaEventRecord(end_event, stream));
  ZKD_CHECK(cudaEventSynchronize(end_event));
  float ms = 0.0F;
  ZKD_CHECK(cudaEventElapsedTime(&ms, begin_event, end_event));
  return static_cast<double>(ms);
}

// The first few are not kept.
template <class Work>
Spread repeat(const Work& work) {
  constexpr int warm_ups = 3;
  constexpr int kept = 30;
  std::vector<double> ms;
  for (int i = 0; i < warm_ups + kept; ++i) {
    const double once = time(work);
    if (i >= warm_ups) ms.push_back(once);
  }
  return spread_of(ms);
}

template <class Work>
cudaGraphExec_t captured(const Work& work) {
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t executable = nullptr;
  ZKD_CHECK(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
  work();
  ZKD_CHECK(cudaStreamEndCapture(stream, &graph));
  ZKD_CHECK(cudaGraphInstantiate(&executable, graph, 0));
  ZKD_CHECK(cudaGraphDestroy(graph));
  return executable;
}

void launch(cudaGraphExec_t graph) { ZKD_CHECK(cudaGraphLaunch(graph, stream)); }

template <class T>
T* allocate(std::size_t count) {
  void* data = nullptr;
  ZKD_CHECK(cudaMalloc(&data, count * sizeof(T)));
  return static_cast<T*>(data);
}

__global__ void nothing() {}

// Random bits (a mix of the index): sorts and copies of zeros can be faster than of real data.
__global__ void fill(std::uint32_t* out, std::size_t count, std::uint32_t seed) {
  const std::size_t stride = std::size_t{gridDim.x} * blockDim.x;
  for (std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count; i += stride) {
    std::uint32_t x = static_cast<std::uint32_t>(i) * 0x9E3779B9u + seed;
    x = (x ^ (x >> 16)) * 0x85EBCA6Bu;
    x = (x ^ (x >> 13)) * 0xC2B2AE35u;
    out[i] = x ^ (x >> 16);
  }
}

void fill_array(std::uint32_t* out, std::size_t count, std::uint32_t seed) {
  fill<<<1024, 256, 0, stream>>>(out, count, seed);
  ZKD_CHECK(cudaGetLastError());
}

void launch_nothing() {
  nothing<<<1, 32, 0, stream>>>();
  ZKD_CHECK(cudaGetLastError());
}

void print_spread(const char* name, const Spread& ms) {
  std::printf("\"%s\": {\"median\": %.6f, \"min\": %.6f, \"max\": %.6f}", name, ms.median, ms.least,
              ms.most);
}

// Reads and writes count: what moves through the device's memory.
void print_copy() {
  std::size_t free_bytes = 0;
  std::size_t total_bytes = 0;
  ZKD_CHECK(cudaMemGetInfo(&free_bytes, &total_bytes));
  const std::size_t count = std::min(std::size_t{1} << 29, free_bytes / 16);  // 2 GiB where it fits
  auto* const from = allocate<std::uint32_t>(count);
  auto* const to = allocate<std::uint32_t>(count);
  fill_array(from, count, 1);
  const Spread ms = repeat(
      [&] { ZKD_CHECK(cudaMemcpyAsync(to, from, count * 4, cudaMemcpyDeviceToDevice, stream)); });
  std::printf("  \"copy\": {\"bytes\": %zu, ", count * 4);
  print_spread("ms", ms);
  std::printf(", \"gb_per_s\": %.1f},\n", 2.0 * static_cast<double>(count * 4) / (1e6 * ms.median));
  ZKD_CHECK(cudaFree(from));
  ZKD_CHECK(cudaFree(to));
}

void print_sort(std::size_t pairs, bool last) {
  auto* const keys = allocate<std::uint32_t>(pairs);
  auto* const values = allocate<std::uint32_t>(pairs);
  auto* const sorted_keys = allocate<std::uint32_t>(pairs);
  auto* const sorted_values = allocate<std::uint32_t>(pairs);
  std::size_t scratch_bytes = 0;
  const auto count = static_cast<int>(pairs);
  ZKD_CHECK(cub::DeviceRadixSort::SortPairs(nullptr, scratch_bytes, keys, sorted_keys, values,
                                            sorted_values, count, 0, 32, stream));
  auto* const scratch = allocate<char>(scratch_bytes);
  fill_array(keys, pairs, 2);
  fill_array(values, pairs, 3);
  const auto sort = [&] {
    ZKD_CHECK(cub::DeviceRadixSort::SortPairs(scratch, scratch_bytes, keys, sorted_keys, values,
                                              sorted_values, count, 0, 32, stream));
  };
  const Spread called = repeat(sort);
  const cudaGraphExec_t graph = captured(sort);
  const Spread replayed = repeat([&] { launch(graph); });
  ZKD_CHECK(cudaGraphExecDestroy(graph));
  std::printf("    {\"pairs\": %zu, \"key_bits\": 32, \"value_bits\": 32, ", pairs);
  print_spread("ms", called);
  std::printf(", ");
  print_spread("graph_replay_ms", replayed);
  std::printf("}%s\n", last ? "" : ",");
  for (void* const block :
       {static_cast<void*>(keys), static_cast<void*>(values), static_cast<void*>(sorted_keys),
        static_cast<void*>(sorted_values), static_cast<void*>(scratch)}) {
    ZKD_CHECK(cudaFree(block));
  }
}

// A graph of `nodes` kernels that do nothing, one after another.
Spread empty_graph(int nodes) {
  const cudaGraphExec_t graph = captured([&] {
    for (int i = 0; i < nodes; ++i) launch_nothing();
  });
  const Spread ms = repeat([&] { launch(graph); });
  ZKD_CHECK(cudaGraphExecDestroy(graph));
  return ms;
}

void print_launches() {
  constexpr int many = 64;
  const Spread kernel = repeat(launch_nothing);
  const Spread one = empty_graph(1);
  const Spread more = empty_graph(many);

  // As the host sees it: until it knows that the device has done nothing.
  const cudaGraphExec_t graph = captured(launch_nothing);
  std::vector<double> waited;
  for (int i = 0; i < 33; ++i) {
    ZKD_CHECK(cudaStreamSynchronize(stream));
    const Stopwatch watch;
    launch(graph);
    ZKD_CHECK(cudaStreamSynchronize(stream));
    if (i >= 3) waited.push_back(watch.ms());
  }
  ZKD_CHECK(cudaGraphExecDestroy(graph));

  std::printf("  \"empty\": {");
  print_spread("kernel_ms", kernel);
  std::printf(", ");
  print_spread("graph_ms", one);
  std::printf(", ");
  print_spread("graph_and_wait_ms", spread_of(waited));
  std::printf(", ");
  print_spread("graph_of_64_ms", more);
  std::printf(", \"graph_node_ms\": %.6f}\n", (more.median - one.median) / (many - 1));
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::size_t> sizes;
  for (int i = 1; i < argc; ++i) {
    char* end = nullptr;
    const unsigned long long pairs = std::strtoull(argv[i], &end, 10);
    if (*end != '\0' || pairs == 0 || pairs > 0x7FFFFFFFu) {
      std::fprintf(stderr, "zkd-bench-ceilings: error: '%s' is no number of pairs\n", argv[i]);
      return 2;
    }
    sizes.push_back(pairs);
  }
  if (sizes.empty()) sizes = {69451, 75284, 174117, 282759, 871414, 1087716};

  int device = 0;
  cudaDeviceProp properties{};
  ZKD_CHECK(cudaGetDevice(&device));
  ZKD_CHECK(cudaGetDeviceProperties(&properties, device));
  ZKD_CHECK(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  ZKD_CHECK(cudaEventCreate(&begin_event));
  ZKD_CHECK(cudaEventCreate(&end_event));

  std::printf("{\n  \"schema\": 1,\n  \"gpu\": \"%s\",\n  \"multiprocessors\": %d,\n",
              properties.name, properties.multiProcessorCount);
  print_copy();
  std::printf("  \"sort\": [\n");
  for (std::size_t i = 0; i < sizes.size(); ++i) print_sort(sizes[i], i + 1 == sizes.size());
  std::printf("  ],\n");
  print_launches();
  std::printf("}\n");
  return 0;
}
