// The control plane of a user's own machine: the one thing that differs by system in finding a door.
//
// Thread rule: free function; nobody may change the environment meanwhile.
#pragma once

#include <string>

namespace tessera::client {

// The socket of this user's `tessera up`; empty: there is none on this system.
std::string OwnControlSocket();

}  // namespace tessera::client
