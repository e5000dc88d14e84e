// Game files as commands take them.
#pragma once

#include <string>

#include "tessera/v1/instance.pb.h"

namespace tessera::local {

// Reads the file; what is in it is checked by the control plane. CommandError names a file that cannot be read, is
// empty or larger than a game may be, or has a name that cannot be sent.
v1::GameSource LoadGame(const std::string& path);

// The game of a new world: a file as above, or a native game, "native:NAME" or "native:NAME@SHA256". CommandError also
// names what is wrong with such a name.
void SetGame(const std::string& game, v1::InstanceSpec& spec);

// The movement beside a new world's Lua file, "native:NAME" or "native:NAME@SHA256". CommandError: it is no such name.
void SetMovement(const std::string& movement, v1::InstanceSpec& spec);

}  // namespace tessera::local
