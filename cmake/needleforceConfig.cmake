# SPDX-License-Identifier: Apache-2.0
include(${CMAKE_CURRENT_LIST_DIR}/needleforceTargets.cmake)

# The C library needs no C++ run-time library: a project in C alone links it with its C compiler.
get_target_property(needleforce_configurations needleforce::c IMPORTED_CONFIGURATIONS)
foreach(configuration IN LISTS needleforce_configurations)
  set_target_properties(needleforce::c PROPERTIES IMPORTED_LINK_INTERFACE_LANGUAGES_${configuration} C)
endforeach()
unset(needleforce_configurations)
