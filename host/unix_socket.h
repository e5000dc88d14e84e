// Listening on a socket in the file system, for processes of this machine.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace tessera::host {

// A descriptor that listens at `path` (AF_UNIX, SOCK_STREAM) without blocking; the caller closes it and removes the
// file. Nothing may be at `path`, which has at most 107 bytes. Only this user, and root, can connect (mode 0600), from
// the first moment on. UNAVAILABLE: "socket PATH: REASON".
absl::StatusOr<int> ListenOnUnixSocket(const std::string& path);

}  // namespace tessera::host
