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
endmacro()

# vcharge_add_gtest(NAME SOURCES a_test.cpp... [LIBRARIES target...])
function(vcharge_add_gtest name)
  cmake_parse_arguments(arg "" "" "SOURCES;LIBRARIES" ${ARGN})
  if(NOT CATKIN_ENABLE_TESTING)
    return()
  endif()
  catkin_add_gtest(${name} ${arg_SOURCES})
  if(TARGET ${name})
    target_link_libraries(${name} gtest_main gmock ${arg_LIBRARIES})
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
