#include "client_sdk/connect/own_door.h"

namespace tessera::client {

std::string OwnControlSocket() { return ""; }

}  // namespace tessera::client
