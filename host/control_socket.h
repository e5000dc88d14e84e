// Name of the socket at which a control plane of this machine is reached.
//
// Thread rule: free functions; nobody may change the environment meanwhile.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <string>

namespace tessera::host {

// The socket of this user's `tessera up`: in XDG_RUNTIME_DIR, or in a folder of /tmp that is the user's own.
inline std::string DefaultControlSocket() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  const std::string folder = runtime != nullptr && runtime[0] == '/' ? std::string(runtime) + "/tessera"
                                                                     : "/tmp/tessera-" + std::to_string(geteuid());
  return folder + "/control.sock";
}

}  // namespace tessera::host
