// Game files as commands take them.
#pragma once

#include <string>

#include "tessera/v1/instance.pb.h"

namespace tessera::local {

// Reads the file; what is in it is checked by the control plane. CommandError names a file that cannot be read or is
// larger than a game may be.
v1::GameSource LoadGame(const std::string& path);

}  // namespace tessera::local
