# SPDX-License-Identifier: Apache-2.0
#
# What zkd takes from other packages. The library cannot do without glm and OpenMP; a tool or a
# feature whose package is missing is left out with a line that names the Debian package.
#
# ZKD_DEPS names a folder with include/, lib/ and share/ where packages are looked for first: for
# machines that have no package registry. bench/gpu-pack makes one.
set(ZKD_DEPS "$ENV{ZKD_DEPS}" CACHE PATH "Folder with packages that zkd uses, looked in first")
if(ZKD_DEPS)
  get_filename_component(zkd_deps "${ZKD_DEPS}" ABSOLUTE BASE_DIR "${PROJECT_SOURCE_DIR}")
  if(NOT IS_DIRECTORY "${zkd_deps}")
    message(FATAL_ERROR "zkd: ZKD_DEPS names a folder that is not there: ${zkd_deps}")
  endif()
  list(PREPEND CMAKE_PREFIX_PATH "${zkd_deps}")  # pkg-config looks there too
endif()

# find_package(package ...), or an error that says what to install.
macro(zkd_require package debian)
  find_package(${package} QUIET ${ARGN})
  if(NOT ${package}_FOUND)
    message(FATAL_ERROR "zkd needs ${package}, which was not found (Debian and Ubuntu: ${debian}).")
  endif()
endmacro()

# find_package(package ...) for a tool. Sets zkd_has_<package> and remembers the Debian name.
macro(zkd_look_for package debian)
  find_package(${package} QUIET ${ARGN})
  set(zkd_has_${package} ${${package}_FOUND})
  set(zkd_debian_${package} ${debian})
endmacro()

# The same without a CMake package: a header and libraries, target `package`.
macro(zkd_look_for_library package header libraries debian)
  set(zkd_debian_${package} ${debian})
  zkd_find_library(${package} ${header} "${libraries}")
endmacro()

function(zkd_find_library package header libraries)
  set(found FALSE)
  if(NOT CMAKE_DISABLE_FIND_PACKAGE_${package})
    find_path(${package}_INCLUDE_DIR ${header})
    mark_as_advanced(${package}_INCLUDE_DIR)
    set(found TRUE)
    set(paths "")
    foreach(library IN LISTS libraries)
      find_library(${package}_${library}_LIBRARY ${library})
      mark_as_advanced(${package}_${library}_LIBRARY)
      if(NOT ${package}_${library}_LIBRARY)
        set(found FALSE)
      endif()
      list(APPEND paths "${${package}_${library}_LIBRARY}")
    endforeach()
    if(NOT ${package}_INCLUDE_DIR)
      set(found FALSE)
    endif()
  endif()
  set(zkd_has_${package} ${found} PARENT_SCOPE)
  if(found)
    add_library(${package} INTERFACE IMPORTED GLOBAL)
    target_include_directories(${package} INTERFACE "${${package}_INCLUDE_DIR}")
    target_link_libraries(${package} INTERFACE ${paths})
  endif()
endfunction()

# The same by pkg-config, target PkgConfig::<package>: for libraries that have no CMake package, and
# for those whose CMake package stops CMake on Debian where packages that it names but zkd does not
# use (Draco, command-line tools) are not installed.
macro(zkd_look_for_module package module debian)
  find_package(PkgConfig QUIET)
  set(zkd_has_${package} FALSE)
  set(zkd_debian_${package} "${debian} and pkg-config")
  if(PKG_CONFIG_FOUND AND NOT CMAKE_DISABLE_FIND_PACKAGE_${package})
    pkg_check_modules(${package} QUIET IMPORTED_TARGET GLOBAL ${module})
    set(zkd_has_${package} ${${package}_FOUND})
  endif()
endmacro()

# Embree, which zkd is compared with and never needs. Sets zkd_embree to its major version, 3 or 4
# (they differ in their headers and calls; the target is `embree` in both), or to nothing.
macro(zkd_look_for_embree)
  find_package(embree QUIET)
  set(zkd_embree "")
  if(embree_FOUND AND embree_VERSION MATCHES "^([34])\\.")
    set(zkd_embree ${CMAKE_MATCH_1})
  endif()
endmacro()

# `name (Debian and Ubuntu: package)` in `out`, for a package looked for above.
function(zkd_describe_package package out)
  string(REGEX REPLACE "^zkd_" "" name ${package})
  set(${out} "${name} (Debian and Ubuntu: ${zkd_debian_${package}})" PARENT_SCOPE)
endfunction()

# One line: what is left out because a package is missing.
function(zkd_note_missing package consequence)
  zkd_describe_package(${package} description)
  message(NOTICE "zkd: ${consequence}; not found: ${description}")
endfunction()

# add_subdirectory(directory) if everything it NEEDS (packages looked for above, or targets) is
# there; otherwise one line that says why not. Its targets become targets of ours (targets.cmake).
function(zkd_add_directory directory)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "NEEDS")
  set(reasons "")
  foreach(need IN LISTS arg_NEEDS)
    if(NOT TARGET ${need} AND NOT zkd_has_${need})
      if(DEFINED zkd_debian_${need})
        zkd_describe_package(${need} description)
        list(APPEND reasons "${description}")
      else()
        list(APPEND reasons "${need}")
      endif()
    endif()
  endforeach()
  if(reasons)
    list(JOIN reasons ", " reasons)
    message(NOTICE "zkd: ${directory} is left out; not found: ${reasons}")
    return()
  endif()
  add_subdirectory("${PROJECT_SOURCE_DIR}/${directory}" "${PROJECT_BINARY_DIR}/${directory}")
  get_property(targets DIRECTORY "${PROJECT_SOURCE_DIR}/${directory}" PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    if(NOT type STREQUAL "UTILITY")
      zkd_own_target(${target})
    endif()
  endforeach()
endfunction()
