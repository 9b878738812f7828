# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts below a prefix, which may be moved afterwards: headers, the C library, a CMake package
# and two files for pkg-config.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
if(CMAKE_SOURCE_DIR STREQUAL PROJECT_SOURCE_DIR)
  set(top_level ON)
else()
  set(top_level OFF)
endif()
option(NEEDLEFORCE_INSTALL "install the headers, the C library and the packages of CMake and pkg-config" ${top_level})
if(NOT NEEDLEFORCE_INSTALL)
  return()
endif()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/needleforce)
target_include_directories(needleforce INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_include_directories(needleforce_c INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
install(DIRECTORY include/needleforce DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS needleforce needleforce_compiled needleforce_c EXPORT needleforce PUBLIC_HEADER DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT needleforce NAMESPACE needleforce:: FILE needleforceTargets.cmake DESTINATION ${package})
write_basic_package_version_file(needleforceConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES cmake/needleforceConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/needleforceConfigVersion.cmake
        DESTINATION ${package})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

# pcfiledir is the folder of a .pc file: from there the prefix is found wherever it was moved to
file(RELATIVE_PATH to_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" to_prefix ${to_prefix})
foreach(name needleforce needleforce-c)
  configure_file(cmake/${name}.pc.in ${name}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()
