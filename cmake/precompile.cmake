# Precompiled headers, for most of the time of a build goes into reading the same headers again. Sources include what they use
# all the same; the presets `release` and `fuzz` and ./dev lint, which go without, hold them to it.
#
# tessera_precompile(): to be called when all targets are declared. Gives each that tessera_library or tessera_test declared
# the headers of what it links: plain, or those of the services as well; tests GoogleTest too. A library that is compiled with
# options of its own goes without.

# The headers of each kind, and what one must link to include them.
set(plain_headers <algorithm> <array> <chrono> <cmath> <functional> <map> <memory> <optional> <set> <span> <string>
    <utility> <vector> <absl/status/status.h> <absl/status/statusor.h> <absl/strings/str_cat.h> <absl/strings/str_join.h>)
set(plain_targets absl::status absl::statusor absl::strings)
set(services_headers ${plain_headers} <grpcpp/grpcpp.h> <nlohmann/json.hpp> <tessera/v1/agent_link.grpc.pb.h>
    <tessera/v1/game.pb.h> <tessera/v1/host.grpc.pb.h> <tessera/v1/instance.grpc.pb.h> <tessera/v1/scene.pb.h>
    <tessera/v1/session.grpc.pb.h> <tessera/v1/worker_link.grpc.pb.h>)
set(services_targets ${plain_targets} tessera_services nlohmann_json::nlohmann_json)

# Warnings of gcc's optimiser: for what it inlines from a precompiled header it forgets that this is a system header,
# and there it is often wrong. The preset `release` goes without precompiled headers and has these warnings as errors.
set(unsure -Wno-array-bounds -Wno-dangling-pointer -Wno-free-nonheap-object -Wno-maybe-uninitialized
    -Wno-mismatched-new-delete -Wno-nonnull -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread -Wno-stringop-truncation
    -Wno-use-after-free)

# tessera_precompiled(KIND HEADERS header... TARGETS target... [OPTIONS option...]): one kind, compiled as all that use it are.
function(tessera_precompiled kind)
  cmake_parse_arguments(arg "" "" "HEADERS;TARGETS;OPTIONS" ${ARGN})
  set(name tessera_precompiled_${kind})
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/precompiled/${kind}.cpp CONTENT "")
  add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/precompiled/${kind}.cpp)
  target_link_libraries(${name} PRIVATE tessera_options ${arg_TARGETS})
  target_compile_options(${name} PRIVATE ${arg_OPTIONS})
  target_precompile_headers(${name} PRIVATE ${arg_HEADERS})
  # Not by the compiler cache: to make the key it lets gcc preprocess the header, and gcc then takes the precompiled one of
  # before, so that the key says nothing of a contract that has changed and the old one comes back.
  set_target_properties(${name} PROPERTIES CXX_COMPILER_LAUNCHER "")
endfunction()

# Whether `target` links `wanted`, itself or through others.
function(tessera_links target wanted result)
  set(seen "")
  set(open ${target})
  while(open)
    list(POP_FRONT open next)
    if(next STREQUAL wanted)
      set(${result} TRUE PARENT_SCOPE)
      return()
    endif()
    if(NOT TARGET ${next} OR next IN_LIST seen)
      continue()
    endif()
    list(APPEND seen ${next})
    get_target_property(links ${next} LINK_LIBRARIES)
    if(links)
      list(APPEND open ${links})
    endif()
  endwhile()
  set(${result} FALSE PARENT_SCOPE)
endfunction()

function(tessera_precompile)
  get_property(libraries GLOBAL PROPERTY tessera_libraries)
  get_property(tests GLOBAL PROPERTY tessera_tests)
  foreach(kind plain services)
    tessera_precompiled(${kind} HEADERS ${${kind}_headers} TARGETS ${${kind}_targets})
    if(BUILD_TESTING)
      tessera_precompiled(${kind}_test HEADERS <gmock/gmock.h> <gtest/gtest.h> ${${kind}_headers}
                          TARGETS ${${kind}_targets} GTest::gmock OPTIONS ${TESSERA_TEST_OPTIONS} -fPIE)
    endif()
  endforeach()
  foreach(target ${libraries} ${tests})
    get_target_property(own_options ${target} COMPILE_OPTIONS)
    if(own_options AND NOT target IN_LIST tests)
      continue()
    endif()
    tessera_links(${target} tessera_services services)
    if(services)
      set(kind services)
    else()
      set(kind plain)
    endif()
    if(target IN_LIST tests)
      string(APPEND kind _test)
    endif()
    target_precompile_headers(${target} REUSE_FROM tessera_precompiled_${kind})
    target_compile_options(${target} PRIVATE -fpch-preprocess ${unsure})  # the first for ccache
  endforeach()
endfunction()
