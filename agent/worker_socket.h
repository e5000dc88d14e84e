// WorkerSocket: WorkerLinkService on a Unix socket, where this host's workers attach.
//
//   auto socket = WorkerSocket::Serve("/var/lib/tessera/agent.sock", {.on_message = ..., .on_closed = ...});
//   (*socket)->Send(connection, order);
//
// Only this user can connect (mode 0600). Which process is behind a connection comes from the kernel (peer_listener.h);
// which worker it is, its first message, a report, says and the caller judges. Of orders, and of leases, that wait for
// a slow worker only the last is kept: each is whole. Thread rule: every method from any thread. Callbacks run on
// gRPC's threads and must not block; none comes after the destructor has returned.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::agent {

using ConnectionId = std::uint64_t;  // never used twice

class WorkerSocket {
 public:
  struct Callbacks {
    std::function<void(ConnectionId, pid_t peer, v1::WorkerMessage)> on_message;  // 0: nobody knows who
    std::function<void(ConnectionId)> on_closed;
    // This process said more than WorkerBudget lets it: its connection is being ended.
    std::function<void(pid_t peer)> on_flood = [](pid_t) {};
  };
  // UNAVAILABLE if the socket cannot be made. A file at `path` is replaced.
  static absl::StatusOr<std::unique_ptr<WorkerSocket>> Serve(const std::string& path, Callbacks callbacks);
  virtual ~WorkerSocket() = default;

  // To a connection that is no more: nothing.
  virtual void Send(ConnectionId connection, const v1::WorkerOrder& order) = 0;
  virtual void SendLease(ConnectionId connection, const v1::LeaseRenewal& renewal) = 0;
  virtual void Close(ConnectionId connection, const absl::Status& status) = 0;
};

}  // namespace tessera::agent
