# Reads the headers of the standard library, and GoogleTest's in tests, once a build instead of once a unit: about a second of
# processor a unit, of four to fourteen. Builds of joined sources by clang do so, which are the sanitizers'. GCC 12 does not: with such
# headers it no longer knows at -O3 what is a system header, and warns of overlong copies that are none.
if(LENSD_JOIN AND CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  set(LENSD_PRECOMPILE ON)
  # So that a compiler cache knows them: by what they contain, not by when they were made.
  add_compile_options("SHELL:-Xclang -fno-pch-timestamp")
endif()

# Targets that compile C++ below a folder.
function(lensd_compiled folder result)
  get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  set(compiled)
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    get_target_property(sources ${target} SOURCES)
    if(type MATCHES "^(STATIC_LIBRARY|OBJECT_LIBRARY|EXECUTABLE)$" AND sources MATCHES "\\.cpp(;|$)")
      list(APPEND compiled ${target})
    endif()
  endforeach()
  get_property(subfolders DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(subfolder IN LISTS subfolders)
    lensd_compiled(${subfolder} below)
    list(APPEND compiled ${below})
  endforeach()
  set(${result} ${compiled} PARENT_SCOPE)
endfunction()

# lensd_precompile_headers(): for every target of this build; called once, after all are known. Clang asks for headers of the
# same optimisation (some or none), GCC for those of the same language alone.
function(lensd_precompile_headers)
  if(NOT LENSD_PRECOMPILE)
    return()
  endif()
  set(standard <algorithm> <array> <atomic> <charconv> <chrono> <cmath> <condition_variable> <cstdint> <expected> <filesystem>
      <fstream> <functional> <iostream> <limits> <map> <memory> <mutex> <numeric> <optional> <random> <set> <span> <sstream>
      <string> <string_view> <thread> <tuple> <unordered_map> <utility> <variant> <vector>)
  lensd_compiled(${PROJECT_SOURCE_DIR} targets)
  file(CONFIGURE OUTPUT headers.cpp CONTENT "")  # left as it is when configured again
  foreach(target IN LISTS targets)
    get_target_property(language ${target} CXX_STANDARD)
    get_target_property(independent ${target} POSITION_INDEPENDENT_CODE)
    if(NOT language EQUAL CMAKE_CXX_STANDARD OR independent)
      continue()
    endif()
    get_target_property(options ${target} COMPILE_OPTIONS)
    get_target_property(libraries ${target} LINK_LIBRARIES)
    set(kind headers)
    if(CMAKE_CXX_COMPILER_ID STREQUAL Clang AND options MATCHES "(^|;)-O0")
      string(APPEND kind _unoptimised)
    endif()
    if(libraries MATCHES "GTest::")
      string(APPEND kind _of_tests)
    endif()
    if(NOT TARGET ${kind})
      add_library(${kind} OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/headers.cpp)
      target_precompile_headers(${kind} PRIVATE ${standard})
      if(kind MATCHES _of_tests)
        find_package(GTest REQUIRED)  # tests/ has it for its own folder
        target_precompile_headers(${kind} PRIVATE <gmock/gmock.h> <gtest/gtest.h>)
        target_link_libraries(${kind} PRIVATE GTest::gtest GTest::gmock)
      endif()
      if(kind MATCHES unoptimised)
        target_compile_options(${kind} PRIVATE -O0)
      endif()
    endif()
    target_precompile_headers(${target} REUSE_FROM ${kind})
  endforeach()
endfunction()
