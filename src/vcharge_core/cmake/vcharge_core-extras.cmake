# Build settings of all packages; included by find_package(catkin REQUIRED COMPONENTS vcharge_core).

# C++17, warnings, and Release by default. A macro, since the settings must apply to the calling package.
macro(vcharge_build_settings)
  set(CMAKE_CXX_STANDARD 17)
  set(CMAKE_CXX_STANDARD_REQUIRED ON)
  set(CMAKE_CXX_EXTENSIONS OFF)
  set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
  if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
    set(CMAKE_BUILD_TYPE Release)
  endif()
  # Private headers are included by their path below src.
  include_directories(src)
  option(VCHARGE_WARNINGS_AS_ERRORS "Fail the build on compiler warnings" OFF)
  add_compile_options(-Wall -Wextra -Wno-missing-field-initializers -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual)
  if(VCHARGE_WARNINGS_AS_ERRORS)
    add_compile_options(-Werror)
  endif()
  set(VCHARGE_SANITIZE "" CACHE STRING "Sanitizers to build with, as in -fsanitize=: address,undefined or thread")
  if(VCHARGE_SANITIZE)
    add_compile_options(-fsanitize=${VCHARGE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      # GCC reports false positives of these warnings in instrumented code.
      add_compile_options(-Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overflow)
    endif()
    add_link_options(-fsanitize=${VCHARGE_SANITIZE})
  endif()
  cmake_language(DEFER CALL vcharge_use_precompiled_headers)
endmacro()

# Headers that most sources include, parsed once for all libraries, once for all tools, and once for all tests. Only in one build of
# the whole suite by GCC. Sources must include what they use: clang-tidy and builds without this option check them so.
function(vcharge_add_precompiled_headers)
  option(VCHARGE_PRECOMPILED_HEADERS "Parse common headers once for all sources" ON)
  if(NOT VCHARGE_PRECOMPILED_HEADERS OR NOT CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    return()
  endif()
  set(common
    <algorithm> <array> <cmath> <filesystem> <fstream> <functional> <iostream> <limits> <map> <memory> <mutex> <numeric>
    <optional> <random> <set> <sstream> <stdexcept> <string> <thread> <unordered_map> <utility> <vector>
    <Eigen/Core> <Eigen/Geometry> <opencv2/core.hpp>)
  vcharge_add_headers(library HEADERS ${common})
  set_target_properties(vcharge_library_headers PROPERTIES POSITION_INDEPENDENT_CODE ON)
  vcharge_add_headers(tool HEADERS ${common} <nlohmann/json.hpp>)
  if(CATKIN_ENABLE_TESTING)
    vcharge_add_headers(test HEADERS ${common} <gmock/gmock.h> <gtest/gtest.h>)
    target_compile_options(vcharge_test_headers PRIVATE ${vcharge_test_options})
    target_compile_definitions(vcharge_test_headers PRIVATE GTEST_HAS_PTHREAD=1)
  endif()
endfunction()

# vcharge_add_headers(KIND HEADERS <header>...): a target that holds the precompiled headers of a kind of sources.
function(vcharge_add_headers kind)
  cmake_parse_arguments(arg "" "" "HEADERS" ${ARGN})
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${kind}_headers.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "// Compiled with the precompiled headers that others use.\n")
  add_library(vcharge_${kind}_headers OBJECT ${source})
  target_link_libraries(vcharge_${kind}_headers PRIVATE Eigen3::Eigen ${OpenCV_LIBS})
  target_precompile_headers(vcharge_${kind}_headers PRIVATE ${arg_HEADERS})
endfunction()

# Lets every target of this package use the precompiled headers of its kind.
function(vcharge_use_precompiled_headers)
  if(NOT TARGET vcharge_library_headers)
    return()
  endif()
  get_directory_property(targets BUILDSYSTEM_TARGETS)
  foreach(target ${targets})
    get_target_property(type ${target} TYPE)
    get_target_property(kind ${target} VCHARGE_HEADERS)
    if(NOT kind AND type STREQUAL SHARED_LIBRARY)
      set(kind library)
    elseif(NOT kind AND type STREQUAL EXECUTABLE)
      set(kind tool)
    endif()
    if(kind)
      target_precompile_headers(${target} REUSE_FROM vcharge_${kind}_headers)
    endif()
  endforeach()
endfunction()

# Tests spend their time in libraries: their own code is compiled fast, not to be fast.
set(vcharge_test_options $<$<CONFIG:Release>:-O1>)

# vcharge_add_gtest(NAME SOURCES a_test.cpp... [LIBRARIES target...])
function(vcharge_add_gtest name)
  cmake_parse_arguments(arg "" "" "SOURCES;LIBRARIES" ${ARGN})
  if(NOT CATKIN_ENABLE_TESTING)
    return()
  endif()
  catkin_add_gtest(${name} ${arg_SOURCES})
  if(TARGET ${name})
    target_link_libraries(${name} gtest_main gmock ${arg_LIBRARIES})
    target_compile_options(${name} PRIVATE ${vcharge_test_options})
    set_target_properties(${name} PROPERTIES VCHARGE_HEADERS test)
  endif()
endfunction()

# Installs libraries, tools and public headers where catkin, rosrun and roslaunch expect them.
function(vcharge_install)
  cmake_parse_arguments(arg "" "" "TARGETS;LIBRARIES" ${ARGN})
  if(arg_LIBRARIES)
    install(TARGETS ${arg_LIBRARIES}
      ARCHIVE DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
      LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
      RUNTIME DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
  endif()
  if(arg_TARGETS)
    install(TARGETS ${arg_TARGETS} RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  endif()
  if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/include/${PROJECT_NAME})
    install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
  endif()
endfunction()
