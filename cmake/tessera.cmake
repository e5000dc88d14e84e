# The vocabulary of this build: every library, program and test is declared by one of these calls.

# tessera_merge(NAME): compiles the target's sources as a few merged ones where TESSERA_MERGE is on, because most of the time of
# a first build goes into reading the same headers again. Sources include what they use all the same, and no two of a target
# give one name to two things. A source with compile options of its own stays by itself.
option(TESSERA_MERGE "Compile the sources of a target as a few merged ones" OFF)
function(tessera_merge name)
  if(TESSERA_MERGE)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 24)
  endif()
endfunction()

# tessera_library(NAME SOURCES... [DEPS target...]): a static library, position independent because the client SDK is shared.
function(tessera_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;DEPS" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PUBLIC tessera_options ${arg_DEPS})
  tessera_merge(${name})
  set_property(GLOBAL APPEND PROPERTY tessera_libraries ${name})
endfunction()

# tessera_program(NAME OUTPUT sources... DEPS target... [PACKAGE package] [NO_INSTALL]): an executable called OUTPUT in
# <build>/bin. It is installed with the Debian package of its name unless PACKAGE names another. What only developers run is
# not installed.
function(tessera_program name output)
  cmake_parse_arguments(arg "NO_INSTALL" "PACKAGE" "DEPS" ${ARGN})
  if(NOT arg_PACKAGE)
    set(arg_PACKAGE ${output})
  endif()
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE tessera_options ${arg_DEPS})
  set_target_properties(${name} PROPERTIES OUTPUT_NAME ${output}
                        RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
  tessera_merge(${name})
  if(NOT arg_NO_INSTALL)
    install(TARGETS ${name} RUNTIME DESTINATION bin COMPONENT ${arg_PACKAGE})
  endif()
endfunction()

# tessera_time_limit(NAME SECONDS): the time limit of a test that should end within SECONDS on two cores. The limit is to end tests
# that hang and no others, so it is twice that, times the cost of the sanitizer, times TESSERA_SLOWNESS. The longest tests begin
# first.
set(TESSERA_SLOWNESS 1 CACHE STRING "Factor of the time limits of tests, for slow and busy machines")
function(tessera_time_limit name seconds)
  set(factor 2)
  foreach(cost address=3 undefined=2 thread=10)  # measured: 2, 1.5, 5 to 15 times the time
    string(REPLACE "=" ";" cost ${cost})
    list(POP_FRONT cost sanitizer)
    if(TESSERA_SANITIZE MATCHES ${sanitizer})
      math(EXPR factor "${factor} * ${cost}")
    endif()
  endforeach()
  math(EXPR limit "${seconds} * ${factor} * ${TESSERA_SLOWNESS}")
  set_tests_properties(${name} PROPERTIES TIMEOUT ${limit} COST ${seconds})
endfunction()

# tessera_test(NAME sources... [DEPS target...] [LABELS label...] [TIMEOUT seconds]): a GoogleTest program, one ctest case.
function(tessera_test name)
  cmake_parse_arguments(arg "" "TIMEOUT" "DEPS;LABELS" ${ARGN})
  if(NOT BUILD_TESTING)
    return()
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  if(NOT arg_LABELS)
    set(arg_LABELS unit)
  endif()
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE tessera_options ${arg_DEPS} GTest::gmock_main)
  tessera_merge(${name})
  target_compile_options(${name} PRIVATE ${TESSERA_TEST_OPTIONS})
  set_property(GLOBAL APPEND PROPERTY tessera_tests ${name})
  target_compile_definitions(${name} PRIVATE TESSERA_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
                             TESSERA_BINARY_DIR="${CMAKE_BINARY_DIR}")
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS "${arg_LABELS}")
  tessera_time_limit(${name} ${arg_TIMEOUT})
endfunction()

# tessera_fuzzer(NAME sources... [DEPS target...]): a libFuzzer program in <build>/fuzzers; only the preset `fuzz` builds it.
function(tessera_fuzzer name)
  cmake_parse_arguments(arg "" "" "DEPS" ${ARGN})
  if(NOT TESSERA_FUZZ)
    return()
  endif()
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE tessera_options ${arg_DEPS})
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/fuzzers)
  add_dependencies(fuzzers ${name})
endfunction()
