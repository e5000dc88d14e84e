# find_package(tessera) gives tessera::client: the client library with tessera/tessera.h (C) and tessera/tessera.hpp (C++17).
# It needs nothing else of the program that links it. tessera::connect is the way through a control plane, for development:
# tessera/connect.h and tessera/connect.hpp; it needs libcurl. tessera::local has worlds in the own process: tessera/local.h
# and tessera/local.hpp; it brings what a region needs. A game ships neither.
include(${CMAKE_CURRENT_LIST_DIR}/tesseraTargets.cmake)
