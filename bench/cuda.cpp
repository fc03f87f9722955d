// SPDX-License-Identifier: Apache-2.0
//
// Where to run: the same decision with and without zkd::cuda.
#include "cuda.hpp"

#include <zkd/error.hpp>

namespace zkd::bench {

Where resolve(Backend wanted) {
  if (wanted == Backend::cpu) return {};
  Where where;
  where.why_not_cuda = why_no_cuda();
  if (where.why_not_cuda.empty()) {
    where.backend = Backend::cuda;
  } else if (wanted == Backend::cuda) {
    throw Error(ErrorCode::backend_unavailable, 0, "--backend cuda: " + where.why_not_cuda);
  }
  return where;
}

}  // namespace zkd::bench
