// GrpcServer: the control plane's gRPC services behind their doors: AccessService, HostService, InstanceService,
// SessionService, VisualService and AgentLinkService of tessera.v1, with health and reflection.
//
// Thread rule: start and end it from one thread; it serves on threads of gRPC, one for each open stream. No gRPC header
// is needed to use it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/authority.h"
#include "control_plane/control_metrics.h"
#include "control_plane/control_plane.h"
#include "control_plane/open_connections.h"

namespace tessera::control {

// Where to listen. See access.h for what each door serves, and to whom.
struct GrpcDoors {
  std::string socket;         // path of a Unix socket
  std::string operators;      // HOST:PORT, port 0 takes a free one; empty: none
  std::string players;        // likewise
  ConnectionLimits limits{};  // for each of the two
};

class GrpcServer {
 public:
  // With a TCP door, an authority is needed. UNAVAILABLE: "address 127.0.0.1:7700 is in use (grpc)"; INVALID_ARGUMENT
  // for an address that is none.
  static absl::StatusOr<std::unique_ptr<GrpcServer>> Start(const GrpcDoors& doors, std::optional<Authority> authority,
                                                           ControlPlane& plane, ControlMetrics& metrics);
  // Ends calls under way within half a second. Call ControlPlane::Stop first, so that waiting calls end by
  // themselves.
  ~GrpcServer();

  // As bound: "unix:/run/tessera/control.sock", "10.0.0.1:7700". Empty: there is no such door.
  const std::string& socket() const { return socket_; }
  const std::string& operators() const { return operators_; }
  const std::string& players() const { return players_; }

 private:
  struct Impl;
  GrpcServer();
  std::unique_ptr<Impl> impl_;
  std::string socket_, operators_, players_;
};

}  // namespace tessera::control
