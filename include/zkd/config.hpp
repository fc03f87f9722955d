// SPDX-License-Identifier: Apache-2.0
//
// The version, and the two markers that functions carry: where they run, and whether a program may
// link to them.
#pragma once

#if __cplusplus < 202002L
#error "zkd needs C++20: compile with -std=c++20 (nvcc does not by default)"
#endif

#define ZKD_VERSION_MAJOR 0
#define ZKD_VERSION_MINOR 1
#define ZKD_VERSION_PATCH 0
#define ZKD_VERSION "0.1.0"

// A function that runs on the host and, when nvcc compiles it, on the device too.
#if defined(__CUDACC__)
#define ZKD_HOST_DEVICE __host__ __device__
#else
#define ZKD_HOST_DEVICE
#endif

// Symbols of the compiled library that a program may use.
#if defined(__GNUC__)
#define ZKD_API __attribute__((visibility("default")))
#else
#define ZKD_API
#endif
