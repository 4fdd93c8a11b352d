# The manual pages of the daemons and of lens-bench, from their own --help. lensctl writes its own (cli/CMakeLists.txt).
include(GNUInstallDirs)
find_program(HELP2MAN help2man)
if(NOT HELP2MAN)
  message(STATUS "help2man is not there: no manual pages but lensctl's")
  return()
endif()

# lensd_manual(lensd 8 "what it is"): build/share/man/man8/lensd.8 by the program of that name.
function(lensd_manual program section what)
  if(NOT TARGET ${program})
    return()
  endif()
  set(folder ${CMAKE_BINARY_DIR}/share/man/man${section})
  set(page ${folder}/${program}.${section})
  set(runs $<TARGET_FILE:${program}>)
  if(CMAKE_CROSSCOMPILING)
    set(runs "${CMAKE_CROSSCOMPILING_EMULATOR} ${runs}")  # help2man gives it to a shell
  endif()
  file(MAKE_DIRECTORY ${folder})
  add_custom_command(OUTPUT ${page}
    COMMAND ${HELP2MAN} --no-info --section=${section} --source=lensd --name=${what} --output=${page} ${runs}
    DEPENDS ${program} VERBATIM)
  add_custom_target(${program}_manual ALL DEPENDS ${page})
  install(FILES ${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section})
endfunction()

lensd_manual(lensd 8 "serve motorised camera lenses over Varlink")
lensd_manual(lens-web 8 "live page and HTTP interface of lensd")
lensd_manual(lens-bench 1 "chart speed against accuracy of lensd")

# lensd_manual_of_page(PAGE.md name section "what it is" [HEADING]): the page of docs/ for a terminal.
find_program(LOWDOWN lowdown)
function(lensd_manual_of_page source name section what)
  if(NOT LOWDOWN)
    return()
  endif()
  set(folder ${CMAKE_BINARY_DIR}/share/man/man${section})
  set(page ${folder}/${name}.${section})
  file(MAKE_DIRECTORY ${folder})
  add_custom_command(OUTPUT ${page}
    COMMAND ${PROJECT_SOURCE_DIR}/script/manual ${PROJECT_SOURCE_DIR}/${source} ${name} ${section} ${what} ${ARGN} > ${page}
    DEPENDS ${PROJECT_SOURCE_DIR}/script/manual ${PROJECT_SOURCE_DIR}/${source} VERBATIM)
  add_custom_target(${name}_manual ALL DEPENDS ${page})
  install(FILES ${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section})
endfunction()

lensd_manual_of_page(docs/configuration.md lensd.toml 5 "configuration of lensd")
lensd_manual_of_page(scenes/README.md lens-scene 5 "what a simulated lens is and looks at" Keys)
lensd_manual_of_page(docs/interface.md io.lensd.Lens 7 "interface of lensd, over Varlink")
lensd_manual_of_page(docs/driver-interface.md io.lensd.Driver 7 "interface of a driver of lensd that is a process")
