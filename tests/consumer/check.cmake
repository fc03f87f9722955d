# SPDX-License-Identifier: Apache-2.0
#
# Runs one consumer: cmake -DCASE=... -P check.cmake (see CMakeLists.txt). Any step that fails ends
# it with that step's output.

function(step what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${CASE}: ${what} failed (${status}):\n${text}")
  endif()
  set(output "${text}" PARENT_SCOPE)
endfunction()

function(configure_and_build source)
  step("configuring" "${CMAKE_COMMAND}" -S "${source}" -B "${build}" -G "${GENERATOR}"
       "-DCMAKE_MAKE_PROGRAM=${MAKE_PROGRAM}" "-DCMAKE_CXX_COMPILER=${COMPILER}" ${ARGN})
  step("building" "${CMAKE_COMMAND}" --build "${build}")
endfunction()

# The bits of thousands of hits, and of the tree, must not depend on how a program was compiled.
function(run_bits)
  step("running bits" "${build}/bits")
  file(WRITE "${WORK_DIR}/${CASE}.txt" "${output}")
  file(READ "${WORK_DIR}/find_package.txt" expected)
  if(NOT output STREQUAL expected)
    message(FATAL_ERROR "${CASE}: hits differ from those of the plain consumer: compare "
                        "${WORK_DIR}/${CASE}.txt with ${WORK_DIR}/find_package.txt")
  endif()
endfunction()

# Sets `result` to what stands in the README's first block of this language.
function(readme_block language result)
  file(READ "${ZKD_SOURCE_DIR}/README.md" text)
  string(FIND "${text}" "```${language}\n" start)
  if(start EQUAL -1)
    message(FATAL_ERROR "README.md has no ```${language} block")
  endif()
  string(LENGTH "```${language}\n" fence)
  math(EXPR start "${start} + ${fence}")
  string(SUBSTRING "${text}" ${start} -1 text)
  string(FIND "${text}" "```" end)
  string(SUBSTRING "${text}" 0 ${end} text)
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

set(prefix "${WORK_DIR}/prefix")
set(build "${WORK_DIR}/build/${CASE}")
set(sources "${CMAKE_CURRENT_LIST_DIR}")

if(CASE STREQUAL "install")
  file(REMOVE_RECURSE "${prefix}" "${WORK_DIR}/build")
  step("installing" "${CMAKE_COMMAND}" --install "${ZKD_BINARY_DIR}" --prefix "${prefix}"
       --config "${CONFIG}")

elseif(CASE STREQUAL "find_package")
  readme_block(cpp program)
  file(WRITE "${WORK_DIR}/readme.cpp" "${program}")
  configure_and_build("${sources}/find_package" "-DCMAKE_PREFIX_PATH=${prefix}"
                      "-DZKD_EXPECTED_VERSION=${VERSION}" "-DZKD_EXPECTED_CUDA=${CUDA}"
                      "-DREADME_PROGRAM=${WORK_DIR}/readme.cpp")
  step("running the README's program" "${build}/readme")
  readme_block(text expected)
  if(NOT output STREQUAL expected)
    message(FATAL_ERROR "the README's program printed\n${output}and the README says\n${expected}")
  endif()
  step("running bits" "${build}/bits")
  file(WRITE "${WORK_DIR}/find_package.txt" "${output}")
  if(CUDA)
    step("running either" "${build}/either")
    message(STATUS "${output}")
  endif()

elseif(CASE STREQUAL "other_flags")
  configure_and_build("${sources}/find_package" "-DCMAKE_PREFIX_PATH=${prefix}"
                      "-DZKD_EXPECTED_VERSION=${VERSION}" "-DZKD_EXPECTED_CUDA=${CUDA}"
                      "-DCMAKE_CXX_FLAGS=-O3 -march=native -ffp-contract=fast -ffast-math")
  run_bits()

elseif(CASE STREQUAL "add_subdirectory")
  # Another way of building all of it: shared, without optimisation, assertions on.
  configure_and_build("${sources}/add_subdirectory" "-DZKD_SOURCE_DIR=${ZKD_SOURCE_DIR}"
                      -DBUILD_SHARED_LIBS=ON -DCMAKE_BUILD_TYPE=Debug
                      "-DZKD_CUDA_ARCHITECTURES=75-virtual"
                      "-DCMAKE_EXE_LINKER_FLAGS=-Wl,--as-needed")
  run_bits()
  if(EXISTS "${build}/either")
    step("running either" "${build}/either")
  endif()

else()
  message(FATAL_ERROR "no such case: ${CASE}")
endif()
