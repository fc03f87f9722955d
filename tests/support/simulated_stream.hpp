// SPDX-License-Identifier: Apache-2.0
//
// A stream of a simulated device, graphs captured from one, and memory in its order. Work runs
// when the stream pleases: at once, some time later, or not before somebody waits. A caller that
// lets go of what enqueued work needs, or looks too early, is found out.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <zkd/cuda/executor.hpp>
#include <zkd/error.hpp>
#include <zkd/statistics.hpp>

#include "support/random.hpp"
#include "support/simulated_memory.hpp"

namespace zkd::simulated {

/// A pass as the launch plan has it: nothing here may depend on the scene.
struct Launch {
  std::string name;
  std::uint32_t bound = 0;
  Stage stage = Stage::count;

  friend bool operator==(const Launch&, const Launch&) = default;
};

/// Work that may run any number of times, each time in another order.
using Run = std::function<void(test::Random&)>;

struct Pass {
  std::string name;
  Run run;
};

/// What was captured: passes and nothing of the host between them.
struct Graph {
  std::vector<Pass> passes;
};

class Stream {
 public:
  enum class Pace { at_once, now_and_then, when_waited_for };

  explicit Stream(std::uint64_t seed = 1) : Stream(seed, Pace{static_cast<int>(seed % 3)}) {}
  Stream(std::uint64_t seed, Pace pace) : random_(seed), pace_(pace) {}
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() {
    try {
      drain();
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      std::abort();
    }
  }

  /// As executors name it.
  [[nodiscard]] cuda::Stream handle() { return reinterpret_cast<cuda::Stream>(this); }
  static Stream& of(cuda::Stream handle) {
    static Stream default_stream;
    return handle != nullptr ? *reinterpret_cast<Stream*>(handle) : default_stream;
  }

  void enqueue(const std::string& name, std::uint32_t bound, const Run& run) {
    launches_.push_back({name, bound, stage_});
    enqueue_silently(name, run);
  }

  /// Likewise, for what is no pass.
  void enqueue_silently(const std::string& name, const Run& run) {
    if (capturing_) {
      captured_.passes.push_back({name, run});
      return;
    }
    waiting_.push_back({name, run});
    if (pace_ == Pace::at_once || (pace_ == Pace::now_and_then && random_.one_in(6))) drain();
  }

  /// Memory that nothing enqueued from now on uses.
  void give_back(void* data) {
    enqueue_silently("give back",
                     [data](test::Random&) { AddressSpace::instance().release(data); });
  }

  /// As cudaStreamSynchronize.
  void synchronize() {
    refuse_in_capture("synchronisation");
    ++synchronisations_;
    drain();
  }

  /// What CUDA does not do on a stream that is being captured.
  void refuse_in_capture(const char* what) const {
    constexpr std::uint64_t capture_unsupported = 900;
    if (capturing_)
      throw Error(ErrorCode::device_failure, capture_unsupported,
                  std::string(what) + " on a stream that is being captured");
  }

  void begin_capture() {
    refuse_in_capture("a capture");
    capturing_ = true;
    captured_ = {};
  }
  Graph end_capture() {
    capturing_ = false;
    return std::exchange(captured_, {});
  }
  void launch(const Graph& graph) {
    for (const Pass& pass : graph.passes) {
      waiting_.push_back(pass);
      if (pace_ == Pace::at_once) drain();
    }
  }

  void stage(Stage next) { stage_ = next; }

  /// All that was enqueued or captured since the last forget(), but for copies.
  [[nodiscard]] const std::vector<Launch>& launches() const { return launches_; }
  /// How often somebody waited.
  [[nodiscard]] std::size_t synchronisations() const { return synchronisations_; }
  void forget() {
    launches_.clear();
    synchronisations_ = 0;
  }

  test::Random& random() { return random_; }

 private:
  void drain() {
    if (draining_) return;
    draining_ = true;
    std::vector<Pass> passes = std::exchange(waiting_, {});
    try {
      const AddressSpace::Open open;
      for (const Pass& pass : passes) {
        AddressSpace::instance().name_work(pass.name);
        pass.run(random_);
      }
    } catch (...) {
      draining_ = false;
      throw;
    }
    draining_ = false;
  }

  test::Random random_;
  Pace pace_;
  std::vector<Pass> waiting_;
  std::vector<Launch> launches_;
  std::size_t synchronisations_ = 0;
  Stage stage_ = Stage::count;
  bool capturing_ = false;
  bool draining_ = false;
  Graph captured_;
};

/// Memory of the device: counts, refuses, and remembers what it was asked.
class Memory final : public cuda::MemoryResource {
 public:
  /// The allocation (from 1) that is refused; 0: none.
  std::size_t refuse_at = 0;

  void* allocate(std::size_t bytes, cuda::Stream stream) override {
    Stream::of(stream).refuse_in_capture("an allocation");
    asked_.push_back(bytes);
    if (asked_.size() == refuse_at) throw std::bad_alloc();
    void* data = AddressSpace::instance().allocate(bytes);
    live_[data] = bytes;
    return data;
  }

  void deallocate(void* data, std::size_t bytes, cuda::Stream stream) noexcept override {
    const auto block = live_.find(data);
    if (block == live_.end() || block->second != bytes) {
      misused_ = true;
      return;
    }
    live_.erase(block);
    try {
      Stream::of(stream).refuse_in_capture("giving memory back");
      Stream::of(stream).give_back(data);
    } catch (const std::exception&) {
      misused_ = true;
    }
  }

  /// Bytes of each allocation since the last forget(), refused ones too.
  [[nodiscard]] const std::vector<std::size_t>& asked() const { return asked_; }
  [[nodiscard]] std::size_t live_blocks() const { return live_.size(); }
  /// A block came back that was not given out, or of another size, or at a wrong time.
  [[nodiscard]] bool misused() const { return misused_; }
  void forget() { asked_.clear(); }

  static Memory& by_default() {
    static auto& memory = *new Memory;
    return memory;
  }

 private:
  std::vector<std::size_t> asked_;
  std::map<void*, std::size_t> live_;
  bool misused_ = false;
};

}  // namespace zkd::simulated
