# ctest has 14 places (CMakePresets.json) for two processors, since most tests wait for motors and use a twentieth of one. A test that
# fills a processor, or judges time, takes this many (PROCESSORS); one with devices that must answer within milliseconds takes 3, any
# other 1. So two that compute run at a time, with up to four that wait beside them.
set(LENSD_ONE_PROCESSOR 5)
# A first run, as CI's is, knows no test's time: ctest then begins those of the greatest COST. It is 100 a place, because what waits fits
# into the places that what computes leaves, and not the other way round, and the seconds of a test that takes more than twenty.
set(LENSD_COST_OF_A_PLACE 100)

# lensd_room(NAME SOURCES ... [ROOMS ...] [LIBRARIES ...] [PRIVATE_LIBRARIES ...] [COMPUTES | WAITS])
# One static library a room, with its own include path NAME/include; private headers are included by their path from the root.
# ROOMS are the rooms its headers use. COMPUTES: pixels and limits by the thousand, and hardly parses. WAITS: for devices, more than it computes.
function(lensd_room name)
  cmake_parse_arguments(ROOM "COMPUTES;WAITS" "" "SOURCES;ROOMS;LIBRARIES;PRIVATE_LIBRARIES" ${ARGN})
  set(target room_${name})
  if(ROOM_SOURCES)
    add_library(${target} STATIC ${ROOM_SOURCES})
    set(visibility PUBLIC)
    lensd_join(${target})
    target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
    target_link_libraries(${target} PRIVATE ${ROOM_PRIVATE_LIBRARIES})
    if(ROOM_COMPUTES)
      lensd_untraced(${target})
    endif()
    if(ROOM_WAITS)
      lensd_waits(${target})
    endif()
  else()
    add_library(${target} INTERFACE)
    set(visibility INTERFACE)
  endif()
  target_include_directories(${target} ${visibility} ${CMAKE_CURRENT_SOURCE_DIR}/include)
  list(TRANSFORM ROOM_ROOMS PREPEND room_)
  target_link_libraries(${target} ${visibility} ${ROOM_ROOMS} ${ROOM_LIBRARIES})
endfunction()

# lensd_join(TARGET [COUNT]): compiles the sources of a target together, COUNT (6) at a time, where LENSD_JOIN is on: headers are read,
# and templates compiled, once a unit instead of once a file. Names in unnamed namespaces must then differ within a target.
# Sources that Highway compiles once an instruction set stay alone.
function(lensd_join target)
  if(NOT LENSD_JOIN)
    return()
  endif()
  set(count 6)
  if(ARGC GREATER 1)
    set(count ${ARGV1})
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${count})
  # CLI11 costs each unit that reads it five seconds: sources with it come first, and so are joined with each other.
  get_target_property(sources ${target} SOURCES)
  set(with)
  set(without)
  foreach(source IN LISTS sources)
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} OUTPUT_VARIABLE path)
    set(found)
    if(EXISTS ${path})
      file(STRINGS ${path} found REGEX "^#include <CLI/CLI.hpp>" LIMIT_COUNT 1)
    endif()
    if(found)
      list(APPEND with ${source})
    else()
      list(APPEND without ${source})
    endif()
  endforeach()
  set_property(TARGET ${target} PROPERTY SOURCES ${with} ${without})
  # A class of one source may well use that source's own types: joined, GCC takes them for a header's. And clang sees a
  # local name shadow that of another source.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>
                                           $<$<CXX_COMPILER_ID:Clang>:-Wno-shadow>)
endfunction()

# lensd_untraced(TARGET): fuzzers learn from the numbers that code compares, by a call for each; such calls take more than half
# the time of what computes, and its tests' under AddressSanitizer. They still see which branches it takes.
function(lensd_untraced target)
  if(LENSD_FUZZ)
    target_compile_options(${target} PRIVATE -fno-sanitize-coverage=trace-cmp)
  endif()
endfunction()

# lensd_unguided(TARGET): what no fuzzer runs, as tests, needs none of the counters by which fuzzers find their way.
function(lensd_unguided target)
  if(LENSD_FUZZ)
    target_compile_options(${target} PRIVATE -fno-sanitize-coverage=trace-cmp,inline-8bit-counters,indirect-calls,pc-table,stack-depth)
  endif()
endfunction()

# lensd_waits(TARGET): what waits more than it computes is not optimised where AddressSanitizer and the fuzzers' calls double it: that
# is half of the time to compile it. ThreadSanitizer's build optimises it: its tests would take 1.6 times the processor.
function(lensd_waits target)
  if(LENSD_FUZZ)
    target_compile_options(${target} PRIVATE -O0)
  endif()
endfunction()

# lensd_plain(TARGET): tests that do not compute are optimised by no sanitizer.
function(lensd_plain target)
  if(CMAKE_BUILD_TYPE STREQUAL Debug AND CMAKE_CXX_FLAGS_DEBUG MATCHES "-fsanitize=")
    target_compile_options(${target} PRIVATE -O0)
  endif()
endfunction()

