// SPDX-License-Identifier: Apache-2.0
//
// How zkd says that something is wrong with what it was given.
//
// Bad input and lack of memory throw zkd::Error; a fault of zkd's own is an assertion. Queries
// (zkd/query.hpp) are noexcept and never throw.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include <zkd/config.hpp>

namespace zkd {

enum class ErrorCode {
  index_out_of_range,   ///< a triangle names a vertex that does not exist; offender: the triangle
  non_finite_vertex,    ///< a triangle has a NaN or infinite coordinate; offender: the triangle
  too_many_triangles,   ///< more triangles than 31 bits count; offender: the count
  too_many_references,  ///< `all` needs more references than 31 bits count; offender: how many
  reference_capacity,   ///< `all` on CUDA needs more references than
                        ///< BuildOptions::reference_capacity; offender: how many
  invalid_view,         ///< null pointer, odd stride or misaligned data; offender: see the message
  invalid_option,       ///< an option is outside its documented range; offender: its value, 0 for
                        ///< one that is no integer
  unsupported_option,   ///< a valid option that this version, or the backend, does not have;
                        ///< offender: 0
  backend_unavailable,  ///< the backend asked for is not linked, or no device answers; offender: 0
  out_of_memory,        ///< the memory resource refused; offender: the bytes asked for
  device_failure,       ///< a call to CUDA failed; offender: its cudaError_t
};

/// The name of `code` as written above, for logs. Static storage.
ZKD_API const char* to_string(ErrorCode code) noexcept;

/// What every throwing function of zkd throws. When it arrives nothing is leaked. build() has not
/// changed any argument; what a single stage (zkd/stages.hpp) left in its output spans is
/// unspecified.
class ZKD_API Error : public std::runtime_error {
 public:
  Error(ErrorCode code, std::uint64_t offender, const std::string& message);

  /// Which kind of error; each kind has its own code.
  [[nodiscard]] ErrorCode code() const noexcept { return code_; }

  /// What the code's comment says; of several triangles, the lowest index.
  [[nodiscard]] std::uint64_t offender() const noexcept { return offender_; }

 private:
  ErrorCode code_;
  std::uint64_t offender_;
};

}  // namespace zkd
