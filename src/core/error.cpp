// SPDX-License-Identifier: Apache-2.0
//
// The exception, and the names of its codes.
#include <zkd/error.hpp>

namespace zkd {

Error::Error(ErrorCode code, std::uint64_t offender, const std::string& message)
    : std::runtime_error(message), code_(code), offender_(offender) {}

const char* to_string(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::index_out_of_range:
      return "index_out_of_range";
    case ErrorCode::non_finite_vertex:
      return "non_finite_vertex";
    case ErrorCode::too_many_triangles:
      return "too_many_triangles";
    case ErrorCode::too_many_references:
      return "too_many_references";
    case ErrorCode::reference_capacity:
      return "reference_capacity";
    case ErrorCode::invalid_view:
      return "invalid_view";
    case ErrorCode::invalid_option:
      return "invalid_option";
    case ErrorCode::unsupported_option:
      return "unsupported_option";
    case ErrorCode::backend_unavailable:
      return "backend_unavailable";
    case ErrorCode::out_of_memory:
      return "out_of_memory";
    case ErrorCode::device_failure:
      return "device_failure";
  }
  return "unknown";
}

}  // namespace zkd
