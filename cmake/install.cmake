# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# `cmake --install`: the two shared libraries, the engine plugin beside them, the header, the tool, and what
# find_package(btgpu) and pkg-config need.
include(CMakePackageConfigHelpers)

set(btgpu_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/btgpu)
install(TARGETS btgpu btgpu-float64 EXPORT btgpuTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS btgpu_engine LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/btgpu)
install(FILES compat/btGpuDynamicsWorld.h compat/btGpuQueries.h compat/btGpuSoftRigidDynamicsWorld.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/btgpu)
if(TARGET btgpu_tool)
  install(TARGETS btgpu_tool RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(EXPORT btgpuTargets NAMESPACE btgpu:: DESTINATION ${btgpu_cmake_dir})
configure_package_config_file(cmake/btgpuConfig.cmake.in ${PROJECT_BINARY_DIR}/btgpuConfig.cmake
                              INSTALL_DESTINATION ${btgpu_cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/btgpuConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/btgpuConfig.cmake ${PROJECT_BINARY_DIR}/btgpuConfigVersion.cmake
        DESTINATION ${btgpu_cmake_dir})

# Relative, so that an installed tree may be moved.
file(RELATIVE_PATH BTGPU_PC_TO_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
foreach(suffix "" "-float64")
  set(BTGPU_SUFFIX "${suffix}")
  configure_file(cmake/btgpu.pc.in ${PROJECT_BINARY_DIR}/btgpu${suffix}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/btgpu${suffix}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
