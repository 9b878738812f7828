# SPDX-License-Identifier: Apache-2.0
# needleforce::c, static, or shared with -DBUILD_SHARED_LIBS=ON. A C program links it with its C compiler.
set(parts needleforce needleforce_guard needleforce_bend needleforce_solid needleforce_events needleforce_online)
list(TRANSFORM parts REPLACE ".+" "bindings/c/\\0.cpp" OUTPUT_VARIABLE c_sources)
list(TRANSFORM parts REPLACE ".+" "bindings/c/\\0.h" OUTPUT_VARIABLE c_headers)

# The number of its ABI is in the header, and what belongs to it in a list, of which the shared library exports the functions alone.
file(STRINGS bindings/c/needleforce.h abi REGEX "define NF_ABI_VERSION")
string(REGEX MATCH "[0-9]+$" abi "${abi}")
file(STRINGS bindings/c/abi_v${abi}.txt functions REGEX "^function ")
list(TRANSFORM functions REPLACE "^function " "")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS bindings/c/needleforce.h bindings/c/abi_v${abi}.txt)

add_library(needleforce_c ${c_sources})
add_library(needleforce::c ALIAS needleforce_c)
set_target_properties(needleforce_c PROPERTIES OUTPUT_NAME needleforce EXPORT_NAME c POSITION_INDEPENDENT_CODE ON VISIBILITY_INLINES_HIDDEN ON
                      VERSION ${abi}.${PROJECT_VERSION} SOVERSION ${abi} PUBLIC_HEADER "${c_headers}")
target_include_directories(needleforce_c INTERFACE $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/bindings/c>)
target_link_libraries(needleforce_c PRIVATE needleforce INTERFACE $<$<BOOL:${UNIX}>:m>)
# without these two it would need the C++ run-time library
target_compile_options(needleforce_c PRIVATE $<$<CXX_COMPILER_ID:GNU,Clang,AppleClang>:-fno-exceptions;-fno-rtti>)

if(BUILD_SHARED_LIBS)
  set(exports ${CMAKE_CURRENT_BINARY_DIR}/needleforce_exports)
  if(WIN32)
    list(JOIN functions "\n" lines)
    file(WRITE ${exports}.def "EXPORTS\n${lines}\n")
    target_sources(needleforce_c PRIVATE ${exports}.def)
    set_target_properties(needleforce_c PROPERTIES PREFIX "")  # needleforce.dll with each compiler
  elseif(APPLE)
    list(TRANSFORM functions PREPEND _)
    list(JOIN functions "\n" lines)
    file(WRITE ${exports}.txt "${lines}\n")
    target_link_options(needleforce_c PRIVATE -Wl,-exported_symbols_list,${exports}.txt)
  else()
    list(JOIN functions "; " lines)
    file(WRITE ${exports}.map "NEEDLEFORCE_${abi} { global: ${lines}; local: *; };\n")
    target_link_options(needleforce_c PRIVATE -Wl,--version-script=${exports}.map -Wl,--no-undefined)
  endif()
endif()