# lensd_quick(TARGET): as lensd_plain(), and the release build does not optimise it either: compiled in two thirds of the time.
function(lensd_quick target)
  lensd_plain(${target})
  if(CMAKE_BUILD_TYPE STREQUAL Release)
    target_compile_options(${target} PRIVATE -O0)
  endif()
endfunction()

# lensd_test_program(NAME SOURCES ... ROOMS ... [LIBRARIES ...] [COMPUTES | DRAWS | QUICK]): the GoogleTest program test_NAME.
function(lensd_test_program name)
  cmake_parse_arguments(TEST "COMPUTES;DRAWS;QUICK" "" "SOURCES;ROOMS;LIBRARIES" ${ARGN})
  list(TRANSFORM TEST_ROOMS PREPEND room_)
  add_executable(test_${name} ${TEST_SOURCES})
  target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/tests/support)
  target_compile_definitions(test_${name} PRIVATE LENSD_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                                                  LENSD_BINARY_DIR="${PROJECT_BINARY_DIR}")
  target_link_libraries(test_${name} PRIVATE ${TEST_ROOMS} ${TEST_LIBRARIES} GTest::gtest GTest::gmock GTest::gtest_main)
  lensd_join(test_${name})
  lensd_unguided(test_${name})
  # What a test calls is optimised as what ships; the test itself need not be, unless it COMPUTES for seconds, and is half of what a
  # release build compiles. One that DRAWS its own pictures does so for minutes where a sanitizer does not optimise it. One that is
  # QUICK, or waits, has nothing to gain.
  if(TEST_QUICK)
    lensd_quick(test_${name})
  elseif(NOT TEST_COMPUTES)
    target_compile_options(test_${name} PRIVATE $<$<CONFIG:Release>:-O1>)
    if(NOT TEST_DRAWS)
      lensd_plain(test_${name})
    endif()
  endif()
endfunction()

# lensd_test(NAME SOURCES ... ROOMS ... [LIBRARIES ...] [LABELS ...] [TIMEOUT seconds] [WAITS] [COMPUTES | DRAWS | BUSY] [LOCK name] [RUN_BY ...])
# The same; every test in it becomes a ctest. Label `slow` keeps it out of script/test --fast. A test counts as one
# that fills a processor unless it WAITS for devices; if it is slow too, it has a lower priority than what must answer in time. Tests of
# one LOCK run one after the other, while ctest runs others. BUSY: not slow, but more than a second slower where the release build does
# not optimise it. RUN_BY: a program and its arguments that run the test, whose command
# follows them.
function(lensd_test name)
  cmake_parse_arguments(TEST "WAITS;COMPUTES;DRAWS;BUSY" "TIMEOUT;LOCK" "SOURCES;ROOMS;LIBRARIES;LABELS;RUN_BY" ${ARGN})
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 120)
  endif()
  set(processors ${LENSD_ONE_PROCESSOR})
  if(TEST_WAITS)
    set(processors 3)
  endif()
  set(computes)
  if(TEST_COMPUTES)
    set(computes COMPUTES)
  elseif(TEST_DRAWS)
    set(computes DRAWS)
  elseif(NOT TEST_BUSY AND (TEST_WAITS OR NOT ("slow" IN_LIST TEST_LABELS OR LENSD_TESTS_COMPUTE)))
    set(computes QUICK)
  endif()
  lensd_test_program(${name} SOURCES ${TEST_SOURCES} ROOMS ${TEST_ROOMS} LIBRARIES ${TEST_LIBRARIES} ${computes})
  if("slow" IN_LIST TEST_LABELS AND NOT TEST_WAITS)
    find_program(LENSD_NICE nice REQUIRED)
    set(TEST_RUN_BY ${LENSD_NICE} -n 5)
  endif()
  if(TEST_RUN_BY)  # gtest_discover_tests() puts this before each test, whatever the machine
    set_property(TARGET test_${name} PROPERTY CROSSCOMPILING_EMULATOR ${TEST_RUN_BY})
  endif()
  gtest_discover_tests(test_${name} DISCOVERY_MODE PRE_TEST TEST_PREFIX ${name}. TEST_LIST test_${name}_names)
  # gtest_discover_tests() loses all but the first of several labels, and whatever follows them.
  string(JOIN ";" labels ${name} ${TEST_LABELS})
  math(EXPR cost "${LENSD_COST_OF_A_PLACE} * ${processors}")
  if("slow" IN_LIST TEST_LABELS)
    math(EXPR cost "${cost} + 10")
  endif()
  set(properties "TIMEOUT ${TEST_TIMEOUT} PROCESSORS ${processors} COST ${cost} LABELS \"${labels}\"")
  if(TEST_LOCK)
    string(APPEND properties " RESOURCE_LOCK ${TEST_LOCK}")
  endif()
  set(file ${CMAKE_CURRENT_BINARY_DIR}/test_${name}_properties.cmake)
  file(CONFIGURE OUTPUT ${file} @ONLY CONTENT [[
foreach(test IN LISTS test_@name@_names)
  set_tests_properties("${test}" PROPERTIES @properties@)
endforeach()
]])
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${file})
endfunction()
