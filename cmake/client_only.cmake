# TESSERA_CLIENT_ONLY builds the client library that games ship and nothing else: it needs no gRPC, protobuf or Abseil,
# so it can be built where those are not to be had, as for Windows (client_sdk/windows). Only `tessera_client_shared` is
# a target to build; all others are declared because their sources are the library's, and their packages are missing.
set(BUILD_TESTING OFF)
set(TESSERA_CLIENT_PREFIX "" CACHE PATH
    "A folder with include and lib of ENet, libsodium and Bullet; empty: those of the system")

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
foreach(name PkgConfig::lua CURL::libcurl nlohmann_json::nlohmann_json)
  add_library(${name} INTERFACE IMPORTED GLOBAL)
endforeach()

foreach(folder game_sdk core net client_sdk)
  add_subdirectory(${folder} EXCLUDE_FROM_ALL)
endforeach()
