# find_package(tessera) gives tessera::client: the client library with tessera/tessera.h (C) and tessera/tessera.hpp (C++17).
# It needs nothing else of the program that links it.
include(${CMAKE_CURRENT_LIST_DIR}/tesseraTargets.cmake)
