# SPDX-License-Identifier: Apache-2.0
#
# What `cmake --install` puts where, and the package that find_package(zkd) finds.
include(CMakePackageConfigHelpers)

set(zkd_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/zkd")

install(TARGETS zkd EXPORT zkdTargets
        ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT zkd_development
        LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT zkd_runtime
                NAMELINK_COMPONENT zkd_development
        RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT zkd_runtime)
if(TARGET zkd_cuda)
  # A set of its own: programs that do not ask for CUDA need not have it.
  install(TARGETS zkd_cuda EXPORT zkdCudaTargets
          ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT zkd_development
          LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT zkd_runtime
                  NAMELINK_COMPONENT zkd_development
          RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT zkd_runtime)
  install(EXPORT zkdCudaTargets NAMESPACE zkd:: DESTINATION "${zkd_package_dir}"
          COMPONENT zkd_development)
endif()
install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/zkd" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}"
        COMPONENT zkd_development FILES_MATCHING PATTERN "*.hpp")
install(EXPORT zkdTargets NAMESPACE zkd:: DESTINATION "${zkd_package_dir}"
        COMPONENT zkd_development)
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}"
        COMPONENT zkd_development)

configure_package_config_file(cmake/zkdConfig.cmake.in "${PROJECT_BINARY_DIR}/zkdConfig.cmake"
                              INSTALL_DESTINATION "${zkd_package_dir}"
                              NO_SET_AND_CHECK_MACRO)
# While the major version is 0, a new minor version may change the interface.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/zkdConfigVersion.cmake"
                                 COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/zkdConfig.cmake" "${PROJECT_BINARY_DIR}/zkdConfigVersion.cmake"
        DESTINATION "${zkd_package_dir}" COMPONENT zkd_development)
