// SocketListener: listens on the control plane's Unix socket, and lets in only whom CheckPeer (restraint.h) does.
//
//   auto listener = SocketListener::Listen("/run/user/1000/tessera/control.sock",
//                                          [&](int fd) { grpc::AddInsecureChannelFromFd(server, fd); });
//
// Whoever opens the socket has all rights, and the kernel lets in every process of this user: a worker that was taken
// over as well, under `tessera up`. So a connection is judged by the process that dialled, before a byte of it is read.
// Whoever is refused finds it closed, and the log says why.
//
// Thread rule: `take` runs on the listener's own thread, and not after the destructor.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/accept_loop.h"
#include "telemetry/log_throttle.h"

namespace tessera::control {

class SocketListener {
 public:
  using Take = AcceptLoop::Take;

  // Nothing may be at `path` (PrepareSocket). Only this user, and root, can connect (mode 0600). UNAVAILABLE says why
  // the socket cannot be made.
  static absl::StatusOr<std::unique_ptr<SocketListener>> Listen(const std::string& path, Take take);
  // The socket is gone then; connections that were let in stay.
  ~SocketListener();
  SocketListener(const SocketListener&) = delete;
  SocketListener& operator=(const SocketListener&) = delete;

 private:
  SocketListener(std::string path, int listening, Take take);
  void Judge(int fd);

  const std::string path_;
  const Take take_;
  telemetry::LogThrottle refusals_;
  AcceptLoop loop_;  // last: its thread uses all others
};

}  // namespace tessera::control
