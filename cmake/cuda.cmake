# SPDX-License-Identifier: Apache-2.0
#
# Looks for nvcc as ZKD_CUDA says and, with it, adds src/cuda (target zkd_cuda, zkd::cuda). Sets
# zkd_cuda_compiler, and zkd_cuda_architectures for all that is compiled by nvcc.
include(CheckLanguage)

# Every architecture that zkd is built for: Turing (RTX 20) to Blackwell (RTX 50). Code for one runs
# on later ones of the same major version; whatever is newer than the last gets PTX.
set(zkd_known_architectures 75 80 86 89 90 100 110 120)

set(zkd_cuda_compiler FALSE)
if(ZKD_CUDA STREQUAL "OFF")
  message(NOTICE "zkd: nothing is compiled for CUDA (ZKD_CUDA is OFF)")
  return()
endif()

# Whether nvcc works is tried for an architecture that every nvcc from 12 on has; CMake's own
# default may be older.
if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
  set(CMAKE_CUDA_ARCHITECTURES 75)
endif()
check_language(CUDA)
if(CMAKE_CUDA_COMPILER)
  enable_language(CUDA)
  find_package(CUDAToolkit QUIET)
endif()

if(NOT CMAKE_CUDA_COMPILER_VERSION VERSION_GREATER_EQUAL 12.0 OR NOT TARGET CUDA::cudart_static)
  if(ZKD_CUDA STREQUAL "ON")
    message(FATAL_ERROR "zkd: ZKD_CUDA is ON, but no nvcc of version 12 or later was found.")
  endif()
  message(NOTICE "zkd: nothing is compiled for CUDA (no nvcc of version 12 or later was found)")
  return()
endif()
set(zkd_cuda_compiler TRUE)

execute_process(COMMAND "${CMAKE_CUDA_COMPILER}" --list-gpu-arch OUTPUT_VARIABLE known_to_nvcc)
set(zkd_cuda_architectures "")
foreach(architecture IN LISTS zkd_known_architectures)
  if(known_to_nvcc MATCHES "compute_${architecture}\n")
    list(APPEND zkd_cuda_architectures ${architecture}-real)
    set(newest ${architecture})
  endif()
endforeach()
list(APPEND zkd_cuda_architectures ${newest}-virtual)

if(ZKD_CUDA_ARCHITECTURES STREQUAL "local")
  set(capability "")
  execute_process(COMMAND nvidia-smi --query-gpu=compute_cap --format=csv,noheader
                  OUTPUT_VARIABLE capability ERROR_QUIET RESULT_VARIABLE status)
  if(status EQUAL 0 AND capability MATCHES "^([0-9]+)\\.([0-9])")
    set(zkd_cuda_architectures ${CMAKE_MATCH_1}${CMAKE_MATCH_2}-real)
  else()
    list(GET zkd_cuda_architectures 0 oldest)
    string(REPLACE -real "" zkd_cuda_architectures ${oldest})  # its PTX runs on later ones
  endif()
elseif(NOT ZKD_CUDA_ARCHITECTURES STREQUAL "all")
  set(zkd_cuda_architectures "${ZKD_CUDA_ARCHITECTURES}")
endif()
message(NOTICE "zkd: compiling for CUDA ${CMAKE_CUDA_COMPILER_VERSION}: ${zkd_cuda_architectures}")

# How nvcc compiles what is ours. The standard by its flag: CMake 3.25 does not know it of nvcc 13.
# As on the CPU, a*b+c is rounded twice unless the source says fma. 20012: markers that glm puts on
# defaulted functions.
set(zkd_nvcc_options -std=c++20 --fmad=false --diag-suppress=20012 -Xcompiler=-Wall,-Wextra)
if(ZKD_WERROR)
  list(APPEND zkd_nvcc_options --Werror=all-warnings)
endif()
zkd_add_directory(src/cuda)
