#include "client_sdk/connect/own_door.h"
#include "host/control_socket.h"

namespace tessera::client {

std::string OwnControlSocket() { return host::DefaultControlSocket(); }

}  // namespace tessera::client
