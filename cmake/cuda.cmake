# SPDX-License-Identifier: Apache-2.0
#
# Looks for nvcc as ZKD_CUDA says and, with it, adds src/cuda. Sets zkd_cuda_compiler.
include(CheckLanguage)

set(zkd_cuda_compiler FALSE)
if(ZKD_CUDA STREQUAL "OFF")
  message(NOTICE "zkd: nothing is compiled for CUDA (ZKD_CUDA is OFF)")
  return()
endif()

# nvcc 13 knows no architecture before 7.5, and CMake's own default may be older.
if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
  set(CMAKE_CUDA_ARCHITECTURES 75)
endif()
check_language(CUDA)
if(CMAKE_CUDA_COMPILER)
  enable_language(CUDA)
endif()

if(CMAKE_CUDA_COMPILER_VERSION VERSION_GREATER_EQUAL 12.0)
  set(zkd_cuda_compiler TRUE)
  zkd_add_directory(src/cuda)
elseif(ZKD_CUDA STREQUAL "ON")
  message(FATAL_ERROR "zkd: ZKD_CUDA is ON, but no nvcc of version 12 or later was found.")
else()
  message(NOTICE "zkd: nothing is compiled for CUDA (no nvcc of version 12 or later was found)")
endif()
