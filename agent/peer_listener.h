// PeerListener: listens on a Unix socket, and knows which process is behind each connection (SO_PEERCRED), which no
// message can change.
//
//   auto listener = PeerListener::Listen("/var/lib/tessera/agent.sock",
//                                        [&](int fd) { grpc::AddInsecureChannelFromFd(server, fd); });
//   (*listener)->PeerOf(fd);   // the process that dialled
//
// Only processes of this user are let in, each with a bounded number of connections (limits.h). A descriptor's number
// comes back only after all others were used, so a call of a connection that has just ended is not taken for one of the
// next. Thread rule: `take` runs on the listener's own thread; `PeerOf` from any; nothing runs after the destructor.
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "absl/status/statusor.h"

namespace tessera::agent {

class PeerListener {
 public:
  using Take = std::function<void(int fd)>;  // owns it from then on; it does not block

  // UNAVAILABLE if the socket cannot be made. A socket at `path` is replaced. Only this user can connect (mode 0600).
  static absl::StatusOr<std::unique_ptr<PeerListener>> Listen(const std::string& path, Take take);
  ~PeerListener();
  PeerListener(const PeerListener&) = delete;
  PeerListener& operator=(const PeerListener&) = delete;

  // 0: no connection that stands was handed out under this number.
  pid_t PeerOf(int fd) const;

 private:
  struct Connection {
    int given = -1;  // the number that was handed out; the key is our own, for the same connection
    pid_t peer = 0;
  };
  PeerListener(int listening, int stop, Take take);
  void Run();
  bool Accept();
  void LetIn(int fd);
  void CloseEnded(int fd);
  bool HasRoomFor(pid_t peer) const;
  int Number(int fd);

  const int listening_, stop_;
  const Take take_;
  int next_number_;
  mutable std::mutex mutex_;  // guards what follows
  std::map<int, Connection> connections_;
  std::thread thread_;
};

}  // namespace tessera::agent
