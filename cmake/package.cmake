# Debian packages, one for each component that is installed: `./dev package` makes them of the release build.
#
# The same commit gives the same bytes, given the same compiler and libraries: times come from SOURCE_DATE_EPOCH, which ./dev
# sets to the time of the commit. What a program links becomes a dependency by dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "Tessera")
set(CPACK_PACKAGE_CONTACT "Tessera developers <tessera@localhost>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL tessera-control tessera-agent tessera-gateway tessera-cli sdk game)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION games)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# tessera_package(COMPONENT [NAME name] TEXT text [DEPENDS list] [RECOMMENDS list] [CONTROL file...]): the
# package of a component. CONTROL names maintainer scripts, in deploy/packages/<component>/.
function(tessera_package component)
  cmake_parse_arguments(arg "" "NAME;TEXT;DEPENDS;RECOMMENDS" "CONTROL" ${ARGN})
  if(NOT arg_NAME)
    set(arg_NAME ${component})
  endif()
  string(TOUPPER ${component} key)
  set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${arg_NAME} PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_FILE_NAME DEB-DEFAULT PARENT_SCOPE)
  set(CPACK_COMPONENT_${key}_DESCRIPTION "${arg_TEXT}" PARENT_SCOPE)
  install(FILES ${CMAKE_SOURCE_DIR}/LICENSE DESTINATION share/doc/${arg_NAME} RENAME copyright COMPONENT ${component})
  set(CPACK_DEBIAN_${key}_PACKAGE_DEPENDS "${arg_DEPENDS}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_RECOMMENDS "${arg_RECOMMENDS}" PARENT_SCOPE)
  list(TRANSFORM arg_CONTROL PREPEND ${CMAKE_SOURCE_DIR}/deploy/packages/${component}/)
  set(CPACK_DEBIAN_${key}_PACKAGE_CONTROL_EXTRA "${arg_CONTROL}" PARENT_SCOPE)
endfunction()

set(users "systemd | systemd-standalone-sysusers")
tessera_package(tessera-control DEPENDS "${users}"
  TEXT "The control plane keeps hosts, worlds and players, places the regions of worlds on hosts, and lets players in. One a cluster."
  CONTROL postinst prerm postrm)
tessera_package(tessera-agent DEPENDS "${users}"
  TEXT "An agent, one on each host, starts a worker for each region of a world that is placed there, and looks after it."
  CONTROL preinst postinst prerm postrm)
tessera_package(tessera-gateway
  TEXT "A gateway serves a page that draws a world in 3D, its regions and what they cost, to any browser."
  CONTROL postinst prerm postrm)
tessera_package(tessera-cli RECOMMENDS "tessera-control, tessera-agent, tessera-gateway"
  TEXT "The command line manages clusters. `tessera demo` and `tessera up` run a whole one on this machine. It comes with scenes and a sample game.")
tessera_package(sdk NAME libtessera-client-dev
  TEXT "The client library that games embed: C and C++ interface, CMake package, examples, and the protocol for backends.")
set(CPACK_DEBIAN_SDK_PACKAGE_SECTION libdevel)
tessera_package(game NAME libtessera-game-dev DEPENDS "libtessera-client-dev"
  TEXT "Headers for game logic in C and C++: the interface between a region worker and a native game module.")
set(CPACK_DEBIAN_GAME_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_GAME_PACKAGE_SHLIBDEPS OFF)

include(CPack)
