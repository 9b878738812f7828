# SPDX-License-Identifier: Apache-2.0
# The C library for another system, by the compiler in the package `ziglang` of PyPI:
#   cmake -S . -B build -DCMAKE_TOOLCHAIN_FILE=cmake/zig.cmake -DNEEDLEFORCE_TARGET=x86_64-windows-gnu -DBUILD_SHARED_LIBS=ON
# Targets: x86_64-windows-gnu, aarch64-macos, x86_64-macos, x86_64-linux-gnu.2.28, aarch64-linux-gnu.2.28.
set(NEEDLEFORCE_TARGET x86_64-windows-gnu CACHE STRING "processor, system and library of C, as Zig names them")
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES NEEDLEFORCE_TARGET)
if(NEEDLEFORCE_TARGET MATCHES windows)
  set(CMAKE_SYSTEM_NAME Windows)
elseif(NEEDLEFORCE_TARGET MATCHES macos)
  set(CMAKE_SYSTEM_NAME Darwin)
  set(CMAKE_INSTALL_NAME_TOOL true)  # Zig has none, and nothing here is renamed
else()
  set(CMAKE_SYSTEM_NAME Linux)
endif()
string(REGEX MATCH "^[^-]+" CMAKE_SYSTEM_PROCESSOR ${NEEDLEFORCE_TARGET})
find_program(zig_python NAMES python3 python REQUIRED)
foreach(language C CXX)
  set(CMAKE_${language}_COMPILER_TARGET ${NEEDLEFORCE_TARGET})
endforeach()
set(CMAKE_C_COMPILER ${zig_python} -m ziglang cc)
set(CMAKE_CXX_COMPILER ${zig_python} -m ziglang c++)
