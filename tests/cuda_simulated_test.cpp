// SPDX-License-Identifier: Apache-2.0
//
// What the tests on a simulated device rest on: that it finds out what a real one would not
// forgive.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <vector>

#include <zkd/error.hpp>

#include "core/verbs.hpp"
#include "support/simulated_machine.hpp"

namespace zkd {
namespace {

using simulated::Array;
using simulated::Device;
using simulated::Machine;
using simulated::Stream;
using Numbers = Array<std::uint32_t>;

// Reads an address as the host would.
std::uint32_t look(const std::uint32_t* address) {
  return *const_cast<const volatile std::uint32_t*>(address);
}

TEST(SimulatedDeviceDeathTest, TheHostMayNotTouchItsMemory) {
  Machine machine;
  Numbers numbers(10, 7, machine.aside());
  EXPECT_DEATH((void)look(numbers.data()), "the host touches device memory");
  EXPECT_EQ(numbers.download()[9], 7u);
  EXPECT_DEATH((void)look(numbers.data()), "the host touches device memory");
}

TEST(SimulatedDeviceDeathTest, PassesMayNotLeaveTheirMemory) {
  Machine machine(1, Stream::Pace::at_once);
  Numbers numbers(64, 7, machine.aside());
  Device device(machine.executor());
  auto* const first = std::span<std::uint32_t>(numbers).data();
  EXPECT_DEATH(device.for_each({nullptr, 65}, core::Fill{first, 1}),
               "touches memory it was not given.*for_each zkd::core::Fill");
  EXPECT_NO_THROW(device.for_each({nullptr, 64}, core::Fill{first, 1}));
  auto* const nowhere = reinterpret_cast<std::uint32_t*>(std::uintptr_t{256});
  EXPECT_DEATH(device.for_each({nullptr, 1}, core::Fill{nowhere, 1}), "for_each zkd::core::Fill");
}

// What lies beside a block within its pages is found out when the block is given back.
TEST(SimulatedDevice, PassesMayNotWriteBesideTheirMemory) {
  for (const int beside : {-1, 0, 1}) {
    Machine machine(1, Stream::Pace::at_once);
    auto* const first =
        static_cast<std::uint32_t*>(machine.memory.allocate(250, machine.stream.handle()));
    Device device(machine.executor());
    device.for_each({nullptr, 1}, core::Fill{beside < 0 ? first - 1 : first + 62 * beside, 1});
    machine.memory.deallocate(first, 250, machine.stream.handle());
    EXPECT_EQ(machine.memory.misused(), beside != 0);
  }
}

TEST(SimulatedDeviceDeathTest, WhatWasGivenBackIsGone) {
  Machine machine(1, Stream::Pace::at_once);
  Device device(machine.executor());
  std::uint32_t* first = nullptr;
  {
    Numbers numbers(64, 7, machine.aside());
    first = std::span<std::uint32_t>(numbers).data();
  }
  EXPECT_DEATH(device.for_each({nullptr, 1}, core::Fill{first, 1}),
               "touches memory it was not given");
}

TEST(SimulatedDevice, RefusesToBeSentToHostMemory) {
#if !defined(ZKD_FINDS_HOST_POINTERS)
  GTEST_SKIP() << "this compiler, or AddressSanitizer, does not let addresses be told from numbers";
#endif
  Machine machine;
  Device device(machine.executor());
  std::vector<std::uint32_t> on_heap(10);
  std::uint32_t on_stack = 0;
  EXPECT_THROW(device.for_each({nullptr, 10}, core::Fill{on_heap.data(), 1}), std::logic_error);
  EXPECT_THROW(device.for_each({nullptr, 1}, core::Fill{&on_stack, 1}), std::logic_error);
}

TEST(SimulatedDevice, MemoryIsGarbageAndNeverTheSame) {
  Machine machine;
  auto* a = static_cast<std::uint32_t*>(machine.memory.allocate(4096, machine.stream.handle()));
  auto* b = static_cast<std::uint32_t*>(machine.memory.allocate(4096, machine.stream.handle()));
  EXPECT_NE(a, b);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(a) % 256, 0u);
  std::uint32_t of_a[1024];
  std::uint32_t of_b[1024];
  Device device(machine.executor());
  device.copy_to_host(of_a, a, sizeof of_a);
  device.copy_to_host(of_b, b, sizeof of_b);
  EXPECT_NE(std::memcmp(of_a, of_b, sizeof of_a), 0);
  EXPECT_EQ(machine.memory.live_blocks(), 2u);
  machine.memory.deallocate(a, 4096, machine.stream.handle());
  machine.memory.deallocate(b, 4096, machine.stream.handle());
  EXPECT_EQ(machine.memory.live_blocks(), 0u);
  EXPECT_FALSE(machine.memory.misused());
  machine.memory.deallocate(b, 4096, machine.stream.handle());
  EXPECT_TRUE(machine.memory.misused());
}

TEST(SimulatedDevice, WorksWhenTheStreamPleases) {
  Machine machine(1, Stream::Pace::when_waited_for);
  Numbers numbers(10, 7, machine.aside());
  auto* const first = std::span<std::uint32_t>(numbers).data();
  std::uint32_t late = 1;
  Device device(machine.executor());
  device.copy_to_device(first, &late, sizeof late);
  late = 2;
  EXPECT_EQ(numbers.download()[0], 2u) << "copied before anybody waited";
}

TEST(SimulatedDevice, ReplaysWhatWasCaptured) {
  for (const auto pace : {Stream::Pace::at_once, Stream::Pace::when_waited_for}) {
    Machine machine(1, pace);
    Numbers numbers(10, 7, machine.aside());
    auto* const first = std::span<std::uint32_t>(numbers).data();
    Device device(machine.executor());
    machine.stream.begin_capture();
    device.for_each({nullptr, 10}, core::Fill{first, 3});
    std::uint32_t seen = 0;
    EXPECT_THROW(device.copy_to_host(&seen, first, sizeof seen), Error);
    EXPECT_THROW((void)machine.memory.allocate(16, machine.stream.handle()), Error);
    const simulated::Graph graph = machine.stream.end_capture();
    EXPECT_EQ(numbers.download()[4], 7u) << "a capture runs nothing";
    for (int again = 0; again < 2; ++again) {
      machine.stream.launch(graph);
      EXPECT_EQ(numbers.download()[4], 3u);
      numbers.assign(std::vector<std::uint32_t>(10, 7));
    }
  }
}

TEST(SimulatedDevice, ChecksCounts) {
  Machine machine(1, Stream::Pace::at_once);
  Numbers numbers(10, 11, machine.aside());
  auto* const first = std::span<std::uint32_t>(numbers).data();
  Device device(machine.executor());
  EXPECT_THROW(device.for_each({first, 10}, core::Fill{first, 1}), std::logic_error)
      << "11 elements, launched for 10";
}

}  // namespace
}  // namespace zkd
