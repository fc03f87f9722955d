// SPDX-License-Identifier: Apache-2.0
//
// What the checks have to notice: arithmetic that the flags decide on. For PTX only; never run.

__global__ void careless(float* x) {
  x[0] = x[1] * x[2] + x[3];
  x[4] = x[5] + x[6];
}
