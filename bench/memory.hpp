// SPDX-License-Identifier: Apache-2.0
//
// A memory resource that counts: what a build asks for, and how much of it at once.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory_resource>

namespace zkd::bench {

class CountingResource final : public std::pmr::memory_resource {
 public:
  [[nodiscard]] std::uint64_t held() const { return held_; }  ///< bytes now
  [[nodiscard]] std::uint64_t peak() const { return peak_; }  ///< most bytes at once

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    void* const block = upstream_->allocate(bytes, alignment);
    held_ += bytes;
    peak_ = std::max(peak_, held_);
    return block;
  }
  void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
    held_ -= bytes;
    upstream_->deallocate(block, bytes, alignment);
  }
  [[nodiscard]] bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }

  std::pmr::memory_resource* upstream_ = std::pmr::get_default_resource();
  std::uint64_t held_ = 0;
  std::uint64_t peak_ = 0;
};

}  // namespace zkd::bench
