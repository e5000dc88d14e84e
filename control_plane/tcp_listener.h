// TcpListener: listens at a TCP door of the control plane, and hands on as many connections as OpenConnections allows.
//
//   auto listener = TcpListener::Listen(address, "operators", limits, metrics, [&](int fd) { ... });
//
// gRPC 1.51 has no limit of connections, so the control plane accepts them itself (decision 92). One too many finds
// itself closed before a byte of it is read; a metric counts it, and the log says so, at a bounded rate.
//
// Thread rule: `take` runs on the listener's own thread, and not after the destructor.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/accept_loop.h"
#include "control_plane/control_metrics.h"
#include "control_plane/open_connections.h"
#include "host/socket_address.h"
#include "telemetry/log_throttle.h"

namespace tessera::control {

class TcpListener {
 public:
  // A name may lead to several addresses, and all are listened at; "0.0.0.0" is every address of this machine, of IPv6
  // too, as it is to gRPC. `door` is its name in metrics and logs: "operators" or "players". `metrics` outlives it.
  // INVALID_ARGUMENT: the name leads nowhere. UNAVAILABLE: "address 127.0.0.1:7700 is in use (operators)".
  static absl::StatusOr<std::unique_ptr<TcpListener>> Listen(const host::SocketAddress& address, std::string door,
                                                             ConnectionLimits limits, ControlMetrics& metrics,
                                                             AcceptLoop::Take take);
  // Nothing is accepted any more; connections that were handed on stay.
  ~TcpListener();
  TcpListener(const TcpListener&) = delete;
  TcpListener& operator=(const TcpListener&) = delete;

  const host::SocketAddress& address() const { return address_; }  // with the port that was bound

 private:
  TcpListener(host::SocketAddress address, std::string door, ConnectionLimits limits, ControlMetrics& metrics,
              std::vector<int> listening, AcceptLoop::Take take);
  void Take(int fd);

  const host::SocketAddress address_;
  const std::string door_;
  ControlMetrics& metrics_;
  const AcceptLoop::Take take_;
  OpenConnections open_;
  telemetry::LogThrottle refusals_;
  AcceptLoop loop_;  // last: its thread uses all others
};

}  // namespace tessera::control
