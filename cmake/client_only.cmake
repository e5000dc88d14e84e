# TESSERA_CLIENT_ONLY builds the client library that games ship, and the one by which they join in development: neither
# needs gRPC, protobuf or Abseil, so they can be built where those are not to be had, as for Windows
# (client_sdk/windows). Only `tessera_client_shared` and `tessera_connect_shared` are targets to build, and `windows_tests`
# with TESSERA_CLIENT_TESTS; all others are declared because their sources are these libraries', and their packages are
# missing.
set(BUILD_TESTING OFF)
option(TESSERA_CLIENT_TESTS "Declare the library's unit tests that need nothing else, too" OFF)
set(TESSERA_CLIENT_PREFIX "" CACHE PATH
    "A folder with include and lib of ENet, libsodium, Bullet and libcurl; empty: those of the system")

find_package(Threads REQUIRED)
# The folder plain_abseil stands for it (decision 0047).
foreach(name btree flat_hash_map inlined_vector status statusor strings)
  add_library(absl::${name} INTERFACE IMPORTED GLOBAL)
endforeach()
if(TESSERA_CLIENT_PREFIX)
  foreach(name bullet enet sodium)
    add_library(PkgConfig::${name} INTERFACE IMPORTED GLOBAL)
    target_include_directories(PkgConfig::${name} INTERFACE ${TESSERA_CLIENT_PREFIX}/include)
  endforeach()
  target_include_directories(PkgConfig::bullet INTERFACE ${TESSERA_CLIENT_PREFIX}/include/bullet)
  target_compile_definitions(PkgConfig::sodium INTERFACE SODIUM_STATIC)
  link_directories(${TESSERA_CLIENT_PREFIX}/lib)
else()
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(bullet REQUIRED IMPORTED_TARGET GLOBAL bullet)
  pkg_check_modules(enet REQUIRED IMPORTED_TARGET GLOBAL libenet)
  pkg_check_modules(sodium REQUIRED IMPORTED_TARGET GLOBAL libsodium)
endif()
# Declarations name them, and nothing here builds with them.
foreach(name PkgConfig::lua)
  add_library(${name} INTERFACE IMPORTED GLOBAL)
endforeach()
# For the way through a control plane, which is for development.
foreach(name CURL::libcurl nlohmann_json::nlohmann_json)
  add_library(${name} INTERFACE IMPORTED GLOBAL)
  if(TESSERA_CLIENT_PREFIX)
    target_include_directories(${name} INTERFACE ${TESSERA_CLIENT_PREFIX}/include)
  endif()
endforeach()
if(TESSERA_CLIENT_PREFIX)
  target_compile_definitions(CURL::libcurl INTERFACE CURL_STATICLIB)
endif()

foreach(folder game_sdk core net client_sdk)
  add_subdirectory(${folder} EXCLUDE_FROM_ALL)
endforeach()
