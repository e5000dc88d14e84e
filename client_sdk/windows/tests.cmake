# The library's unit tests for Windows, which `./dev package-sdk --windows --try` runs by Wine: those that need no
# protobuf, gRPC or process beside them. They are linked with the very objects that are in the library. GoogleTest comes
# from its sources (Debian: googletest).
set(sources_of_googletest /usr/src/googletest)
if(NOT EXISTS ${sources_of_googletest}/CMakeLists.txt)
  message(FATAL_ERROR "TESSERA_CLIENT_TESTS: ${sources_of_googletest} is missing; install the package googletest")
endif()
set(INSTALL_GTEST OFF)
add_subdirectory(${sources_of_googletest} ${CMAKE_BINARY_DIR}/googletest EXCLUDE_FROM_ALL)
add_custom_target(windows_tests)

# windows_test(NAME FOLDER source...): the sources of a test of that name on Linux that can run here.
function(windows_test name folder)
  list(TRANSFORM ARGN PREPEND ${CMAKE_SOURCE_DIR}/${folder}/)
  add_executable(${name} EXCLUDE_FROM_ALL ${ARGN} ${objects})
  target_include_directories(${name} BEFORE PRIVATE ${CMAKE_SOURCE_DIR}/client_sdk/plain_abseil)
  target_link_libraries(${name} PRIVATE tessera_options PkgConfig::bullet PkgConfig::enet PkgConfig::sodium gmock_main
                        enet sodium BulletCollision LinearMath)
  if(WIN32)
    target_link_libraries(${name} PRIVATE ws2_32 winmm advapi32)
  endif()
  # Less time to compile; and at -O3 GCC warns of sizes that no comparison has.
  target_compile_options(${name} PRIVATE -O1 -Wno-stringop-overread)
  target_link_options(${name} PRIVATE -Wl,--gc-sections)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  tessera_merge(${name})
  add_dependencies(windows_tests ${name})
endfunction()

windows_test(client_test client_sdk command_queue_test.cpp input_queue_test.cpp playout_clock_test.cpp stats_test.cpp
             world_view_test.cpp)
windows_test(prediction_test client_sdk ground_test.cpp)
windows_test(plain_abseil_test client_sdk plain_abseil/plain_abseil_test.cpp)
windows_test(credential_test net credential_test.cpp join_grant_test.cpp)
windows_test(acceptor_test net acceptor_proof_test.cpp acceptor_test.cpp channel_test.cpp enet_adapter_test.cpp
             handshake_test.cpp limits_test.cpp)
windows_test(replication_test core/replication bit_stream_test.cpp command_test.cpp input_test.cpp interest_test.cpp
             movement_news_test.cpp quantize_test.cpp record_cache_test.cpp region_figures_test.cpp
             scene_transfer_test.cpp snapshot_loss_test.cpp snapshot_test.cpp)
windows_test(codec_test core/replication codec/codec_parts_test.cpp codec/dense_codec_test.cpp
             codec/fast_record_test.cpp)
windows_test(snapshot_size_test core/replication snapshot_size_test.cpp)
windows_test(properties_test core/world body_tuning_test.cpp bytes_test.cpp movement_test.cpp player_input_test.cpp
             player_limits_test.cpp player_name_test.cpp utf8_test.cpp)
windows_test(state_check_test core/world state_check_test.cpp)
windows_test(partition_map_test core/world partition_change_test.cpp)
