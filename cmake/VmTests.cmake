# lensd_vm_test(NAME name (TARGET target | COMMAND program) [ARGUMENTS ...] [MODULES "name param=value" ...]
#                  [TIMEOUT seconds] [UDEV] [SYSTEMD])
# A suite that runs in the virtual machine of script/vm, as root, in the build folder, after the kernel modules are
# loaded in that order (they are unloaded after it). TARGET is an executable of this build: usually a GoogleTest program
# made with lensd_vm_program(). It becomes the ctest bench.NAME, whose output is the suite's log. Suites run one
# after the other in one boot, or in two side by side where there are two processors. UDEV: with udevd running. SYSTEMD: after all others, with systemd as the first process.
# TIMEOUT: seconds in the guest, which is about five times slower than the host (default 60).
file(REMOVE_RECURSE ${PROJECT_BINARY_DIR}/vm/suites)

function(lensd_vm_test)
  if(NOT LENSD_VM_TESTS)
    return()
  endif()
  cmake_parse_arguments(SUITE "UDEV;SYSTEMD" "NAME;TARGET;COMMAND;TIMEOUT" "ARGUMENTS;MODULES" ${ARGN})
  if(NOT SUITE_TIMEOUT)
    set(SUITE_TIMEOUT 60)
  endif()
  if(CMAKE_CXX_FLAGS_DEBUG MATCHES sanitize AND CMAKE_BUILD_TYPE STREQUAL Debug)
    math(EXPR SUITE_TIMEOUT "3 * ${SUITE_TIMEOUT}")
  endif()
  if(SUITE_TARGET)
    set(SUITE_COMMAND $<TARGET_FILE:${SUITE_TARGET}>)
  endif()
  set(lines "timeout=${SUITE_TIMEOUT}" "argument=${SUITE_COMMAND}")
  foreach(argument IN LISTS SUITE_ARGUMENTS)
    list(APPEND lines "argument=${argument}")
  endforeach()
  foreach(module IN LISTS SUITE_MODULES)
    list(APPEND lines "module=${module}")
  endforeach()
  if(SUITE_UDEV)
    list(APPEND lines "udev=1")
  endif()
  if(SUITE_SYSTEMD)
    list(APPEND lines "systemd=1")
  endif()
  list(JOIN lines "\n" content)
  file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/vm/suites/${SUITE_NAME}.suite CONTENT "${content}\n")
  get_property(has_boot GLOBAL PROPERTY LENSD_VM_BOOT)
  if(NOT has_boot)
    set_property(GLOBAL PROPERTY LENSD_VM_BOOT TRUE)
    # Both guests use 1.1 processors. One test that computes fits beside them, which has a lower priority; beside more, their devices do
    # not answer in time.
    math(EXPR guests "2 * ${LENSD_ONE_PROCESSOR} - 1")
    add_test(NAME vm.boot COMMAND ${PROJECT_SOURCE_DIR}/script/vm run --boot-only --build ${PROJECT_BINARY_DIR})
    set_tests_properties(vm.boot PROPERTIES FIXTURES_SETUP vm SKIP_RETURN_CODE 77 TIMEOUT 1800 COST 1000
                                               PROCESSORS ${guests} LABELS "vm;slow")
  endif()
  add_test(NAME vm.${SUITE_NAME}
           COMMAND ${PROJECT_SOURCE_DIR}/script/vm result --build ${PROJECT_BINARY_DIR} ${SUITE_NAME})
  set_tests_properties(vm.${SUITE_NAME} PROPERTIES FIXTURES_REQUIRED vm SKIP_RETURN_CODE 77
                                                      LABELS "vm;slow")
endfunction()

# lensd_vm_program(NAME ...): as lensd_test_program(); only the virtual machine runs it.
function(lensd_vm_program name)
  lensd_test_program(${name} ${ARGN})
  if(NOT LENSD_VM_TESTS)
    set_target_properties(test_${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
endfunction()
