# The plug-in's sources, for the game that compiles them and for the test of this repository.
set(tessera_godot_sources bodies.cpp connect_library.cpp engine.cpp plugin.cpp registration.cpp world_node.cpp)
# Triangles of shapes: beside the others in the package, in the desktop client's sources in the repository.
set(tessera_godot_meshes ${CMAKE_CURRENT_LIST_DIR})
if(NOT EXISTS ${tessera_godot_meshes}/meshes.cpp)
  set(tessera_godot_meshes ${CMAKE_CURRENT_LIST_DIR}/../../samples/desktop)
endif()

set(TESSERA_GODOT_HEADERS "" CACHE PATH "Folder of Godot's gdextension_interface.h: abi.h is compared with it; may be empty")
set(tessera_godot_folder ${CMAKE_CURRENT_LIST_DIR})
function(tessera_godot_check_headers)
  if(TESSERA_GODOT_HEADERS)
    add_library(tessera_godot_abi_check OBJECT ${tessera_godot_folder}/abi_check.cpp)
    target_include_directories(tessera_godot_abi_check SYSTEM PRIVATE ${TESSERA_GODOT_HEADERS})
    target_compile_features(tessera_godot_abi_check PRIVATE cxx_std_17)
  endif()
endfunction()
