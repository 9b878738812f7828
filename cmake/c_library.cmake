# SPDX-License-Identifier: Apache-2.0
# needleforce::c, static, or shared with -DBUILD_SHARED_LIBS=ON. A C program links it with its C compiler.
add_library(needleforce_c bindings/c/needleforce.cpp bindings/c/needleforce_guard.cpp bindings/c/needleforce_bend.cpp
            bindings/c/needleforce_solid.cpp bindings/c/needleforce_events.cpp
            bindings/c/needleforce_online.cpp)
add_library(needleforce::c ALIAS needleforce_c)
set_target_properties(needleforce_c PROPERTIES OUTPUT_NAME needleforce EXPORT_NAME c POSITION_INDEPENDENT_CODE ON
                      VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
                      PUBLIC_HEADER "bindings/c/needleforce.h;bindings/c/needleforce_guard.h;bindings/c/needleforce_bend.h;bindings/c/needleforce_solid.h;bindings/c/needleforce_events.h;bindings/c/needleforce_online.h" WINDOWS_EXPORT_ALL_SYMBOLS ON)
target_include_directories(needleforce_c INTERFACE $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/bindings/c>)
target_link_libraries(needleforce_c PRIVATE needleforce INTERFACE $<$<BOOL:${UNIX}>:m>)
# without these two it would need the C++ run-time library
target_compile_options(needleforce_c PRIVATE $<$<CXX_COMPILER_ID:GNU,Clang,AppleClang>:-fno-exceptions;-fno-rtti>)
