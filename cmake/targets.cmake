# SPDX-License-Identifier: Apache-2.0
#
# How zkd's own targets are compiled. Nothing here reaches a program that links zkd.

# Language, warnings, arithmetic and sanitizers of a target that is ours.
function(zkd_own_target target)
  get_target_property(done ${target} ZKD_OWN)
  if(done)
    return()
  endif()
  set_target_properties(${target} PROPERTIES ZKD_OWN TRUE)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES
    CXX_EXTENSIONS OFF
    CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON
    POSITION_INDEPENDENT_CODE ON)

  # Arithmetic that gives the same bits with every compiler and instruction set: a*b+c is rounded
  # twice unless the source says fma. Without errno, square root and fma are single instructions;
  # their values are the same.
  set(options -ffp-contract=off -fno-math-errno -Wall -Wextra -Wpedantic -Wshadow -Wconversion)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    list(APPEND options -Wno-restrict)  # GCC 12 sees overlaps inside std::string that are not there
  endif()
  if(ZKD_WERROR)
    list(APPEND options -Werror)
  endif()

  # The first report ends the program, so that no test can pass over one.
  if(ZKD_SANITIZE STREQUAL "thread")
    set(sanitizers -fsanitize=thread -fno-omit-frame-pointer)
  elseif(ZKD_SANITIZE)
    set(sanitizers -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all
                   -fno-omit-frame-pointer)
  endif()
  list(APPEND options ${sanitizers})
  target_link_options(${target} PUBLIC ${sanitizers})
  if(ZKD_FUZZ)
    list(APPEND options -fsanitize=fuzzer-no-link)  # coverage, for the fuzz targets to be led by
  endif()
  target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:${options}>")
endfunction()
