// SPDX-License-Identifier: Apache-2.0
//
// Arrays of platforms whose memory is the host's. See support/platform.hpp.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <zkd/geometry.hpp>

namespace zkd::test {

template <class T>
class Array {
 public:
  explicit Array(std::size_t count, const T& value = T{}) : values_(count, value) {}
  explicit Array(std::span<const T> values) : values_(values.begin(), values.end()) {}

  operator std::span<T>() { return values_; }
  operator std::span<const T>() const { return values_; }

  [[nodiscard]] std::vector<T> download() const { return values_; }

 private:
  std::vector<T> values_;
};

template <class T>
Array<T> upload(const std::vector<T>& values) {
  return Array<T>(std::span<const T>(values));
}

inline const TriangleView& upload(const TriangleView& triangles) { return triangles; }

}  // namespace zkd::test
